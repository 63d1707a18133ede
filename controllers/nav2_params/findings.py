"""Findings: what a parameter file holds besides the parameters that count here."""

from __future__ import annotations

from dataclasses import dataclass, field

from controllers.releases import Release
from gym_mapbench.errors import ConfigError


@dataclass
class Findings:
    """Full names of keys, groups and whole nodes, collected while a file is read.

    Args:
        release: The distribution as which the file is read.
        ros_only: They mean nothing without ROS.
        unused: The robot's own Nav2 makes no use of them either: they are in no list of plugins, or the tree asks
            for another.
        unmodelled: Nothing here stands for them, and they may change how the real robot drives.
        newer: Parameters of other releases -> what this one does.
        unknown: Unknown parameters -> what may be meant; empty if nothing is like them.
    """

    release: Release = "humble"
    ros_only: list[str] = field(default_factory=list)
    unused: list[str] = field(default_factory=list)
    unmodelled: list[str] = field(default_factory=list)
    newer: dict[str, str] = field(default_factory=dict)
    unknown: dict[str, str] = field(default_factory=dict)

    def refuse(self) -> None:
        """Refuse the parameters of newer releases and the unknown ones, if there are any.

        Raises:
            ConfigError: Naming all of them.
        """
        said = [line for line in (self._newer(), self._unknown()) if line]
        if said:
            raise ConfigError("; ".join(said))

    def _newer(self) -> str:
        which, title = "newer" if self.release == "humble" else "other", self.release.capitalize()
        if len(self.newer) == 1:
            ((name, why),) = self.newer.items()
            return f"{name}: only {which} releases of Nav2 have this parameter, and {title}'s behaviour is built: {why}"
        names = ", ".join(self.newer)
        return names and f"{len(self.newer)} parameters of {which} releases than {title}, remove them: {names}"

    def _unknown(self) -> str:
        if len(self.unknown) == 1:
            ((name, near),) = self.unknown.items()
            return f"{name}: unknown parameter" + (f"; did you mean {near!r}?" if near else "")
        names = ", ".join(f"{name} ({near}?)" if near else name for name, near in self.unknown.items())
        return names and f"{len(self.unknown)} unknown parameters: {names}"
