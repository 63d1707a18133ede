"""Nav2 in an exported ROS 2 package: its parameters, and a behaviour tree for each of the compared controllers."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import yaml

from gym_mapbench.costmap import FILTER_SERVERS
from gym_mapbench.errors import ConfigError
from gym_mapbench.mapio.gazebo_trees import tree_ids, tree_with_plugins
from gym_mapbench.mapio.output import Files, check_names
from gym_mapbench.mapio.rendering import render
from gym_mapbench.releases import Release

PLUGINS_OF_PATHS = ("goal_checker", "progress_checker", "path_handler")
"""Kinds of plugins of the controller server that a leaf may name, besides the controller."""
NAVIGATOR = "bt_navigator"
TREES = ("default_nav_to_pose_bt_xml", "default_nav_through_poses_bt_xml")
"""Parameters of the navigator that name a tree; a tree that is never used has to load, too."""
CONTROLLER_PACKAGES = ("nav2_mppi_controller", "nav2_graceful_controller")
"""Packages of controllers that not every release's package ``navigation2`` brings."""


@dataclass(frozen=True)
class BundledNavigation:
    """Nav2 as an exported package runs it.

    Args:
        params: The mapping of a ``nav2_params.yaml`` of the release, written as it is.
        controllers: Names of the controller plugins in it that are compared; one behaviour tree each.
        tree: Numbers of the behaviour tree: ``replanning_frequency``, ``number_of_retries``, ``spin_dist``,
            ``wait_duration``, ``backup_dist``, ``backup_speed``, ``time_allowance``, and ``recoveries`` (whether there
            are any); or a whole tree as ``xml``.
        release: Release of Nav2.
        masks: Map files of the costmap filters' masks, by name.
        besides: Settings that MapBench drove with and that are no parameters of Nav2, by name; they become a comment
            in the parameter file.

    Raises:
        ConfigError: If a name cannot be a file name or comes twice, or ``params`` has no plugin for a controller.
    """

    params: Mapping[str, Any]
    controllers: Sequence[str]
    tree: Mapping[str, Any]
    release: Release = "humble"
    masks: Files = field(default_factory=dict)
    besides: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        check_names("controller", self.controllers)
        known = _plugins(self.params, "controller_server", "controller_plugins")
        for name in self.controllers:
            if name not in known:
                raise ConfigError(f"controller {name!r}: expected a plugin of controller_server, which has {known}")

    @property
    def behaves(self) -> bool:
        """Whether there are behaviours; a server with an empty list of them does not start."""
        return bool(_plugins(self.params, "behavior_server", "behavior_plugins", least=0))

    @property
    def smooths_paths(self) -> bool:
        """Whether the tree asks the smoother server for smoothed paths."""
        return "smoother_server" in self.params

    @property
    def smooths(self) -> bool:
        """Whether the velocity smoother stands between controller and base."""
        return "velocity_smoother" in self.params

    @property
    def monitors(self) -> bool:
        """Whether the collision monitor stands in front of the base."""
        return "collision_monitor" in self.params

    @property
    def reports_codes(self) -> bool:
        """Whether the trees report an error code for each failure of planner and controller, as the default ones do."""
        return self.release != "humble" and not self.tree.get("xml")

    @property
    def packages(self) -> tuple[str, ...]:
        """Packages of the compared controllers that are installed besides ``navigation2``."""
        written = json.dumps(self.params["controller_server"])
        return tuple(name for name in CONTROLLER_PACKAGES if f'"{name}::' in written)

    @property
    def filter_servers(self) -> dict[str, str | None]:
        """The servers of the costmap filters by name, with the map file of those that publish a mask."""
        parameters = {
            name: node["ros__parameters"] for name, node in self.params.items() if name.endswith(FILTER_SERVERS)
        }
        return {name: values.get("yaml_filename") for name, values in parameters.items()}

    def files(self, package: str) -> Files:
        """Return the parameters, the masks and the behaviour trees; the parameters name the first controller's tree.

        Args:
            package: Name of the package. Nav2 finds the tree by it where a launch file substitutes ``find-pkg-share``,
                as those of ``nav2_bringup`` do; the package's own launch file gives the tree itself.
        """
        ids = tree_ids(self.controllers, self.tree.get("xml", ""))
        trees: Files = {f"behavior_trees/{name}.xml": self._tree(name, tree_id) for name, tree_id in ids.items()}
        named = f"$(find-pkg-share {package})/{next(iter(trees))}"
        params = {**self.params, NAVIGATOR: _with(self.params.get(NAVIGATOR, {}), dict.fromkeys(TREES, named))}
        return trees | self.masks | {"nav2_params.yaml": self._comment() + _yaml(params)}

    def _tree(self, controller: str, tree_id: str) -> str:
        """A user's tree, or the release's default tree, with one controller and the behaviours that have a server."""
        if self.tree.get("xml"):
            return tree_with_plugins(self.tree["xml"], tree_id, self._ids(controller))
        return render(
            "behavior_tree.xml.j2",
            tree_id=tree_id,
            controller=controller,
            planner=_plugins(self.params, "planner_server", "planner_plugins")[0],
            release=self.release,
            tree=self.tree,
            behaviors=_plugins(self.params, "behavior_server", "behavior_plugins", least=0),
        )

    def _ids(self, controller: str) -> dict[str, str]:
        """Return, by port, the plugins that a user's tree has to name."""
        server = self.params["controller_server"]["ros__parameters"]
        first = {f"{kind}_id": names[0] for kind in PLUGINS_OF_PATHS if (names := server.get(f"{kind}_plugins"))}
        planner = _plugins(self.params, "planner_server", "planner_plugins")[0]
        return {**first, "controller_id": controller, "planner_id": planner}

    def _comment(self) -> str:
        head = f"# Nav2 {self.release.capitalize()}.\n"
        if not self.besides:
            return head
        said = "".join(f"#   {name}: {json.dumps(value)}\n" for name, value in self.besides.items())
        return f"{head}# MapBench also drove with these settings, which are not parameters of Nav2:\n{said}"


def _with(node: Mapping[str, Any], values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the section of a node with further parameters."""
    return {**node, "ros__parameters": {**node.get("ros__parameters", {}), **values}}


def _yaml(document: Mapping[str, Any]) -> str:
    """Write YAML; through JSON, so that tuples become lists, and what YAML could only write with a tag is refused."""
    return yaml.safe_dump(json.loads(json.dumps(document)), sort_keys=False)


def _plugins(params: Mapping[str, Any], server: str, key: str, least: int = 1) -> list[str]:
    """Return the plugins that a server section names."""
    try:
        plugins = params[server]["ros__parameters"][key]
    except (KeyError, TypeError):
        raise ConfigError(f"nav2 parameters: expected {server}.ros__parameters.{key}, which is missing") from None
    if not isinstance(plugins, (list, tuple)) or len(plugins) < least:
        raise ConfigError(f"nav2 parameters: {server}.{key}: expected a list of names, got {plugins!r}")
    return [str(plugin) for plugin in plugins]
