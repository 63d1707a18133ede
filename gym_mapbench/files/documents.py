"""Bounded reading of YAML and JSON from untrusted files: a document is read, or refused at once and in one line.

Of YAML, the part is read that ROS reads: texts, numbers, true and false, null, lists and mappings with names as keys,
and aliases as long as they unfold to something of reasonable size.
"""

from __future__ import annotations

import json
import logging
import re
from collections.abc import Hashable
from pathlib import Path
from typing import Any

import yaml

from gym_mapbench.errors import ConfigError, MapBenchError
from gym_mapbench.files.bounded import read_text

LOG = logging.getLogger(__name__)

MAX_YAML_BYTES = 500_000
"""PyYAML needs more than a second for more; a parameter file has some 20 000."""

MAX_NODES = 20_000
"""Most values in a YAML file as it is written."""

MAX_VALUES = 100_000
"""Most values in a YAML file with its aliases unfolded."""

MAX_BITS = 64
"""Size of the integers of ROS and of all seeds."""


UNREADABLE = (yaml.YAMLError, ValueError, TypeError, AttributeError, LookupError, ArithmeticError, RecursionError)
"""What PyYAML's constructors raise on ill-formed values."""


class _Loader(yaml.SafeLoader):
    """Counts what it reads, and reads what ROS does.

    ``1e-3`` is a number, which YAML 1.1 requires a dot in; ``1:30`` and ``2026-01-31`` are texts, which YAML 1.1 takes
    for numbers to the base of 60 and for dates.
    """

    nodes = 0

    def compose_node(self, parent: Any, index: Any) -> Any:
        """Count a node before it is read."""
        self.nodes += 1
        if self.nodes > MAX_NODES:
            raise yaml.YAMLError(f"expected at most {MAX_NODES} values, got more")
        return super().compose_node(parent, index)

    def construct_scalar(self, node: Any) -> Any:
        """Refuse halves of characters, which no text file can hold."""
        value = super().construct_scalar(node)
        value.encode("utf-8")
        return value

    def construct_mapping(self, node: Any, deep: bool = False) -> dict[Hashable, Any]:
        """Read every key as a name, as it is written."""
        if isinstance(node, yaml.MappingNode):
            self.flatten_mapping(node)
            node.value = [(_name_of(key), value) for key, value in node.value]
        return super().construct_mapping(node, deep)

    def construct_yaml_int(self, node: Any) -> int:
        """Refuse integers of absurd length."""
        value: int = super().construct_yaml_int(node)
        if value.bit_length() > MAX_BITS:
            raise yaml.YAMLError(f"expected integers of at most {MAX_BITS} bits, got one of {value.bit_length()}")
        return value


TEXT, INT, FLOAT = (f"tag:yaml.org,2002:{name}" for name in ("str", "int", "float"))
_OWN_FORMS = (INT, FLOAT, "tag:yaml.org,2002:timestamp")
_Loader.yaml_implicit_resolvers = {
    first: [(tag, form) for tag, form in forms if tag not in _OWN_FORMS]
    for first, forms in yaml.SafeLoader.yaml_implicit_resolvers.items()
}
_Loader.add_implicit_resolver(
    INT, re.compile(r"[-+]?(0b[01_]+|0[0-7_]+|0|[1-9][\d_]*|0x[\da-fA-F_]+)$"), list("-+0123456789")
)
_Loader.add_implicit_resolver(
    FLOAT,
    re.compile(
        r"[-+]?((\d[\d_]*\.[\d_]*|\.\d[\d_]*)([eE][-+]?\d+)?|\d+[eE][-+]?\d+|\.(inf|Inf|INF))$|\.(nan|NaN|NAN)$"
    ),
    list("-+.0123456789"),
)
_Loader.add_constructor(INT, _Loader.construct_yaml_int)
for _name in ("binary", "timestamp", "omap", "pairs", "set"):
    _Loader.yaml_constructors[f"tag:yaml.org,2002:{_name}"] = yaml.SafeLoader.construct_undefined


def _name_of(key: yaml.Node) -> yaml.ScalarNode:
    """Return the node of a key as a text."""
    if not isinstance(key, yaml.ScalarNode):
        raise yaml.YAMLError(f"expected names as keys, got something else in line {key.start_mark.line + 1}")
    return yaml.ScalarNode(TEXT, key.value, key.start_mark, key.end_mark)


def read_yaml(path: str | Path) -> Any:
    """Read a file with one YAML document.

    Raises:
        ConfigError: If the file is missing, too large, or not YAML.
    """
    document = parse_yaml(read_document_text(path), path)[0]
    LOG.info("%s: read", path)
    return document


def read_document_text(path: str | Path) -> str:
    """Read the text of a YAML file; raises ``ConfigError`` if it is missing, too large, or not text."""
    return read_text(path, MAX_YAML_BYTES, ConfigError)


def parse_yaml(text: str, where: str | Path) -> tuple[Any, yaml.Node | None]:
    """Read one YAML document.

    Args:
        text: The document.
        where: Its file; opens every error message.

    Returns:
        What it holds, and its nodes, which know their lines; None if it is empty.

    Raises:
        ConfigError: If it is not YAML, holds something else than ROS reads, or too much of it.
    """
    try:
        loader = _Loader(text)
        node = loader.get_single_node()
        if node is None:
            return None, None
        _refuse_bomb(node)
        return loader.construct_document(node), node
    except UNREADABLE as error:
        reason = " ".join(str(error).split())[:200]
        raise ConfigError(f"{where}: not a YAML file ({reason})") from None


def _refuse_bomb(root: yaml.Node) -> None:
    """Refuse a document whose aliases unfold to too many values, or without end."""
    sizes: dict[int, int] = {}

    def size(node: yaml.Node) -> int:
        if id(node) not in sizes:
            sizes[id(node)] = MAX_VALUES + 1  # what an alias of a node to itself finds
            sizes[id(node)] = 1 + sum(map(size, _inner(node)))
        return sizes[id(node)]

    if size(root) > MAX_VALUES:
        raise yaml.YAMLError(f"expected at most {MAX_VALUES} values, aliases unfolded, got more")


def _inner(node: yaml.Node) -> list[yaml.Node]:
    """Return the nodes directly inside a node."""
    if isinstance(node, yaml.MappingNode):
        return [one for pair in node.value for one in pair]
    return list(node.value) if isinstance(node, yaml.SequenceNode) else []


def parse_json(text: str, where: str | Path, raises: type[MapBenchError]) -> Any:
    """Read one JSON document.

    Args:
        text: The document.
        where: Its file; opens every error message.
        raises: The error of this kind of file.

    Raises:
        raises: If it is not JSON.
    """
    try:
        document = json.loads(text)
        if "\\ud" in text.lower():  # perhaps half a character, which no text file can hold
            json.dumps(document, ensure_ascii=False).encode("utf-8")
    except (ValueError, RecursionError) as error:
        raise raises(f"{where}: not a JSON file ({' '.join(str(error).split())[:120]})") from None
    return document
