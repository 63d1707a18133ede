from __future__ import annotations

import math

import pytest

from gym_mapbench.errors import ConfigError
from gym_mapbench.world.robot import ROBOTS, LidarMount, RobotSpec, make_robot


def test_the_default_is_the_robot_of_nav2s_example():
    robot = RobotSpec()
    assert (robot.radius, robot.max_linear_velocity, robot.max_angular_velocity) == (0.22, 0.5, 1.9)
    assert (robot.max_linear_acceleration, robot.max_angular_acceleration) == (2.5, 3.2)
    assert robot == ROBOTS["turtlebot3_waffle"].replace(name="custom", lidar=LidarMount())


def test_presets_by_name():
    assert make_robot("jackal").circumscribed_radius == pytest.approx(math.hypot(0.21, 0.165))
    assert make_robot("turtlebot3_burger").circumscribed_radius == 0.105
    with pytest.raises(ConfigError, match=r"unknown robot 'jakal'; did you mean 'jackal'\?"):
        make_robot("jakal")


def test_a_robot_in_a_file(tmp_path):
    file = tmp_path / "cart.yaml"
    file.write_text("radius: 0.3\nlidar: {x: -0.1}")
    assert make_robot(str(file)) == RobotSpec(name="cart", radius=0.3, lidar=LidarMount(x=-0.1))
    file.write_text("name: trolley")
    assert make_robot(str(file)) == RobotSpec(name="trolley")
    for text, wrong in [("radius: 0", "radius: expected greater than 0, got 0"), ("- 3", "a mapping of options")]:
        file.write_text(text)
        with pytest.raises(ConfigError, match=rf"cart\.yaml: .*{wrong}"):
            make_robot(str(file))
    with pytest.raises(ConfigError, match=r"tray\.yaml: cannot be read"):
        make_robot("tray.yaml")


@pytest.mark.parametrize("turn", [1, -1])
def test_footprints_may_turn_either_way(turn):
    corners = ((0.2, 0.1), (-0.2, 0.1), (-0.2, -0.1), (0.2, -0.1))[::turn]
    assert RobotSpec(footprint=corners).footprint == corners


@pytest.mark.parametrize(
    "corners",
    [
        ((0, 0), (1, 0)),
        ((1, 1), (2, 1), (2, 2)),
        ((1, 0), (0.1, 0.1), (0, 1), (-1, -1)),
        tuple((math.cos(i), math.sin(i)) for i in range(9)),
        tuple((math.cos(4 * math.pi * i / 5), math.sin(4 * math.pi * i / 5)) for i in range(5)),
    ],
    ids=["two corners", "not around the origin", "not convex", "too many", "in the order of a star"],
)
def test_bad_footprints_are_refused(corners):
    with pytest.raises(ConfigError, match="convex polygon around"):
        RobotSpec(footprint=corners)


def test_bad_limits_are_refused():
    with pytest.raises(ConfigError, match="radius: expected greater than 0, got -1"):
        RobotSpec(radius=-1)
    with pytest.raises(ConfigError, match=r"unknown key 'max_velocity'; did you mean"):
        RobotSpec(max_velocity=1)
