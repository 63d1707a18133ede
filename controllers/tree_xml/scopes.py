"""The variables of a tree and its subtrees, and those whose texts are known before the tree runs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from xml.etree.ElementTree import Element

from controllers.tree_xml.nodes import WITHOUT_EFFECT
from gym_mapbench.errors import ConfigError
from gym_mapbench.releases import Release

SHARED = ("__shared_blackboard", "__autoremap", "_autoremap")
"""Attributes by which all variables of a subtree are those of the tree around it."""
SWITCHES = {"true": True, "1": True, "false": False, "0": False}


def is_variable(text: str) -> bool:
    """Return whether a text stands for a variable, as ``{path}`` does."""
    return len(text) > 2 and text[0] == "{" and text[-1] == "}"


@dataclass(frozen=True)
class Scope:
    """The variables of a subtree.

    Args:
        prefix: Stands before the names of its own variables, which the tree around it does not see.
        given: Its variables that are variables of the tree around it, by their names inside.
        around: The trees around it, by ID.
    """

    prefix: str = ""
    given: Mapping[str, str] = field(default_factory=dict)
    around: tuple[str, ...] = ()

    def variable(self, name: str) -> str:
        """Return the name of a variable in the whole tree."""
        return self.given.get(name, f"{self.prefix}{name}")

    def inside(self, number: int, element: Element, constants: Constants) -> Scope:
        """Return the scope of a subtree; texts that stand in the place of variables are constants in it."""
        name = element.get("ID", "")
        shares = any(SWITCHES.get(element.get(key, "").lower(), False) for key in SHARED)
        own = f"{self.prefix}{name}.{number}."
        given = dict(self.given) if shares else {}
        for key, value in element.items():
            if key in SHARED or key in WITHOUT_EFFECT:
                continue
            if is_variable(value) or not constants.allows_texts(element):
                given[key] = self.variable(value.strip("{}") if value != "{=}" else key)
            else:
                given[key] = f"{own}{key}"
                constants.texts[given[key]] = value
        return Scope(self.prefix if shares else own, given, (*self.around, name))


@dataclass
class Constants:
    """The variables whose text is known before the tree runs.

    Args:
        release: The release of Nav2.

    Attributes:
        texts: The texts of those that a subtree is given, by the names of the variables.
        assigned: The texts of those that a ``SetBlackboard`` sets, which have no value before it is ticked.
    """

    release: Release
    texts: dict[str, str] = field(default_factory=dict)
    assigned: dict[str, str] = field(default_factory=dict)

    def allows_texts(self, subtree: Element) -> bool:
        """Whether a text is a constant in a subtree; Humble's ``SubTree`` takes it for the name of a variable."""
        return self.release != "humble" or subtree.tag == "SubTreePlus"

    def assign(self, name: str, text: str) -> None:
        """Take the text that a ``SetBlackboard`` writes.

        Raises:
            ConfigError: If another one writes another text.
        """
        if (first := self.assigned.setdefault(name, text)) != text:
            raise ConfigError(f"SetBlackboard {name}: expected one text in the whole tree, got {first!r} and {text!r}")

    def text(self, name: str) -> str | None:
        """Return the text of a variable; None if it is not known here."""
        return self.texts.get(name, self.assigned.get(name))

    def number(self, name: str) -> str:
        """Return the text of a variable that stands in the place of a number or a switch.

        Raises:
            ConfigError: If the node would not find it there.
        """
        if name in self.texts:
            return self.texts[name]
        if name not in self.assigned:
            raise ConfigError(f"expected a number, or a variable that a SetBlackboard before sets, got {{{name}}}")
        if self.release == "humble":
            raise ConfigError(f"expected a number, got {{{name}}}: most nodes of Humble look before the tree sets it")
        return self.assigned[name]
