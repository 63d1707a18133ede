"""Document: the content of a parameter file, with the line of every key."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import yaml

from controllers.nav2_params.file.yaml_edits import is_merged
from gym_mapbench.errors import ConfigError
from gym_mapbench.files.documents import MAX_VALUES, parse_yaml, read_document_text
from gym_mapbench.ros_params import fill_templates, first_unreadable, no_value

PARAMETERS = "ros__parameters"
"""The group that every node has, and that is left out of the full names of its parameters."""


@dataclass(frozen=True)
class Document:
    """The content of a parameter file.

    Args:
        values: The content of the YAML file.
        lines: Full dotted name of every key -> number of its line.
        repeated: Full names of the keys that one group gives twice; the last value counts, as in ROS.
        regrouped: Those of them that are groups; of such a group, ROS merges both.
        aliased: Full name of each key whose value stands elsewhere (``*name``, ``<<``) -> whether it is a single value.
        folder: Folder of the file, to which the names of other files in it are relative.
        origins: Full name of each parameter that a section for several nodes gives a node -> its name in the file.
    """

    values: object
    lines: Mapping[str, int] = field(default_factory=dict)
    repeated: tuple[str, ...] = ()
    regrouped: tuple[str, ...] = ()
    aliased: Mapping[str, bool] = field(default_factory=dict)
    folder: Path = Path()
    origins: Mapping[str, str] = field(default_factory=dict)

    def line_of(self, name: str) -> int | None:
        """Return the line number of a key, or else of the innermost group around it; None if there is neither."""
        while name and name not in self.lines:
            name = name.rpartition(".")[0]
        return self.lines.get(name)

    def with_origins(self, origins: Mapping[str, str]) -> Document:
        """Return the document with further names of parameters, each of which has another name in the file."""
        lines = {name: self.lines[origin] for name, origin in origins.items() if origin in self.lines}
        return replace(self, lines={**self.lines, **lines}, origins=origins)

    def located(self, message: str) -> str:
        """Put the line number in front of a message that begins with the full name of a key or of a group around it.

        The name becomes that in the file.
        """
        name, *rest = message.split(": ")
        while rest and f"{name}.{rest[0]}" in self.lines:
            name = f"{name}.{rest.pop(0)}"
        name = written_name(name, self.origins)
        line = self.line_of(name)
        return message if line is None else f"line {line}: {': '.join([name, *rest])}"


def read_document(path: str | Path, defines: Mapping[str, str] | None = None) -> Document:
    """Read a parameter file.

    Args:
        path: The file.
        defines: Values of its templates.

    Raises:
        ConfigError: If it cannot be read, is not YAML, or has no template of one of these names.
    """
    text = fill_templates(read_document_text(path), defines or {})
    try:
        values, node = parse_yaml(text, path)
    except ConfigError:
        found = first_unreadable(text)
        if found is None:
            raise
        raise no_value(f"line {found[0]}", found[1]) from None
    keys = [] if node is None else list(_keys(node, ""))
    times = Counter(name for name, _, _ in keys)
    repeated = tuple(name for name, number in times.items() if number > 1)
    groups = {name for name, _, value in keys if isinstance(value, yaml.MappingNode)}
    return Document(
        values,
        lines={name: key.start_mark.line + 1 for name, key, _ in keys},
        repeated=repeated,
        regrouped=tuple(name for name in repeated if name in groups),
        aliased={} if node is None else dict(_aliased(node, "")),
        folder=Path(path).parent,
    )


def written_name(name: str, origins: Mapping[str, str]) -> str:
    """Return the name that a parameter or group has in the file: its own if its own section gives a part of it.

    A name that the file does not have is named after the innermost group around it that the file has.

    Args:
        name: Full name.
        origins: See :class:`Document`.
    """
    group = name
    while group:
        given = [one for one in origins if one == group or one.startswith(f"{group}.")]
        names = {origins[one].removesuffix(one[len(group) :]) for one in given}
        if names:
            return name if group in names else min(names) + name[len(group) :]
        group = group.rpartition(".")[0]
    return name


def refuse_bomb(document: object) -> None:
    """Refuse a document whose aliases unfold to too many values, or without end.

    Raises:
        ConfigError: If the document has more than ``MAX_VALUES`` values.
    """
    pending, seen = [document], 0
    while pending:
        value = pending.pop()
        seen += 1
        if seen > MAX_VALUES:
            raise ConfigError(f"expected at most {MAX_VALUES} values, aliases unfolded, got more")
        if isinstance(value, Mapping):
            pending.extend(value.values())
        elif isinstance(value, (list, tuple, set)):
            pending.extend(value)


def _keys(node: yaml.Node, prefix: str) -> Iterator[tuple[str, yaml.Node, yaml.Node]]:
    """Yield the full name of every key, the key and the value, without keys that a merge (``<<``) brought."""
    for key, value in node.value if isinstance(node, yaml.MappingNode) else ():
        name = prefix.removesuffix(".") if key.value == PARAMETERS else f"{prefix}{key.value}"
        if key.value != PARAMETERS and not is_merged(node, key):
            yield name, key, value
        yield from _keys(value, f"{name}.")


def _aliased(node: yaml.Node, prefix: str) -> Iterator[tuple[str, bool]]:
    """Yield the full name of every key whose value stands elsewhere, and whether that is a single value."""
    for key, value in node.value if isinstance(node, yaml.MappingNode) else ():
        name = prefix.removesuffix(".") if key.value == PARAMETERS else f"{prefix}{key.value}"
        items = value.value if isinstance(value, yaml.SequenceNode) else []
        places = [value.start_mark.index, *(item.start_mark.index for item in items)]
        if is_merged(node, key) or min(places) < key.start_mark.index:
            yield name, isinstance(value, yaml.ScalarNode)
        yield from _aliased(value, f"{name}.")


def parameter_groups(group: yaml.Node, prefix: str) -> Iterator[tuple[str, yaml.ScalarNode, yaml.MappingNode]]:
    """Yield the full name, the key and the parameters of every node."""
    if not isinstance(group, yaml.MappingNode):
        return
    for key, value in group.value:
        if not isinstance(value, yaml.MappingNode) or not isinstance(key, yaml.ScalarNode):
            continue
        inner = [below for name, below in value.value if name.value == PARAMETERS]
        if inner and isinstance(inner[0], yaml.MappingNode):
            yield f"{prefix}{key.value}", key, inner[0]
        if key.value != PARAMETERS:
            yield from parameter_groups(value, f"{prefix}{key.value}.")
