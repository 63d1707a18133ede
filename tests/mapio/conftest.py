"""What the tests of exported ROS 2 packages share."""

from __future__ import annotations

import pytest

from gym_mapbench.mapio.gazebo import export_gazebo
from tests.mapio.test_gazebo import OPTIONS, navigation, thesis_scenario


@pytest.fixture(scope="module", params=["humble", "jazzy", "lyrical"])
def bundle(request, tmp_path_factory):
    """Two maps, the package they are exported to, and its release."""
    folder = tmp_path_factory.mktemp("runner") / "bundle"
    maps = [thesis_scenario(seed, f"map_{seed}") for seed in range(2)]
    export_gazebo(maps, folder, **(OPTIONS | {"navigation": navigation(release=request.param)}))
    return maps, folder, request.param
