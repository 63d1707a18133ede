from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gym_mapbench.env.config import EnvConfig
from gym_mapbench.env.single import MapBenchEnv
from gym_mapbench.errors import ConfigError
from gym_mapbench.kernels.ranges import report_ranges
from gym_mapbench.world.frames import compose, relate
from gym_mapbench.world.lidar import LidarSettings
from gym_mapbench.world.localisation import StateEstimator
from gym_mapbench.world.noise import NOISES, NoiseSettings, Streams, Wander
from gym_mapbench.world.scenario import Pose, wrap_angle
from gym_mapbench.world.state import Worlds
from tests.world.plain_noise import PlainEstimator, PlainWander, plain_report
from tests.worlds import ROOM_OPTIONS

PERIOD = 0.05
START = Pose(2.0, 1.0, 0.5)


def rng(seed=0):
    return np.random.default_rng(seed)


def drive(steps, v=0.3, w=0.4, start=START):
    """True poses of a robot on an arc."""
    poses = [start]
    for _ in range(steps):
        poses.append(compose(poses[-1], Pose(v * PERIOD, 0.0, w * PERIOD)))
    return poses


def errors_of(estimates, truth):
    return np.array([(e.x - t.x, e.y - t.y, wrap_angle(e.yaw - t.yaw)) for e, t in zip(estimates, truth, strict=True)])


class TestSettings:
    def test_levels_are_frozen_values_that_can_be_changed(self):
        config = EnvConfig(noise={"level": "nominal", "scan": 0.02})
        assert config.noise == NOISES["nominal"].replace(scan=0.02)
        assert NoiseSettings(level="rough") == NOISES["rough"]
        assert EnvConfig(noise="rough").noise == NOISES["rough"]
        with pytest.raises(ValueError, match="frozen"):
            NOISES["nominal"].scan = 0.0

    def test_none_is_no_noise_at_all(self):
        assert NOISES["none"] == NoiseSettings()
        assert not NOISES["none"].drifts

    def test_each_level_is_rougher_than_the_one_before(self):
        none, nominal, rough = (NOISES[name].model_dump() for name in ("none", "nominal", "rough"))
        deviations = set(none) - {"odom_frame", "lidar_mount", "update_min_d", "update_min_a"}
        for name in deviations - {"pose_time_constant", "actuation_time_constant"}:
            assert none[name] <= nominal[name] <= rough[name]
            assert none[name] < rough[name]

    @pytest.mark.parametrize(
        ("noise", "message"),
        [
            ({"pose_xy": -0.1}, r"noise.pose_xy: expected greater than or equal to 0, got -0.1"),
            ({"pose_xy": 1.5}, r"noise.pose_xy: expected less than or equal to 1, got 1.5"),
            ({"pose_yaw": 4.0}, r"noise.pose_yaw: expected less than or equal to 3.14"),
            ({"scan": 3}, r"noise.scan: expected less than or equal to 1, got 3"),
            ({"scan_dropout": 1.1}, r"noise.scan_dropout: expected less than or equal to 1, got 1.1"),
            ({"latency": 1.01}, r"noise.latency: expected less than or equal to 1, got 1.01"),
            ({"latency": -0.2}, r"noise.latency: expected greater than or equal to 0, got -0.2"),
            ({"odometry_turn": float("nan")}, r"noise.odometry_turn: expected"),
            ({"odom_frame": "turned"}, r"noise.odom_frame: expected 'aligned' or 'random', got 'turned'"),
            ({"lidar_mount": "roof"}, r"noise.lidar_mount: expected 'centre' or 'robot', got 'roof'"),
            ({"pose": 0.1}, r"noise: unknown key 'pose'"),
            ({"level": "nominall"}, r"noise: unknown noise 'nominall'; did you mean 'nominal'\?"),
            ({"level": 2}, r"noise: level: expected one of nominal, none, rough, got 2"),
            ({"level": "rough", "scna": 0.1}, r"noise: unknown key 'scna'; did you mean 'scan'\?"),
        ],
    )
    def test_nonsense_is_one_clear_line(self, noise, message):
        with pytest.raises(ConfigError, match=message) as caught:
            EnvConfig(noise=noise)
        assert "\n" not in str(caught.value)


def estimated(noise, truth, seed=0, velocity=(0.0, 0.0)):
    """Estimated poses, odom poses and velocities of a robot at true poses, and the wheels' errors in deviations."""
    streams = Streams(*(rng(seed + number) for number in range(len(Streams._fields))))
    drift = rng(seed + Streams._fields.index("odometry")).standard_normal(3)
    robots = Worlds().robots
    estimator = StateEstimator(noise, truth[0], PERIOD, streams, robots)
    known = [estimate(estimator, robots, pose, velocity) for pose in truth]
    return [Pose(*k[:3]) for k in known], [Pose(*k[3:6]) for k in known], [tuple(k[6:]) for k in known], drift


def estimate(estimator, robots, pose, velocity):
    """Return the estimates of an estimator for a true state of its robot."""
    for name, value in zip(("x", "y", "yaw", "v", "w"), (*pose, *velocity), strict=True):
        robots[name] = value
    state = estimator.advance().tolist()
    assert state[:5] == [*pose, *velocity]
    return state[5:]


class TestWander:
    @pytest.mark.parametrize("time_constant", [0.0, 0.5])
    def test_statistics_are_those_of_an_ornstein_uhlenbeck_process(self, time_constant):
        wander = Wander((0.1, 0.02), time_constant, PERIOD, rng())
        samples = np.array([wander.advance() for _ in range(40_000)])
        assert samples.std(axis=0) == pytest.approx([0.1, 0.02], rel=0.05)
        for lag in (1, 4, 10):
            expected = math.exp(-lag * PERIOD / time_constant) if time_constant else 0.0
            assert np.corrcoef(samples[lag:, 0], samples[:-lag, 0])[0, 1] == pytest.approx(expected, abs=0.05)
        assert abs(np.corrcoef(samples.T)[0, 1]) < 0.05

    def test_its_first_value_is_as_widely_spread_as_any(self):
        first = [Wander((0.1,), 5.0, PERIOD, rng(seed)).advance()[0] for seed in range(2000)]
        assert np.std(first) == pytest.approx(0.1, rel=0.05)

    def test_nothing_is_drawn_where_it_is_off(self):
        generator = rng()
        assert Wander((0.0, 0.0), 1.0, PERIOD, generator).advance() == [0.0, 0.0]
        assert generator.random() == rng().random()

    @pytest.mark.parametrize("time_constant", [0.0, 0.5])
    def test_it_is_its_plain_twin(self, time_constant):
        process = (0.1, 0.0, 0.02), time_constant, PERIOD
        wander, twin = Wander(*process, rng()), PlainWander(*process, rng())
        assert [wander.advance() for _ in range(300)] == [twin.advance() for _ in range(300)]


class TestOdometry:
    def test_aligned_and_exact_is_the_true_pose_to_the_last_bit(self):
        _, odom, velocities, _ = estimated(NOISES["none"], drive(50), velocity=(0.3, 0.1))
        assert odom == drive(50)
        assert set(velocities) == {(0.3, 0.1)}

    @given(st.integers(0, 2**32 - 1))
    def test_a_random_frame_shifts_and_turns_all_poses_alike(self, seed):
        truth = drive(50)
        _, odom, _, _ = estimated(NoiseSettings(odom_frame="random"), truth, seed)
        frame = relate(truth[0], odom[0])
        assert max(abs(odom[0].x), abs(odom[0].y)) <= 1.0
        for pose, seen in zip(truth, odom, strict=True):
            expected = compose(frame, pose)
            assert seen[:2] == pytest.approx(expected[:2], abs=1e-9)
            assert abs(wrap_angle(seen.yaw - expected.yaw)) < 1e-9

    def test_every_place_and_turn_of_a_frame_is_as_likely(self):
        noise = NoiseSettings(odom_frame="random")
        first = np.array([estimated(noise, [START], seed)[1][0] for seed in range(2000)])
        phases = [np.mod(first[:, 0], 0.05) / 0.05, np.mod(first[:, 1], 0.05) / 0.05, first[:, 2] / (2 * math.pi) + 0.5]
        for phase in phases:
            counts = np.histogram(phase, bins=5, range=(0, 1))[0]
            assert counts.min() > 320
            assert counts.sum() == 2000

    def test_errors_grow_with_distance_and_turn(self):
        def end_of(noise, v, w):
            _, odom, velocities, error = estimated(NoiseSettings(**noise), drive(200, v, w), velocity=(v, w))
            return odom[-1], error, velocities[-1]

        end, error, measured = end_of({"odometry_distance": 0.1}, 0.2, 0.0)
        assert math.hypot(end.x - START.x, end.y - START.y) == pytest.approx(2.0 * (1 + 0.1 * error[0]))
        assert measured == pytest.approx((0.2 * (1 + 0.1 * error[0]), 0.0))
        end, error, measured = end_of({"odometry_turn": 0.1}, 0.0, 0.1)
        assert end.yaw - START.yaw == pytest.approx(1.0 * (1 + 0.1 * error[1]))
        assert measured == pytest.approx((0.0, 0.1 * (1 + 0.1 * error[1])))
        end, error, measured = end_of({"odometry_veer": 0.1}, 0.2, 0.0)
        assert end.yaw - START.yaw == pytest.approx(2.0 * 0.1 * error[2])
        assert measured == pytest.approx((0.2, 0.2 * 0.1 * error[2]))

    def test_it_is_smooth_whatever_the_localisation_does(self):
        _, odom, _, _ = estimated(NOISES["rough"], drive(400), 1)
        steps = np.array([relate(after, before)[2] for before, after in pairwise(odom)])
        assert np.abs(steps).max() < 0.4 * PERIOD * 1.3
        assert np.hypot(*np.diff(np.array(odom)[:, :2], axis=0).T).max() < 0.3 * PERIOD * 1.2


class TestLocalisation:
    NOISE = NoiseSettings(pose_xy=0.05, pose_yaw=0.02, pose_time_constant=2.0)

    def test_without_errors_it_is_the_true_pose_to_the_last_bit(self):
        assert estimated(NoiseSettings(odom_frame="random"), drive(50))[0] == drive(50)

    @settings(max_examples=20)
    @given(st.integers(0, 2**32 - 1))
    def test_between_corrections_the_transform_stays_and_odometry_is_followed(self, seed):
        noise = NOISES["rough"]
        estimates, odoms, _, _ = estimated(noise, drive(300), seed)
        changes, last, corrected_at = 0, None, None
        for odom, estimate in zip(odoms, estimates, strict=True):
            transform = relate(odom, estimate)
            if last is None or max(np.abs(np.subtract(transform, last))) > 1e-9:
                if corrected_at is not None:
                    moved = np.abs(np.subtract(odom, corrected_at))
                    assert max(moved[:2]) > noise.update_min_d or moved[2] > noise.update_min_a
                changes, corrected_at = changes + 1, odom
            last = transform
        # 0.4 rad/s: a correction after each 0.2 rad, half a second.
        assert 20 <= changes <= 40

    def test_a_standing_robot_is_not_corrected(self):
        estimates = estimated(self.NOISE, [START] * 50)[0]
        assert len(set(estimates)) == 1
        assert estimates[0] != START

    def test_errors_at_corrections_have_the_configured_spread(self):
        noise = self.NOISE.replace(update_min_d=0.0, update_min_a=0.0)
        truth = drive(20_000)
        errors = errors_of(estimated(noise, truth)[0], truth)
        assert errors.std(axis=0) == pytest.approx([0.05, 0.05, 0.02], rel=0.15)
        assert np.corrcoef(errors[20:, 0], errors[:-20, 0])[0, 1] == pytest.approx(math.exp(-1.0 / 2.0), abs=0.1)

    def test_the_error_of_a_moment_does_not_depend_on_where_the_robot_drives(self):
        noise = self.NOISE.replace(update_min_d=0.0, update_min_a=0.0)
        errors = []
        for w in (0.4, -0.3):
            truth = drive(50, w=w)
            errors.append(errors_of(estimated(noise, truth, 5)[0], truth))
        assert errors[0] == pytest.approx(errors[1], abs=1e-12)


LEVELS = [
    *NOISES.names(),
    {"odom_frame": "random"},
    {"odometry_veer": 0.02},
    {"pose_xy": 0.05, "update_min_d": 0.0, "update_min_a": 0.0},
    {"odometry_w": 0.01},
]


@pytest.mark.parametrize("level", LEVELS, ids=str)
def test_the_estimator_is_its_plain_twin(level):
    noise = EnvConfig(noise=level).noise
    streams, same = (Streams(*(rng(number) for number in range(len(Streams._fields)))) for _ in range(2))
    robots = Worlds().robots
    estimator, plain = StateEstimator(noise, START, PERIOD, streams, robots), PlainEstimator(noise, START, PERIOD, same)
    for pose in drive(400, 0.3, 0.7):
        assert estimate(estimator, robots, pose, (0.3, 0.7)) == list(plain.advance(pose, (0.3, 0.7)))


class TestScan:
    def disturbed(self, ranges, deviation, relative, seed=0):
        """Ranges with noise; no beam is lost."""
        reported, normals = ranges.copy(), rng(seed).standard_normal(len(ranges), dtype=np.float32)
        report_ranges(reported, normals, np.empty(0, np.bool_), deviation, relative, 0.0, 3.5, 3.5)
        return reported

    @given(
        st.integers(0, 2**32 - 1),
        st.sampled_from([0.0, 0.01, 0.3]),
        st.sampled_from([0.0, 0.012]),
        st.sampled_from([0.0, 0.12]),
        st.booleans(),
        st.booleans(),
        st.sampled_from([0.0, 3.5]),
    )
    def test_it_is_its_plain_twin(self, seed, deviation, relative, range_min, is_noisy, loses, no_range):
        sampled = rng(seed)
        ranges = np.minimum(sampled.uniform(0.0, 5.0, 400), 3.5).astype(np.float32)
        normals = sampled.standard_normal(400 if is_noisy else 0, dtype=np.float32)
        lost = sampled.random(400 if loses else 0) < 0.1
        arguments = normals, lost, deviation, relative, range_min, 3.5, no_range
        expected = plain_report(ranges, *arguments)
        report_ranges(ranges, *arguments)
        assert ranges.tobytes() == expected.tobytes()

    def test_spread_is_absolute_relative_or_both(self):
        ranges = np.full(20_000, 2.0, dtype=np.float32)
        for deviation, relative, expected in ((0.03, 0.0, 0.03), (0.0, 0.02, 0.04), (0.03, 0.02, 0.05)):
            noisy = self.disturbed(ranges, deviation, relative)
            assert noisy.std() == pytest.approx(expected, rel=0.03)

    def test_what_hits_nothing_stays_as_it_is(self):
        ranges = np.array([3.5, 3.4999, 0.001], dtype=np.float32)
        noisy = np.array([self.disturbed(ranges, 0.1, 0.0, seed) for seed in range(50)])
        assert (noisy[:, 0] == 3.5).all()
        assert noisy.min() == 0.0
        assert noisy.max() == 3.5

    @pytest.mark.parametrize(("no_reading", "expected"), [("range_max", 3.5), ("zero", 0.0)])
    def test_lost_beams_say_what_the_device_says(self, no_reading, expected):
        lidar = LidarSettings(range_min=0.1, no_reading=no_reading)
        options = {**ROOM_OPTIONS, "observation": ("scan",), "lidar": lidar}
        env, exact = MapBenchEnv(**options, noise={"scan_dropout": 0.1}), MapBenchEnv(**options)
        lost, total = 0, 0
        for seed in range(100):
            ranges, truth = env.reset(seed=seed)[0]["scan"], exact.reset(seed=seed)[0]["scan"]
            assert set(ranges[ranges != truth].tolist()) <= {expected}
            lost, total = lost + (ranges != truth).sum(), total + (truth < 3.5).sum()
        assert lost / total == pytest.approx(0.1, abs=0.01)

    def test_zero_needs_a_scanner_that_does_not_believe_it(self):
        with pytest.raises(
            ConfigError, match=r"lidar\.range_min: expected more than 0 where lost beams are reported as 0 m, got 0"
        ):
            EnvConfig(lidar={"no_reading": "zero"}, noise={"scan_dropout": 0.1})
        EnvConfig(lidar={"no_reading": "zero"}, noise="rough")


class TestStreams:
    def test_the_noise_of_a_source_does_not_depend_on_the_others(self):
        def scans(**noise):
            env = MapBenchEnv(**ROOM_OPTIONS, noise={"scan": 0.02, **noise})
            first = env.reset(seed=8)[0]["scan"]
            return [first, *(env.step((0.0, 0.0))[0]["scan"] for _ in range(5))]

        others = {"pose_xy": 0.1, "odometry_v": 0.1, "odometry_veer": 0.1, "actuation_v": 0.1, "odom_frame": "random"}
        assert np.array_equal(scans(), scans(**others))

    def test_all_robots_meet_the_same_noise_at_the_same_time(self):
        def noise_of(commands):
            options = {"pose_xy": 0.05, "update_min_d": 0.0, "update_min_a": 0.0, "odometry_v": 0.1}
            env = MapBenchEnv(**ROOM_OPTIONS, noise=options)
            env.reset(seed=2)
            steps = [env.step(command) for command in commands]
            return [(step[0][key] - step[4][key]) for step in steps for key in ("pose", "velocity")]

        for one, other in zip(noise_of([(0.2, 0.1)] * 9), noise_of([(-0.1, 0.5)] * 9), strict=True):
            assert one == pytest.approx(other, abs=1e-12)

    def test_they_are_other_ones_in_every_episode_and_leave_the_env_alone(self):
        generator = rng()
        first, second = (Streams.spawn(generator, NOISES["nominal"]) for _ in range(2))
        values = [stream.random() for stream in (*first, *second)]
        assert len(set(values)) == len(values)
        assert generator.random() == rng().random()

    def test_every_noise_that_draws_has_them(self):
        still = {"update_min_d", "update_min_a", "pose_time_constant", "actuation_time_constant", "latency"}
        for name in NoiseSettings.model_fields.keys() - still - {"odom_frame", "lidar_mount"}:
            assert NoiseSettings(**{name: 0.1}).samples, name
        assert NoiseSettings(odom_frame="random").samples
        assert not NoiseSettings(**dict.fromkeys(still, 0.1), lidar_mount="robot").samples


class TestActuation:
    def run(self, commands, **options):
        env = MapBenchEnv(**{**ROOM_OPTIONS, **options})
        env.reset(seed=4)
        return np.array([env.step(command)[4]["velocity"] for command in commands])

    def test_factors_last_for_their_time_constant(self):
        fast = {"max_linear_acceleration": 100.0, "max_angular_acceleration": 100.0}
        noise = {"actuation_v": 0.05, "actuation_time_constant": 1000.0}
        speeds = self.run([(0.05, 0.0)] * 20, robot=fast, noise=noise)[:, 0]
        assert abs(speeds[0] - 0.05) > 1e-4
        assert np.ptp(speeds) < 3e-4
        white = self.run([(0.05, 0.0)] * 20, robot=fast, noise={**noise, "actuation_time_constant": 0.0})[:, 0]
        assert np.ptp(white) > 1e-3

    @pytest.mark.parametrize(("latency", "ticks"), [(0.0, 0), (0.09, 0), (0.1, 1), (0.2, 1), (0.6, 3), (1.0, 5)])
    def test_latency_is_rounded_to_whole_physics_steps(self, latency, ticks):
        assert EnvConfig(noise={"latency": latency}).late_ticks == ticks

    def test_a_late_command_works_for_the_rest_of_the_period(self):
        commands = [(0.5, 0.0), (0.5, 0.0), (0.0, 0.0), (0.0, 0.0)]
        # 2.5 m/s^2, 10 ms: 25 mm/s a tick, and five ticks a period.
        prompt = self.run(commands)[:, 0]
        late = self.run(commands, noise={"latency": 0.4})[:, 0]
        assert prompt == pytest.approx([0.125, 0.25, 0.125, 0.0])
        assert late == pytest.approx([0.075, 0.2, 0.175, 0.05])
        assert self.run(commands, noise={"latency": 1.0})[:, 0] == pytest.approx([0.0, 0.125, 0.25, 0.125])

    def test_latency_that_rounds_to_nothing_is_none(self):
        commands = np.random.default_rng(0).uniform(-0.3, 0.5, (20, 2)).tolist()
        assert np.array_equal(self.run(commands), self.run(commands, noise={"latency": 0.05}))
