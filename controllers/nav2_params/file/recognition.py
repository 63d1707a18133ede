"""Recognises by its keys for which distribution a parameter file is written."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from controllers.nav2_params.file.nodes import Node
from controllers.nav2_params.file.signs import DRIVES, IGNORED, STARTS, Sign, marks_of, signs_of
from controllers.nav2_params.file.wildcards import share
from gym_mapbench.errors import ConfigError
from gym_mapbench.releases import RELEASES, Release

CLEAR_MAJORITY = 2
"""Where there are signs of both sides, one needs more than this many times the signs of the other."""
NEIGHBOURS: dict[Release, Release] = {"humble": "jazzy", "jazzy": "humble", "lyrical": "jazzy"}
"""Release -> the release from which the keys that are named to the user tell it."""


@dataclass(frozen=True)
class Recognition:
    """As which distribution a file is read, and why.

    Args:
        release: The distribution.
        told_by: Full names of the keys that say so, the strongest first; empty if none does, or if the user said it.
        against: Full names of the keys that this distribution does not have, the strongest first.
        given: Whether the user named the distribution.
    """

    release: Release
    told_by: tuple[str, ...] = ()
    against: tuple[str, ...] = ()
    given: bool = False


def recognise(nodes: list[Node], given: Release | None = None) -> Recognition:
    """Return the distribution that a file is written for, and the keys that tell; Humble if none does.

    Lyrical is told from the older ones first, and then Jazzy from Humble. The strongest signs there are decide, if a
    clear majority of them speaks for one side; weaker signs then do not count. Among signs of the weakest strength any
    majority decides, and without one the file is the older release's. The reason is that only some signs keep Nav2 from
    starting, and that only some keys change how it drives; the others are often leftovers.

    Args:
        nodes: The nodes of the file.
        given: The distribution that the user names, which counts before all signs.

    Raises:
        ConfigError: If stronger signs have no clear majority, so that the file mixes the distributions, or a section
            for several nodes gives a parameter twice.
    """
    signs = sorted(_signs(nodes), key=lambda sign: -sign.strength)
    release = given or _decide(signs)
    told_by = () if given else _names(_telling(release, NEIGHBOURS[release], signs))
    against = _names([sign for sign in signs if release not in sign.releases])
    return Recognition(release, told_by, against, given is not None)


def _signs(nodes: list[Node]) -> list[Sign]:
    """Return the signs of a file, each under its name in the file."""
    own = [sign for node in nodes for sign in signs_of(node)]
    shared = share(nodes)
    of_made = (sign for node in shared.made for sign in marks_of(node))
    named = [sign._replace(name=shared.origins.get(sign.name, sign.name)) for sign in of_made]
    return [*own, *(sign for sign in dict.fromkeys(named) if sign not in own)]


def _decide(signs: Sequence[Sign]) -> Release:
    older = [sign for sign in signs if "lyrical" not in sign.releases]
    if _prevails([sign for sign in signs if sign.releases == ("lyrical",)], older):
        return "lyrical"
    return "jazzy" if _prevails(_telling("jazzy", "humble", signs), _telling("humble", "jazzy", signs)) else "humble"


def _prevails(newer: Sequence[Sign], older: Sequence[Sign]) -> bool:
    """Whether the signs of the newer side outweigh those of the older one.

    Raises:
        ConfigError: If neither side has a clear majority of the strong signs.
    """
    for strength, majority in ((STARTS, CLEAR_MAJORITY), (DRIVES, CLEAR_MAJORITY), (IGNORED, 1)):
        ours, theirs = ([sign for sign in side if sign.strength == strength] for side in (newer, older))
        if len(ours) > majority * len(theirs):
            return True
        if len(theirs) > majority * len(ours):
            return False
        if ours and strength > IGNORED:
            raise _mixture(ours[0], theirs[0])
    return False


def _mixture(newer: Sign, older: Sign) -> ConfigError:
    choices = " or ".join(f"--nav2 {name}" for name in RELEASES if name in {*newer.releases, *older.releases})
    return ConfigError(
        f"{newer.name}: the file mixes the distributions: this is {_whose(newer)}, but {older.name} is "
        f"{_whose(older)}; say which one with {choices}"
    )


def _whose(sign: Sign) -> str:
    return " and ".join(f"{release.capitalize()}'s" for release in sign.releases)


def _telling(release: Release, other: Release, signs: Sequence[Sign]) -> list[Sign]:
    """Return the signs that tell one release from another."""
    return [sign for sign in signs if release in sign.releases and other not in sign.releases]


def _names(signs: Sequence[Sign]) -> tuple[str, ...]:
    return tuple(sign.name for sign in signs)
