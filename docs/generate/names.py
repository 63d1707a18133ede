"""Tables of the names in all registries."""

from __future__ import annotations

import yaml

from docs.generate.docstrings import plain
from docs.generate.markdown import code, name, table
from evolution.commands.catalogue import KINDS


def names_of(kind: str) -> str:
    """Return a table of the built-in names of one kind."""
    rows = [[name(one), plain(KINDS[kind].about(one))] for one in KINDS[kind].names()]
    return f"Written in: `{KINDS[kind].option}`.\n\n" + table(["name", "what it is"], rows)


def contents_of(kind: str) -> str:
    """Return the content of each name of a kind, folded, as ``mapbench show NAME`` prints it."""
    return "\n\n".join(_folded(kind, one) for one in KINDS[kind].names())


def _folded(kind: str, one: str) -> str:
    content = KINDS[kind].content
    if content is None:
        raise ValueError(f"{kind}: nothing to show")
    block = code(yaml.safe_dump(dict(content(one)), sort_keys=False).rstrip(), "yaml")
    return f'??? note "{one}"\n\n' + "\n".join(f"    {line}".rstrip() for line in block.splitlines())
