"""Findings: the content of a parameter file besides the parameters that are used."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from gym_mapbench.errors import ConfigError
from gym_mapbench.releases import Release

Kind = Literal[
    "ros_only",
    "unused",
    "other_release",
    "unknown",
    "renamed",
    "replaced",
    "left_out",
    "template",
    "repeated",
    "mistyped",
    "missing",
    "misplaced",
    "aliased",
    "detail",
]
KINDS: dict[Kind, str] = {
    "ros_only": "mean nothing without ROS",
    "unused": "Nav2 does not use either",
    "other_release": "only other releases or plugins have",
    "unknown": "are no parameters of their plugin",
    "renamed": "are read under another release's name",
    "replaced": "something else stands in for",
    "left_out": "are not modelled, though they may change how the real robot drives",
    "template": "are templates without a value, left to the robot",
    "repeated": "are given twice, so that the last value counts",
    "mistyped": "have another type than in Nav2, which does not start with them",
    "missing": "Nav2's default tree needs, and the file does not have",
    "misplaced": "ROS gives to no node, and are read here all the same",
    "aliased": "are YAML aliases, with which ROS does not read the file",
    "detail": "belong to what is replaced",
}
"""How a report goes on about the keys of each kind after ``keys that``."""


@dataclass(frozen=True)
class Finding:
    """A key, group or node of a parameter file that is not a parameter in use, or that is missing.

    Args:
        kind: One of ``KINDS``.
        name: Full name of a key, a group or a whole node.
        why: What happens instead, or which name may be meant; may be empty.
    """

    kind: Kind
    name: str
    why: str = ""


@dataclass
class Findings:
    """The findings of one file, collected while it is read.

    Args:
        release: The distribution as which the file is read.
        found: The findings, in the order of the file.
        kept: Numbers and switches that mean nothing without ROS, by the full name under which a file that is written
            gets them. Names (of topics, frames, files) belong to the user's own robot and are not kept, but those of
            the libraries of Nav2's tree nodes are.
    """

    release: Release = "humble"
    found: list[Finding] = field(default_factory=list)
    kept: dict[str, float | bool | list[str]] = field(default_factory=dict)

    def add(self, kind: Kind, name: str, why: str = "") -> None:
        """Add a finding."""
        self.found.append(Finding(kind, name, why))

    def keep(self, written: str, value: object) -> None:
        """Keep a value that means nothing without ROS for a file that is written, if it is a number or a switch."""
        if isinstance(value, (bool, int, float)):
            self.kept[written] = value

    def refuse(self) -> None:
        """Refuse unknown parameters and those of other releases, for callers whose parameters are for us alone.

        Raises:
            ConfigError: If there are any; it names all of them.
        """
        refused = [finding for finding in self.found if finding.kind in ("unknown", "other_release")]
        if refused:
            raise ConfigError("; ".join(f"{finding.name}: {_reason(finding)}" for finding in refused))


def _reason(finding: Finding) -> str:
    """Say why a key is refused: it is another release's parameter, or unknown, with the name that may be meant."""
    if finding.kind == "other_release":
        return f"only other releases of Nav2 have this parameter: {finding.why}"
    return "unknown parameter" + (f"; {finding.why}" if finding.why else "")
