"""The moving bodies on the maps of a run, by digest, as a document."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from gym_mapbench.errors import ConfigError, RunError
from gym_mapbench.trust import refuse_code
from gym_mapbench.world.bodies import Body


def bodies_document(bodies: Mapping[str, Sequence[Body]]) -> dict[str, Any]:
    """Return bodies by the digest of their map as a JSON-able document."""
    return {digest: [body.model_dump(mode="json") for body in of_map] for digest, of_map in bodies.items()}


def read_bodies(document: Mapping[str, Any], where: str) -> dict[str, tuple[Body, ...]]:
    """Read what :func:`bodies_document` returned.

    Args:
        document: The document.
        where: Beginning of every error message.

    Raises:
        RunError: If it is anything else.
        UntrustedError: If it names code.
    """
    refuse_code(document, where)
    try:
        return {digest: tuple(Body.from_mapping(one, where) for one in of_map) for digest, of_map in document.items()}
    except (ConfigError, TypeError) as error:
        raise RunError(f"{where}: expected moving bodies by digest ({error})") from None
