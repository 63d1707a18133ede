"""The files of the modules that a document names as ``module:attribute``, by content; no code runs."""

from __future__ import annotations

import hashlib
import os
import sys
from collections.abc import Iterable
from importlib.machinery import PathFinder
from itertools import accumulate
from pathlib import Path

from gym_mapbench.trust import modules_in


def code_of(document: object) -> dict[str, str]:
    """Return the content hashes of the modules that a document names, by module."""
    return code_digests(modules_in(document))


def code_digests(modules: Iterable[str]) -> dict[str, str]:
    """Return the content hashes of modules, by module; those without a file that can be read are left out.

    A module that they import does not count.
    """
    found = {module: _digest(module) for module in modules}
    return {module: digest for module, digest in found.items() if digest is not None}


def _digest(module: str) -> str | None:
    file = _file_of(module)
    try:
        return None if file is None else hashlib.blake2b(Path(file).read_bytes(), digest_size=16).hexdigest()
    except OSError:
        return None


def _file_of(module: str) -> str | None:
    """Return the file that an import would load, also from the current directory; packages are not imported."""
    places, file = [*sys.path, os.getcwd()], None
    for name in accumulate(module.split("."), "{}.{}".format):
        spec = PathFinder.find_spec(name, places)
        if spec is None:
            return None
        places, file = list(spec.submodule_search_locations or ()), spec.origin
    return file
