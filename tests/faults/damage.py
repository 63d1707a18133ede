"""Faults in files: documents with a few values replaced, removed or repeated, and texts with a few bytes changed."""

from __future__ import annotations

import copy
import json
import re
from collections.abc import Sequence

import numpy as np
import yaml

FASTER = getattr(yaml, "CDumper", yaml.Dumper)
"""Writes YAML ten times as fast as the dumper in Python, where PyYAML was built with it."""

STRANGE = [
    *(None, True, False, 0, -1, 1, 2, 10**9, 2**63, 10**400, -0.0, 1e-300, 1e308, float("nan"), float("inf")),
    *(
        "",
        " ",
        "x" * 5000,
        "\x00",
        "\ud800",
        "../../etc/passwd",
        "/dev/zero",
        "/etc",
        "a\nb",
        "{}",
        "1:30",
        "190:20:30",
    ),
    *("1e5", "0x1F", "2020-01-01", "no_such_module:thing", "os:getcwd", "os:no", "x:y:z", "=1+1", "thesis", "dwb"),
    *([], {}, [[]], [None], [1, 2], [1, 2, 3, 4], ["a", "a"], {"a": 1}, {"name": None}, {"": ""}, {1: 2}, {None: None}),
]
"""Values that may stand anywhere, whatever is expected there."""

NUMBER = re.compile(rb"-?\d+(?:\.\d+)?")

_TEXTS = [
    *("190:20:30", "-1:-1", "1_0:5_9:_", "2001-99-99", "2001-01-01T25:61:61Z", "0b2", "0o9", "1_000_000", "0x", ".inf"),
    *("!!binary x", "!!set {a}", "!!omap [a]", "!!pairs [a: 1]", "!!timestamp x", "!!python/name:os.system", "!!int x"),
    *("&a [*a]", "*none", "<<: 1", "<<: [1]", "? [a]", "? {a: b}\n: c", "%YAML 9.9", "---\n---", "\t", "\x85", "\x00"),
    *("[" * 1100, "{a: " * 1100, "9" * 5000, "- " * 1100, "'", '"', "|", ">", "@", "`", "\ufeff", "\u2028"),
]
SNIPPETS = [text.encode("utf-8", "surrogatepass") for text in _TEXTS]
"""Texts that YAML or JSON read in ways of their own."""


def damaged(document: object, rng: np.random.Generator) -> object:
    """Return a copy of a document with one to three faults."""
    document = copy.deepcopy(document)
    for _ in range(rng.integers(1, 4)):
        places = list(_places(document))
        if not places:
            break
        _spoil(*places[rng.integers(len(places))], rng)
    return document


def _places(document: object):
    """Yield every container in a document with every key or index of it."""
    pending = [document]
    while pending:
        holder = pending.pop()
        items = list(holder.items() if isinstance(holder, dict) else enumerate(holder))
        for key, value in items:
            yield holder, key
            if isinstance(value, dict | list):
                pending.append(value)


def _spoil(holder, key, rng: np.random.Generator) -> None:
    """Put one fault at a place."""
    kind = rng.integers(6)
    if kind == 0:
        del holder[key]
    elif kind == 1 and isinstance(holder, dict):
        holder[_letters(str(key), rng)] = holder.pop(key)
    elif kind == 2:
        holder[key] = [holder[key]]
    elif kind == 3 and isinstance(holder[key], int | float) and abs(holder[key]) < 1e300:
        factor = (0, -1, 0.5, 2, 10, 1000, 1e9)[rng.integers(7)]
        holder[key] = type(holder[key])(holder[key] * factor)
    elif kind == 4 and isinstance(holder, list):
        holder.extend(copy.deepcopy(holder[key]) for _ in range(rng.integers(1, 40)))
    else:
        holder[key] = copy.deepcopy(STRANGE[rng.integers(len(STRANGE))])


def _letters(text: str, rng: np.random.Generator) -> str:
    """Change one letter, as a slip of the finger does."""
    at = int(rng.integers(len(text) + 1))
    return text[:at] + "abc_. 1-"[rng.integers(8)] + text[at + int(rng.integers(2)) :]


def damaged_bytes(data: bytes, rng: np.random.Generator, snippets: Sequence[bytes] = SNIPPETS) -> bytes:
    """Return a file's bytes with one to three faults.

    Args:
        data: The bytes.
        rng: Chooses the faults.
        snippets: What may be put in.
    """
    for _ in range(rng.integers(1, 4)):
        at = int(rng.integers(len(data) + 1))
        end = at + int(rng.integers(200))
        kind = rng.integers(6)
        if kind == 0:
            data = data[:at]
        elif kind == 1 and at < len(data):
            data = data[:at] + bytes([data[at] ^ (1 << int(rng.integers(8)))]) + data[at + 1 :]
        elif kind == 2:
            data = data[:at] + rng.bytes(int(rng.integers(1, 9))) + data[at:]
        elif kind == 3:
            data = data[:at] + snippets[rng.integers(len(snippets))] + data[at + int(rng.integers(12)) :]
        elif kind == 4:
            data = _other_number(data, rng)
        else:
            data = data[:end] + data[at:end] * int(rng.integers(1, 20)) + data[end:]
    return data


def _other_number(data: bytes, rng: np.random.Generator) -> bytes:
    """Put something strange in the place of a number near the beginning, where headers are."""
    found = list(NUMBER.finditer(data[:4000]))
    if not found:
        return data
    number = found[rng.integers(len(found))]
    strange = (b"999999999", b"100000", b"-5", b"0", b"4294967297", b"1e5", b".", b"")[rng.integers(8)]
    return data[: number.start()] + strange + data[number.end() :]


def as_yaml(document: object) -> bytes:
    """Write a document as YAML, whatever is in it."""
    try:
        return yaml.dump(document, Dumper=FASTER, sort_keys=False).encode()
    except UnicodeEncodeError:  # half a character, which only the dumper in Python writes
        return yaml.dump(document, sort_keys=False).encode("utf-8", "surrogatepass")


def as_json(document: object) -> bytes:
    """Write a document as JSON, whatever is in it."""
    return json.dumps(document, indent=1, skipkeys=True).encode("utf-8", "surrogatepass")


def bomb(levels: int = 12, width: int = 10) -> str:
    """Return YAML whose aliases unfold to ``width ** levels`` values."""
    lines = [f"a0: &a0 [{', '.join('1' * width)}]"]
    lines += [f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * width)}]" for n in range(1, levels)]
    return "\n".join(lines) + "\n"
