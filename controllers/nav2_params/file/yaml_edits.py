"""Edits a YAML text in place, so that comments, order and templates stay."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import yaml

from gym_mapbench.errors import ConfigError


class SharedValueError(ConfigError):
    """A value cannot be changed alone, since it counts for other parameters as well."""


class Entry(NamedTuple):
    """One parameter of a node.

    Args:
        name: Its dotted name within the node.
        group: The mapping in which it stands.
        key: Its key, which may be dotted itself.
        value: Its value.
    """

    name: str
    group: yaml.MappingNode
    key: yaml.ScalarNode
    value: yaml.Node

    @property
    def line(self) -> int:
        """Number of the parameter's line."""
        return int(self.key.start_mark.line) + 1


def entries(group: yaml.Node, prefix: str = "") -> Iterator[Entry]:
    """Yield every parameter and group below a mapping, outer ones first."""
    if not isinstance(group, yaml.MappingNode):
        return
    for key, value in group.value:
        if isinstance(key, yaml.ScalarNode):
            yield Entry(f"{prefix}{key.value}", group, key, value)
            yield from entries(value, f"{prefix}{key.value}.")


@dataclass
class Edits:
    """Changes of one text, which are made all at once.

    A value that stands elsewhere (``*name``, ``<<``), or stands for others (``&name``), cannot be changed.

    Args:
        text: The text before the changes.
    """

    text: str
    _changes: dict[tuple[int, int], str] = field(default_factory=dict)
    _removed_from: dict[int, dict[int, Entry]] = field(default_factory=dict)
    _filled: set[int] = field(default_factory=set)

    def rename(self, key: yaml.ScalarNode, text: str) -> None:
        """Give a parameter or a group another key."""
        self._changes[key.start_mark.index, key.end_mark.index] = text

    def replace(self, entry: Entry, text: str) -> None:
        """Give a parameter another value, on the line of its key."""
        self._refuse_shared(entry)
        self._changes[entry.key.end_mark.index, _end(entry.value)] = f": {text}"

    def remove(self, entry: Entry) -> None:
        """Take a parameter or a group out, with the rest of its last line."""
        self._refuse_shared(entry)
        if entry.group.flow_style:
            self._remove_in_braces(entry)
            return
        self._changes[self._lines(entry)] = ""
        self._removed_from.setdefault(id(entry.group), {})[id(entry.key)] = entry

    def insert(self, group: yaml.MappingNode, name: str, value: Any) -> None:
        """Put a new parameter in front of the first one that stands in a group."""
        places = [key.start_mark for key, _ in group.value if not is_merged(group, key)]
        if not places:
            line = group.start_mark.line + 1
            raise ConfigError(f"line {line}: expected a parameter beside the merge (<<), which {name} is to go beside")
        first = places[0]
        line = f"{name}: {as_yaml(value)}"
        after = ", " if group.flow_style else "\n" + " " * first.column
        at = (first.index, first.index)
        self._changes[at] = self._changes.get(at, "") + line + after
        self._filled.add(id(group))

    def name_of(self, key: yaml.ScalarNode) -> str:
        """Return the key that a parameter or a group will have."""
        return self._changes.get((key.start_mark.index, key.end_mark.index), str(key.value))

    def dissolve(self, entry: Entry) -> None:
        """Move what a group in block style holds to the left, beside the group's own key, which goes."""
        first = entry.value.value[0][0].start_mark
        by, end = first.column - entry.key.start_mark.column, _end(entry.value)
        start = self.text.find("\n", entry.key.end_mark.index) + 1
        self._changes[self.text.rfind("\n", 0, entry.key.start_mark.index) + 1, start] = ""
        for place in [place for place in self._changes if start <= place[0] == place[1] <= end]:
            self._changes[place] = self._changes[place].replace("\n" + " " * by, "\n")
        while 0 < start < end:
            blank = self.text[start : start + by]
            if not blank.strip() and "\n" not in blank:
                self._changes[start, start + by] = ""
            start = self.text.find("\n", start) + 1

    def apply(self) -> str:
        """Return the changed text; a change within a removed group goes with it."""
        text, behind = self.text, len(self.text) + 1
        self._rescue_inserts()
        self._mark_empty()
        removed = self._removed()
        for start, end in sorted(self._changes, reverse=True):
            within = any(a <= start < b and end <= b and (a, b) != (start, end) for a, b in removed)
            if within or end > behind:
                continue
            text, behind = text[:start] + self._changes[start, end] + text[end:], start
        return text

    def _refuse_shared(self, entry: Entry) -> None:
        """Refuse to change a parameter whose value stands elsewhere, or may stand for others."""
        start: int = entry.value.start_mark.index
        is_alias = is_merged(entry.group, entry.key) or start < entry.key.start_mark.index
        if is_alias or self.text[start : start + 1] == "&":
            got = "an alias" if is_alias else "an anchor"
            raise SharedValueError(f"line {entry.line}: {entry.name}: expected a value alone, got {got} of YAML")

    def _lines(self, entry: Entry) -> tuple[int, int]:
        """Return where the lines of a parameter in block style begin and end."""
        end = self.text.find("\n", max(_end(entry.value), entry.key.end_mark.index))
        return self.text.rfind("\n", 0, entry.key.start_mark.index) + 1, len(self.text) if end < 0 else end + 1

    def _mark_empty(self) -> None:
        """Leave ``{}`` of a group that has nothing left: ROS reads no file with a key that has no value."""
        for group, gone in self._removed_from.items():
            first, *_ = gone.values()
            if group in self._filled or len(gone) < len(first.group.value):
                continue
            start, end = self._lines(first)
            for place in [(a, b) for a, b in self._changes if start <= a and b <= end]:
                del self._changes[place]
            self._changes[start, end] = " " * first.key.start_mark.column + "{}\n"

    def _removed(self) -> list[tuple[int, int]]:
        return [place for place, new in self._changes.items() if not new and place[1] > place[0]]

    def _rescue_inserts(self) -> None:
        """Move what is inserted in front of a parameter that goes with its line behind that line."""
        lines = {start: end for start, end in self._removed() if self.text[start - 1 : start] in ("", "\n")}
        for start, end in [place for place in self._changes if place[0] == place[1]]:
            line = self.text.rfind("\n", 0, start) + 1
            indent = self.text[line:start]
            if line in lines and lines[line] > start and not indent.strip():
                new = indent + self._changes.pop((start, end)).removesuffix(indent)
                behind = (lines[line], lines[line])
                self._changes[behind] = new + self._changes.get(behind, "")

    def _remove_in_braces(self, entry: Entry) -> None:
        keys = [key for key, _ in entry.group.value]
        position = keys.index(entry.key)
        if position + 1 < len(keys):
            self._changes[entry.key.start_mark.index, keys[position + 1].start_mark.index] = ""
        else:
            start = _end(entry.group.value[position - 1][1]) if position else entry.key.start_mark.index
            self._changes[start, _end(entry.value)] = ""


def is_merged(group: yaml.Node, key: yaml.Node) -> bool:
    """Whether a merge (``<<``) brought a key into a group."""
    start: int = key.start_mark.index
    return not group.start_mark.index <= start <= group.end_mark.index


def as_yaml(value: Any) -> str:
    """Return a value as it is written after its key."""
    return yaml.safe_dump(value, default_flow_style=True, width=1000).strip().removesuffix("...").strip()


def _end(node: yaml.Node) -> int:
    """Return the index after a node's last character; a block's own end mark lies after the comments that follow it."""
    if not isinstance(node, yaml.CollectionNode) or node.flow_style or not node.value:
        return int(node.end_mark.index)
    last = node.value[-1]
    return _end(last[1] if isinstance(last, tuple) else last)
