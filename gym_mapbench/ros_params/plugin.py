"""RosPlugin: the description of a plugin of Nav2 with which parameter files are read and written."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

from gym_mapbench.errors import ConfigError, nearest_name
from gym_mapbench.releases import RELEASES, Release
from gym_mapbench.ros_params.keys import Keys
from gym_mapbench.ros_params.nested import leaves, nest_dotted, value_at
from gym_mapbench.ros_params.section import RELEASE, Section, parameter_names
from gym_mapbench.settings import Settings

RosNames = Mapping[Release, str]
"""Release -> the class of a plugin in ROS; a release that does not have the plugin is left out."""
MISSPELT_PLUGIN = 0.9
"""Similarity from which on an unknown class is probably a misspelt known one."""


def in_every_release(ros_class: str) -> RosNames:
    """Return the names of a class that has the same name in all releases."""
    return dict.fromkeys(RELEASES, ros_class)


def since(release: Release, ros_class: str) -> RosNames:
    """Return the names of a class that only this release and the releases after it have."""
    return dict.fromkeys(RELEASES[RELEASES.index(release) :], ros_class)


def slashed_in_humble(package: str, name: str) -> RosNames:
    """Return the names of a planner's or behaviour's class, written with ``/`` up to Iron and ``::`` since Jazzy."""
    return {release: f"{package}/{name}" if release == "humble" else f"{package}::{name}" for release in RELEASES}


def known_class(ros_class: object, classes: Mapping[str, RosNames]) -> str | None:
    """Return our name of a class, None if it is not built here; ``/`` and ``::`` both separate its package."""
    given = str(ros_class).replace("/", "::")
    spelt = {name: {known.replace("/", "::") for known in names.values()} for name, names in classes.items()}
    return next((name for name, known in spelt.items() if given in known), None)


def nearest_class(ros_class: object, classes: Mapping[str, RosNames]) -> str | None:
    """Return the class of a table of which another is probably a misspelling; None if there is none."""
    return nearest_name(str(ros_class), _first_names(classes), MISSPELT_PLUGIN)


def _first_names(classes: Mapping[str, RosNames]) -> list[str]:
    """Return the name of each class in the first release that has it."""
    return [next(iter(names.values())) for names in classes.values()]


def name_of_class(ros_class: object, classes: Mapping[str, RosNames], where: str, what: str) -> str:
    """Return our name of a class.

    Args:
        ros_class: The class; ``/`` and ``::`` both separate its package.
        classes: Our name -> names in ROS.
        where: Full name of the key that gives the class.
        what: What kind of plugin it is.

    Raises:
        ConfigError: If the class is not built here; the error gives the nearest that is.
    """
    name = known_class(ros_class, classes)
    if name is not None:
        return name
    near = nearest_class(ros_class, classes)
    hint = f"did you mean {near!r}?" if near else f"expected one of: {', '.join(_first_names(classes))}"
    raise ConfigError(f"{where}: {what} {str(ros_class)!r} is not built here ({hint})")


def refuse_missing(names: RosNames, release: Release, where: str) -> None:
    """Refuse a plugin that a release does not have.

    Raises:
        ConfigError: Naming the first release that has it.
    """
    if release not in names:
        other, ros_class = next(iter(names.items()))
        short = ros_class.replace("/", "::").rpartition("::")[2]
        raise ConfigError(f"{where}: Nav2 {release.capitalize()} has no {short}; --nav2 {other} has")


def refuse_slash(ros_class: object, release: Release, where: str) -> None:
    """Refuse a class of Nav2 that is written as before Jazzy, with which Lyrical does not start.

    Raises:
        ConfigError: With the class as Lyrical writes it.
    """
    given = str(ros_class)
    if release == "lyrical" and given.startswith("nav2_") and "/" in given:
        written = given.replace("/", "::")
        raise ConfigError(f"{where}: Nav2 Lyrical has no class {given!r} and does not start; it is written {written!r}")


def take_class(group: Section, default: str | None, known: Mapping[str, RosNames], what: str) -> str:
    """Take the class of a plugin out of its group and return our name of it.

    Raises:
        ConfigError: If there is none, it is not built here, or the release of the file does not have it.
    """
    ros_class = group.values.pop("plugin", default)
    where = f"{group.name}.plugin"
    if ros_class is None:
        raise ConfigError(f"{where}: expected the class of this {what}, got none")
    name = name_of_class(ros_class, known, where, what)
    refuse_missing(known[name], group.findings.release, where)
    return name


def written(settings: type[Settings], values: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """Yield the dotted names and values that a file gives: not those without effect with which the file is read anyway.

    Args:
        settings: The class of the parameters. If some have no effect, its ``unread`` names them or their groups.
        values: All parameters, nested, in JSON's form.
    """
    unread = getattr(settings(**values), "unread", ()) if hasattr(settings, "unread") else ()
    read = {name: value for name, value in values.items() if name not in unread}
    filled = dict(leaves(settings(**read).model_dump(mode="json", exclude_none=True))) if unread else {}
    for name, value in leaves(values):
        if name.partition(".")[0] in read or filled.get(name) != value:
            yield name, value


def _nothing(group: Section) -> None:
    """Leave a group as it is."""


def _as_it_is(values: dict[str, Any], release: Release) -> dict[str, Any]:
    """Leave a section as it is."""
    return values


@dataclass(frozen=True)
class RosPlugin:
    """A plugin of Nav2 as parameter files know it.

    Args:
        names: Release -> its class in ROS.
        title: Its name in a sentence.
        params: The class of its parameters. If they depend on the release, they have a field ``release``, and the
            tables ``DEFAULTS``, ``MISSING`` and ``OURS`` (see :class:`ReleaseSettings`).
        other_keys: The other keys of its section.
        stands_in_for: Parts of the names of foreign classes that it stands in for.
        adapt: Brings the section of a file into the form that ``params`` reads, and lists the changes.
        arrange: Brings the nested parameters into the form of a release's section, the class left out.
    """

    names: RosNames
    title: str
    params: type[Settings]
    other_keys: Keys = field(default_factory=Keys)
    stands_in_for: tuple[str, ...] = ()
    adapt: Callable[[Section], None] = _nothing
    arrange: Callable[[dict[str, Any], Release], dict[str, Any]] = _as_it_is

    @cached_property
    def keys(self) -> Keys:
        """The other keys of its section, and the parameters that not every release has."""
        return replace(self.other_keys, missing=getattr(self.params, "MISSING", {}))

    @cached_property
    def our_keys(self) -> frozenset[str]:
        """Dotted names of those of its parameters that Nav2 does not have."""
        ours: frozenset[str] = getattr(self.params, "OURS", frozenset({RELEASE}))
        return ours

    @cached_property
    def parameters(self) -> tuple[str, ...]:
        """Dotted names of its parameters, except the release."""
        return tuple(name for name in parameter_names(self.params) if name != RELEASE)

    def default(self, name: str, release: Release) -> Any:
        """Return the default of a parameter in a release; None if the release does not have the parameter."""
        first, _, rest = name.partition(".")
        of_class = self.params.model_fields[first].default
        usual = value_at(of_class, rest) if rest else of_class
        return getattr(self.params, "DEFAULTS", {}).get(release, {}).get(name, usual)

    def changed_defaults(self, source: Release, target: Release) -> dict[str, Any]:
        """Return, by dotted name, the source's defaults that differ in the target; both must have the parameter."""
        of_nav2 = [name for name in self.parameters if name not in self.our_keys]
        pairs = {name: (self.default(name, source), self.default(name, target)) for name in of_nav2}
        return {name: old for name, (old, new) in pairs.items() if None not in (old, new) and old != new}

    def complete(self, values: Mapping[str, Any]) -> dict[str, Any]:
        """Check parameters and fill in the defaults; the result can be written as JSON and leaves out None."""
        return self.params(**values).model_dump(mode="json", exclude_none=True)

    def given(self, group: Section, strays: Mapping[str, str] | None = None) -> dict[str, Any]:
        """Return the parameters that a section gives, nested; all other keys become findings.

        Args:
            group: The section.
            strays: Parameters of other plugins that are often left over in such a section -> whose they are.

        Raises:
            ConfigError: If the value of a parameter is a template.
        """
        own = set(self.parameters)
        elsewhere = {name: why for name, why in (strays or {}).items() if name not in own}
        keys = replace(self.keys, elsewhere={**elsewhere, **self.keys.elsewhere})
        return group.read(keys, self.parameters)

    def read(self, group: Section, strays: Mapping[str, str] | None = None) -> dict[str, Any]:
        """Read a section; values are checked here, where their full names are known.

        Raises:
            ConfigError: If a value is wrong.
        """
        self.adapt(group)
        values = self.given(group, strays)
        if RELEASE in self.params.model_fields:
            values[RELEASE] = group.findings.release
        group.make(self.params, values)
        return values

    def write(self, values: Mapping[str, Any], release: Release) -> dict[str, Any]:
        """Return the section that a release reads: the class, and those of the parameters that Nav2 has."""
        of_nav2 = {name: value for name, value in written(self.params, values) if name not in self.our_keys}
        return {"plugin": self.names[release], **self.arrange(nest_dotted(of_nav2), release)}
