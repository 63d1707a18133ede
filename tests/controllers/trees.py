"""Behaviour trees for tests."""

from __future__ import annotations

from controllers.behaviors import default_tree
from gym_mapbench.mapio.rendering import render
from gym_mapbench.releases import Release


def default_xml(release: Release = "humble", **numbers: object) -> str:
    """Return Nav2's default tree as it is exported."""
    tree = {**default_tree(release).model_dump(), **numbers}
    behaviors = ["spin", "wait", "backup"]
    return render(
        "behavior_tree.xml.j2",
        tree_id="Main",
        controller="FollowPath",
        planner="GridBased",
        release=release,
        tree=tree,
        behaviors=behaviors,
    )


def xml_of(inside: str) -> str:
    """Return a file with one tree."""
    return f'<root main_tree_to_execute="Main"><BehaviorTree ID="Main">{inside}</BehaviorTree></root>'


PLAN = '<ComputePathToPose goal="{goal}" path="{path}" planner_id="GridBased"/>'
FOLLOW = '<FollowPath path="{path}" controller_id="FollowPath"/>'
