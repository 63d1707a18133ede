"""The collision monitor in parameter files: read, refused, written, migrated, summarised."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
import yaml

from controllers.collision_monitor import CollisionMonitor, MonitorPolygon, MonitorSource, VelocityRange
from controllers.nav2_params import NavigationParams, parse_nav2_params, read_nav2_params, write_nav2_params
from controllers.nav2_params.migration import migrate_file
from controllers.nav2_params.summary import describe_monitor, summarise
from gym_mapbench.errors import ConfigError
from gym_mapbench.releases import RELEASES

ROOT = Path(__file__).resolve().parents[2]
FLAT = [0.3, 0.2, 0.3, -0.2, -0.1, -0.2, -0.1, 0.2]
TEXT = "[[0.3, 0.2], [0.3, -0.2], [-0.1, -0.2], [-0.1, 0.2]]"
CORNERS = ((0.3, 0.2), (0.3, -0.2), (-0.1, -0.2), (-0.1, 0.2))
PLUGIN = {"humble": "nav2_navfn_planner/NavfnPlanner"}


def stop(release="jazzy", **changes):
    points = FLAT if release == "humble" else TEXT
    return {"type": "polygon", "action_type": "stop", "points": points} | changes


def document(release="jazzy", **changes):
    monitor = {"polygons": ["Stop"], "Stop": stop(release), "observation_sources": ["scan"], "scan": {"topic": "scan"}}
    plugin = PLUGIN.get(release, "nav2_navfn_planner::NavfnPlanner")
    planner = {"planner_plugins": ["GridBased"], "GridBased": {"plugin": plugin}}
    lyrical = {"bt_navigator": {"ros__parameters": {"bt_search_directories": ["a"]}}} if release == "lyrical" else {}
    return {
        "planner_server": {"ros__parameters": planner},
        "collision_monitor": {"ros__parameters": monitor | changes},
        **lyrical,
    }


def parse(release="jazzy", **changes):
    return parse_nav2_params(document(release, **changes), release=release)


def monitor_of(release="jazzy", **changes):
    return parse(release, **changes).navigation.collision_monitor


class TestReading:
    @pytest.mark.parametrize("release", RELEASES)
    def test_defaults_are_those_of_the_code(self, release):
        expected = MonitorPolygon(type="polygon", action_type="stop", points=CORNERS, min_points=4)
        monitor = monitor_of(release)
        assert monitor == CollisionMonitor(polygons={"Stop": expected}, observation_sources={"scan": MonitorSource()})
        assert monitor.base_shift_correction

    def test_a_file_without_the_node_has_no_monitor(self):
        without = document()
        del without["collision_monitor"]
        assert parse_nav2_params(without).navigation.collision_monitor is None
        assert "collision_monitor" not in parse_nav2_params(without).navigation.model_dump()

    @pytest.mark.parametrize(("release", "least"), [("humble", 6), ("jazzy", 6), ("lyrical", 6)])
    def test_max_points_is_one_less_than_min_points(self, release, least):
        assert monitor_of(release, Stop=stop(release, max_points=5)).polygons["Stop"].min_points == least

    def test_humble_ignores_min_points_and_later_releases_prefer_max_points(self):
        read = parse("humble", Stop=stop("humble", min_points=9))
        assert read.navigation.collision_monitor.polygons["Stop"].min_points == 4
        assert read.named("other_release") == ("collision_monitor.Stop.min_points",)
        read = parse("jazzy", Stop=stop(min_points=9, max_points=1))
        assert read.navigation.collision_monitor.polygons["Stop"].min_points == 2
        assert read.named("renamed") == ("collision_monitor.Stop.max_points",)

    def test_humbles_approach_takes_the_footprint_and_later_ones_the_points(self):
        approach = {"action_type": "approach", "footprint_topic": "local_costmap/published_footprint"}
        read = parse("humble", Stop=stop("humble", **approach))
        assert read.navigation.collision_monitor.polygons["Stop"].points is None
        assert read.named("unused") == ("collision_monitor.Stop.points",)
        assert monitor_of("jazzy", Stop=stop(**approach)).polygons["Stop"].points == CORNERS

    def test_velocity_polygons_have_named_shapes(self):
        shape = {"points": TEXT, "linear_min": 0.0, "linear_max": 1.0, "theta_min": -1.0, "theta_max": 1.0}
        given = {"type": "velocity_polygon", "action_type": "stop", "velocity_polygons": ["forward"], "forward": shape}
        shapes = monitor_of(Stop=given).polygons["Stop"].velocity_polygons
        assert shapes == {"forward": VelocityRange(**{**shape, "points": CORNERS})}

    def test_shapes_by_a_topic_and_other_sensors_are_listed(self):
        by_topic = {"type": "polygon", "action_type": "slowdown", "polygon_sub_topic": "zone"}
        sources = {"observation_sources": ["scan", "sonar"], "sonar": {"type": "range", "topic": "sonar"}}
        read = parse(polygons=["Stop", "Zone"], Zone=by_topic, **sources)
        assert list(read.navigation.collision_monitor.polygons) == ["Stop"]
        assert read.named("left_out") == ("collision_monitor.Zone", "collision_monitor.sonar")

    def test_a_polygon_of_which_the_lidar_is_no_source_is_listed_and_not_described(self):
        sources = {"observation_sources": ["scan", "camera"], "camera": {"type": "pointcloud", "topic": "points"}}
        read = parse(polygons=["Stop", "Low"], Low=stop(sources_names=["camera"]), **sources)
        assert read.named("left_out") == ("collision_monitor.camera", "collision_monitor.Low")
        monitor = read.navigation.collision_monitor
        assert describe_monitor(monitor) == "Stop stops the robot (polygon, from 4 points on)"
        alone = CollisionMonitor(
            polygons={"Low": monitor.polygons["Low"]}, observation_sources=monitor.observation_sources
        )
        assert describe_monitor(alone) == "changes no command, as it has no enabled polygon or source"

    def test_parameters_of_sources_that_the_lidar_does_not_stand_for_are_known(self):
        sources = {
            "cloud": {"type": "pointcloud", "topic": "a", "use_global_height": False, "min_range": 0.1},
            "shape": {"type": "polygon", "topic": "b", "sampling_distance": 0.1},
            "local": {"type": "costmap", "topic": "c", "cost_threshold": 253, "treat_unknown_as_obstacle": True},
        }
        read = parse("lyrical", observation_sources=["scan", *sources], **sources)
        assert read.named("unknown") == ()

    def test_what_serves_ros_alone_and_what_is_unknown_is_listed(self):
        read = parse(stop_pub_timeout=2.0, state_topic="s", Stop=stop(visualize=True, enable=True), Other=stop())
        assert set(read.named("ros_only")) == {
            "collision_monitor.stop_pub_timeout",
            "collision_monitor.state_topic",
            "collision_monitor.Stop.visualize",
            "collision_monitor.scan.topic",
        }
        assert read.named("unknown") == ("collision_monitor.Stop.enable",)
        assert read.named("unused") == ("collision_monitor.Other",)

    @pytest.mark.parametrize(
        ("release", "changes", "message"),
        [
            ("humble", {"Stop": stop("jazzy")}, r"Stop\.points: expected a list \[x1, .*Humble, got"),
            ("humble", {"Stop": stop("humble", points=FLAT[:6])}, r"Stop\.points: .*at least 4 corners"),
            ("jazzy", {"Stop": stop("humble")}, r"Stop\.points: expected a text .*Jazzy, got"),
            ("jazzy", {"Stop": stop(points="[[1, 2], [3")}, r"Stop\.points: expected a text"),
            ("jazzy", {"Stop": stop(points="[[1, 0], [0, 1], [0, 0]]")}, r"Stop\.points: .*at least 4 corners"),
            ("lyrical", {"Stop": stop(points="[[1, 0], [0, 1], [0, 0]]")}, r"Stop\.points: .*at least 4 corners"),
            (
                "humble",
                {"Stop": stop("humble", action_type="limit")},
                r"action_type: expected stop, .*Humble, got 'limit'",
            ),
            ("humble", {"Stop": {"type": "velocity_polygon"}}, r"Stop\.type: expected polygon, circle in Nav2 Humble"),
            ("jazzy", {"Stop": stop(action_type="halt")}, r"Stop\.action_type: expected stop, .*got 'halt'"),
            ("jazzy", {"scan": {"type": "costmap"}}, r"scan\.type: expected scan, .*Jazzy, got 'costmap'"),
            ("jazzy", {"Stop": {"type": "circle", "action_type": "stop"}}, r"Stop\.radius: expected the radius"),
            ("jazzy", {"Stop": {"type": "polygon", "action_type": "stop"}}, r"Stop\.points: expected the corners"),
            ("jazzy", {"Stop": stop(slowdown_ratio=-0.5)}, r"Stop\.slowdown_ratio: expected .*got -0\.5"),
            ("jazzy", {"Stop": stop(simulation_time_step=0.0)}, r"Stop\.simulation_time_step: expected"),
            ("jazzy", {"Stop": stop(max_points="few")}, r"Stop\.max_points: expected a whole number, got 'few'"),
            ("jazzy", {"Stop": stop(sources_names=["sonar"])}, r"Stop\.sources_names: expected names of scan"),
            ("jazzy", {"polygons": ["Stop", "Stop"]}, r"polygons: expected no name twice"),
        ],
    )
    def test_what_the_monitor_does_not_start_with_is_refused_in_one_line(self, release, changes, message):
        with pytest.raises(ConfigError, match=message) as refused:
            parse(release, **changes)
        assert "\n" not in str(refused.value)
        assert str(refused.value).startswith("collision_monitor.")

    @pytest.mark.parametrize("key", ["polygons", "observation_sources"])
    def test_since_jazzy_both_lists_are_needed(self, key):
        given = document()
        del given["collision_monitor"]["ros__parameters"][key]
        with pytest.raises(ConfigError, match=f"collision_monitor.{key}: expected a list of names, got none"):
            parse_nav2_params(given)


FULL = CollisionMonitor(
    polygons={
        "Stop": MonitorPolygon(type="polygon", action_type="stop", points=CORNERS, min_points=2),
        "Near": MonitorPolygon(type="circle", action_type="slowdown", radius=0.5, slowdown_ratio=0.4, enabled=False),
        "Footprint": MonitorPolygon(type="polygon", action_type="approach", time_before_collision=1.2),
    },
    observation_sources={"scan": MonitorSource(), "cloud": MonitorSource(type="pointcloud", enabled=False)},
    base_shift_correction=False,
)
LIMIT = MonitorPolygon(type="circle", action_type="limit", radius=0.7, linear_limit=0.1, sources_names=("scan",))


@pytest.mark.parametrize("release", RELEASES)
def test_what_is_written_reads_back_the_same(release):
    monitor = FULL if release == "humble" else FULL.replace(polygons={**FULL.polygons, "Limit": LIMIT})
    navigation = parse(release).navigation.replace(collision_monitor=monitor)
    written = yaml.safe_load(yaml.safe_dump(write_nav2_params(navigation)))
    read = parse_nav2_params(written, release=release)
    assert read.navigation.collision_monitor == monitor
    assert NavigationParams(**navigation.model_dump(mode="json")) == navigation
    assert not read.named("unknown")
    assert not read.named("other_release")
    assert written["collision_monitor"]["ros__parameters"]["cmd_vel_in_topic"] == "cmd_vel_nav"


# --- Migration --------------------------------------------------------------------------------------------------------


def migrate(tmp_path, source, target, **changes):
    path = tmp_path / "params.yaml"
    path.write_text(yaml.safe_dump(document(source, **changes), sort_keys=False))
    migration = migrate_file(path, target, source)
    again = parse_nav2_params(yaml.safe_load(migration.text), release=target)
    return migration, again


@pytest.mark.parametrize("target", ["jazzy", "lyrical"])
def test_humbles_monitor_counts_and_stands_the_same_afterwards(tmp_path, target):
    before = monitor_of("humble", Stop=stop("humble", max_points=5))
    migration, read = migrate(tmp_path, "humble", target, Stop=stop("humble", max_points=5))
    assert read.navigation.collision_monitor == before
    assert "max_points" not in migration.text
    assert sum("collision_monitor.Stop" in line for line in migration.done) == 2


@pytest.mark.parametrize("source", ["jazzy", "lyrical"])
def test_back_to_humble_what_it_does_not_start_with_goes(tmp_path, source):
    changes = {
        "polygons": ["Stop", "Limit", "Zone"],
        "Stop": stop(min_points=6, sources_names=["scan"]),
        "Limit": stop(action_type="limit"),
        "Zone": {"type": "polygon", "action_type": "stop", "polygon_sub_topic": "zone"},
    }
    migration, read = migrate(tmp_path, source, "humble", **changes)
    expected = MonitorPolygon(type="polygon", action_type="stop", points=CORNERS, min_points=6)
    assert read.navigation.collision_monitor.polygons == {"Stop": expected}
    lost = "\n".join(migration.lost)
    for name in ("collision_monitor.Limit", "collision_monitor.Zone", "collision_monitor.Stop.sources_names"):
        assert name in lost


@pytest.mark.parametrize("release", RELEASES)
def test_a_triangle_gets_its_last_corner_twice(release):
    triangle = MonitorPolygon(type="polygon", action_type="stop", points=((1, 0), (0, 1), (0, -1)))
    navigation = NavigationParams(release=release, collision_monitor=CollisionMonitor(polygons={"Stop": triangle}))
    read = parse_nav2_params(write_nav2_params(navigation), release=release)
    assert read.navigation.collision_monitor.polygons["Stop"].points == ((1, 0), (0, 1), (0, -1), (0, -1))


def test_lyricals_own_keys_go_and_its_limit_is_told(tmp_path):
    limit = {"polygons": ["Stop"], "Stop": stop(action_type="limit")}
    migration, _ = migrate(tmp_path, "jazzy", "lyrical", **limit)
    assert any("keeps the curvature" in line for line in migration.done)
    changes = {"Stop": stop(trigger_consecutive_points=3), "enabled": True}
    migration, _ = migrate(tmp_path, "lyrical", "jazzy", **changes)
    assert len([line for line in migration.lost if "collision_monitor" in line]) == 2


# --- What people read -------------------------------------------------------------------------------------------------


def test_the_summary_says_what_the_monitor_does():
    line = next(line for line in summarise(parse()) if line.startswith("collision monitor"))
    assert line == "collision monitor: Stop stops the robot (polygon, from 4 points on)"
    assert describe_monitor(FULL) == (
        "Stop stops the robot (polygon, from 2 points on); "
        "Footprint slows commands that collide within 1.2 s (polygon, from 4 points on)"
    )
    assert "changes no command" in describe_monitor(CollisionMonitor())
    assert describe_monitor(CollisionMonitor(polygons={"L": LIMIT.replace(sources_names=None)})) == (
        "changes no command, as it has no enabled polygon or source"
    )


def test_the_example_of_the_page_is_read(tmp_path):
    page = (ROOT / "docs/howto/collision_monitor.md").read_text(encoding="utf-8")
    (block,) = re.findall(r"```yaml\n(.*?)```", page, flags=re.DOTALL)
    path = tmp_path / "params.yaml"
    path.write_text(block, encoding="utf-8")
    read = read_nav2_params(path)
    assert read.recognition.release == "jazzy"
    assert f"collision monitor: {describe_monitor(read.navigation.collision_monitor)}" in page.replace("\n", " ")
    assert read_nav2_params(path, collision_monitor=False).navigation.collision_monitor is None
