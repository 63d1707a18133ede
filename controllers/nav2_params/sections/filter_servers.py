"""The servers that give costmap filters their masks: an info server names a topic, and a mask server publishes there.

The nodes of a file have names of the user's choice: a server is known by its usual name or by the key of its topic.
Topics are compared without a leading slash.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from controllers.nav2_params.file.document import PARAMETERS
from controllers.nav2_params.file.keys import INFO_SERVER, MASK_SERVER
from controllers.nav2_params.file.nodes import Node
from gym_mapbench.costmap import INFO_SERVERS, MASK_SERVERS, FilterMask
from gym_mapbench.errors import ConfigError, MapFormatError
from gym_mapbench.mapio import read_occupancy
from gym_mapbench.ros_params import Findings, Section
from gym_mapbench.settings import Settings


class LeftOutError(Exception):
    """A filter has no effect here; the message says why."""


class InfoServer(Settings):
    """Nav2's ``costmap_filter_info_server``.

    Args:
        type: 0 for keepout zones, 1 for limits in per cent, 2 for limits in m/s.
        filter_info_topic: Topic on which it publishes.
        mask_topic: Topic of the mask.
        base: Value at 0 of the mask.
        multiplier: Change of the value for each 1 of the mask.
    """

    type: int = 0
    filter_info_topic: str = "costmap_filter_info"
    mask_topic: str = "filter_mask"
    base: float = 0.0
    multiplier: float = 1.0


class MaskServer(Settings):
    """Nav2's map server of a mask.

    Args:
        topic_name: Topic on which it publishes.
        yaml_filename: Map file, relative to the parameter file; empty if a service gives the map.
    """

    topic_name: str = "map"
    yaml_filename: str = ""


@dataclass(frozen=True)
class FilterServers:
    """The servers of a file.

    Args:
        nodes: All nodes of the file.
        folder: Folder of the file.
        findings: Collects what the servers hold besides their parameters.
        used: Full names of the servers that a filter listens to.
    """

    nodes: list[Node]
    folder: Path
    findings: Findings
    used: set[str] = field(default_factory=set)

    def info(self, topic: str) -> tuple[InfoServer, Section]:
        """Return the info server that publishes on a topic, and its section.

        Raises:
            LeftOutError: If there is none.
            ConfigError: If a value is wrong.
        """
        section = self._find(INFO_SERVERS, "filter_info_topic", InfoServer, topic)
        return section.build(InfoServer, INFO_SERVER), section

    def mask(self, topic: str) -> FilterMask:
        """Return the mask that is published on a topic.

        Raises:
            LeftOutError: If no server publishes there, or the server has no file.
            ConfigError: If the file is missing or no map.
        """
        section = self._find(MASK_SERVERS, "topic_name", MaskServer, topic)
        server = section.build(MaskServer, MASK_SERVER)
        if not server.yaml_filename:
            raise LeftOutError(f"{section.name} has no yaml_filename")
        try:
            read = read_occupancy(self.folder / server.yaml_filename)
        except MapFormatError as error:
            raise ConfigError(f"{section.name}.yaml_filename: {error}") from None
        return FilterMask.from_values(*read)

    def _find(self, end: str, key: str, settings: type[Settings], topic: str) -> Section:
        """Return the section of the server that publishes on a topic."""
        default = settings.model_fields[key].default
        for node in self.nodes:
            values = node.group[PARAMETERS] if node.group is not None else None
            if isinstance(values, Mapping) and (node.name.endswith(end) or key in values):
                section = Section(node.full, values, self.findings)
                if same_topic(section.values.get(key, default), topic):
                    self.used.add(node.full)
                    return section
        raise LeftOutError(f"the file has no node whose {key} is {topic}")


def same_topic(one: object, other: object) -> bool:
    """Whether two topics are the same, apart from a leading slash."""
    return str(one).lstrip("/") == str(other).lstrip("/")
