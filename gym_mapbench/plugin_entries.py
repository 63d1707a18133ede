"""Entries of plugins such as planners: options and what makes the plugin of them, or a callable without arguments."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Protocol, TypeVar

from gym_mapbench.errors import ConfigError
from gym_mapbench.registry import Registry, must_be_subclass
from gym_mapbench.settings import Settings


class Entry(Protocol):
    """A kind of plugin, as a registry holds it: the class of its options, and what makes the plugin of them."""

    @property
    def params(self) -> type[Settings]:
        """The class of its options."""
        ...

    @property
    def make(self) -> Callable[[Any], Any]:
        """Makes the plugin from its options."""
        ...


E = TypeVar("E", bound=Entry)


class NoParams(Settings):
    """Options of a plugin that has none."""


def entry_or_callable(kind: Any) -> Callable[[Any], Any]:
    """Return a check that accepts entries of a class, and callables that make a plugin without arguments."""

    def check(made: Any) -> Any:
        if isinstance(made, kind):
            must_be_subclass(Settings)(made.params)
            return made
        if not callable(made):
            raise ConfigError(f"expected a {kind.__name__} or a callable, got {type(made).__name__}")
        return kind(NoParams, lambda _: made())

    return check


def make_plugin(registry: Registry[E], name: str, params: Mapping[str, Any], method: str) -> Any:
    """Make a plugin by name.

    Args:
        registry: Where it is registered.
        name: Its name.
        params: Its options.
        method: The method that it has to have.

    Raises:
        ConfigError: If there is no such plugin, it has no such option, or it lacks the method.
        PluginError: If a third party's cannot be made.
    """
    entry = registry.get(name)
    settings = entry.params.from_mapping(params, name)
    with registry.blamed(name):
        plugin = entry.make(settings)
    if not callable(getattr(plugin, method, None)):
        raise ConfigError(f"{registry.what} {name!r}: expected one with {method!r}, got a {type(plugin).__name__}")
    return plugin
