"""Settings: the base of every frozen, validated group of options.

Unknown keys and bad values raise one-line :class:`~gym_mapbench.errors.ConfigError`
that names the key, what was expected and what came.
"""

from __future__ import annotations

import reprlib
from collections.abc import Iterator, Mapping
from typing import Any, ClassVar, Self

from pydantic import (
    BaseModel,
    ConfigDict,
    ModelWrapValidatorHandler,
    SerializerFunctionWrapHandler,
    ValidationError,
    ValidatorFunctionWrapHandler,
    field_validator,
    model_serializer,
    model_validator,
)
from pydantic_core import ErrorDetails

from gym_mapbench.errors import ConfigError, nearest_name

LENGTHS = {"too_short": ("at least", "min_length"), "too_long": ("at most", "max_length")}
"""Problems of lists and tuples that have a wrong length: how they are said, and the limit in the problem's context."""
KINDS = {"tuple_type": "a list", "list_type": "a list", "dict_type": "a mapping", "model_type": "a mapping of options"}
"""What a value of the wrong type has to be, in the words of files: YAML knows no tuples and no dictionaries."""


class OptionError(ConfigError):
    """A problem with one option.

    Args:
        key: Its name, with those of the options around it, joined by dots; empty for a problem of several options.
        problem: What was expected, and what came.
    """

    def __init__(self, key: str, problem: str) -> None:
        super().__init__(f"{key}: {problem}" if key else problem)
        self.key = key
        self.problem = problem


class Settings(BaseModel):
    """Frozen, keyword-only options; equal by value, JSON-able with ``model_dump(mode="json")``.

    Attributes:
        meant: What a message about an unknown key suggests, by keys of other libraries.

    Raises:
        ConfigError: On an unknown key or a value of the wrong type or range.
    """

    meant: ClassVar[Mapping[str, str]] = {}
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    def __init__(self, **values: Any) -> None:
        try:
            super().__init__(**values)
        except ValidationError as error:
            raise OptionError(*_first_problem(error, type(self), values)) from None

    @model_validator(mode="wrap")
    @classmethod
    def _keys_are_names(cls, values: Any, validate: ModelWrapValidatorHandler[Self]) -> Self:
        """Refuse a mapping from Python with keys that no option can have."""
        if isinstance(values, Mapping):
            for key in values:
                if not isinstance(key, str):
                    raise ConfigError(f"expected names as keys, got {_short(key)}")
        return validate(values)

    @field_validator("*", mode="wrap")
    @classmethod
    def _as_it_came(cls, value: Any, validate: ValidatorFunctionWrapHandler) -> Any:
        """Refuse what pydantic converts and ROS does not: texts and bools to numbers, anything to bools."""
        made = validate(value)
        _refuse_conversion(value, made)
        return made

    @classmethod
    def option_names(cls) -> list[str]:
        """Names of all options, for messages about unknown ones."""
        return list(cls.model_fields) + [field.alias for field in cls.model_fields.values() if field.alias]

    @classmethod
    def from_mapping(cls, values: object, where: str) -> Self:
        """Build from a mapping; ``where`` (a file or section name) opens every error message."""
        if not isinstance(values, Mapping):
            raise ConfigError(f"{where}: expected a mapping of options, got {_kind(values)}")
        try:
            return cls(**{str(key): value for key, value in values.items()})
        except ConfigError as error:
            raise ConfigError(f"{where}: {error}") from None

    def replace(self, **changes: Any) -> Self:
        """Return a copy with some options changed, validated again."""
        return type(self)(**{**{name: getattr(self, name) for name in type(self).model_fields}, **changes})


class ExtendedSettings(Settings):
    """Options of which some are newer than the files that hold the others.

    A newer option is left out of files while it has its default, so that these files and the identities made of them
    stay those of earlier versions.

    Attributes:
        newer: Names of these options.
    """

    newer: ClassVar[tuple[str, ...]] = ()

    @model_serializer(mode="wrap")
    def _without_newer_defaults(self, dump: SerializerFunctionWrapHandler) -> dict[str, Any]:
        values: dict[str, Any] = dump(self)
        fields = type(self).model_fields
        unchanged = {
            name for name in self.newer if getattr(self, name) == fields[name].get_default(call_default_factory=True)
        }
        return {name: value for name, value in values.items() if name not in unchanged}


def _refuse_conversion(came: object, made: object) -> None:
    """Refuse a number or bool that was made of something else; ints are floats, and lists are tuples."""
    if isinstance(made, tuple) and isinstance(came, (list, tuple)):
        for came_item, made_item in zip(came, made, strict=False):
            _refuse_conversion(came_item, made_item)
    elif isinstance(made, bool) and isinstance(came, (str, int, float)) and not isinstance(came, bool):
        raise ConfigError(f"expected true or false, got {_short(came)}")
    elif isinstance(made, (int, float)) and isinstance(came, (str, bool)) and not isinstance(made, bool):
        raise ConfigError(f"expected a number, got {_short(came)}")


def _first_problem(error: ValidationError, settings: type[Settings], values: Mapping[str, Any]) -> tuple[str, str]:
    """Return the option that the first problem of a validation error is about, and the problem in words."""
    problems = error.errors(include_url=False)
    first = problems[0]
    key = ".".join(_place(first["loc"], values))
    if first["type"] == "extra_forbidden":
        return "", _unknown_key(first, settings)
    if first["type"] == "missing" and isinstance(first["loc"][-1], int):
        return key.rpartition(".")[0], f"expected {_entries(problems)} entries, got {_short(first['input'])}"
    if first["type"] == "missing":
        return "", f"missing key {key!r}"
    inner = first.get("ctx", {}).get("error")
    if isinstance(inner, OptionError):
        return ".".join(part for part in (key, inner.key) if part), inner.problem
    if isinstance(inner, ValueError):
        return key, str(inner)
    return key, f"expected {_expected(first)}, got {_short(first['input'])}"


def _place(loc: tuple[int | str, ...], values: object) -> Iterator[str]:
    """Yield the keys that lead to a problem, without those that name a type of a union: no value has such a key."""
    for part in loc:
        if isinstance(part, str) and isinstance(values, str | int | float | list | tuple):
            continue
        yield str(part)
        try:
            values = values[part]  # type: ignore[index]
        except (TypeError, LookupError):
            values = None


def _entries(problems: list[ErrorDetails]) -> int:
    """Return the length of a tuple of which the first problem says that an entry is missing."""
    of_it = (one["loc"] for one in problems if one["loc"][:-1] == problems[0]["loc"][:-1])
    return 1 + max(int(loc[-1]) for loc in of_it)


def _expected(problem: ErrorDetails) -> str:
    """Say in words what an option has to be."""
    if problem["type"] in LENGTHS:
        words, limit = LENGTHS[problem["type"]]
        return f"{words} {problem['ctx'][limit]} entries"
    if problem["type"] == "string_pattern_mismatch":
        return f"a text that matches {problem['ctx']['pattern']}"
    if problem["type"] in KINDS:
        return KINDS[problem["type"]]
    return problem["msg"].removeprefix("Input should be ").removeprefix("String should have ")


def _unknown_key(first: ErrorDetails, settings: type[Settings]) -> str:
    """Name an unknown key and the nearest valid one."""
    valid = settings.option_names()
    key = ".".join(str(part) for part in first["loc"])
    last = str(first["loc"][-1])
    near = nearest_name(last, valid)
    suggested = settings.meant.get(last) or (f"did you mean {near!r}?" if near else "")
    hint = f"; {suggested}" if suggested else f" (expected one of: {', '.join(sorted(valid))})"
    return f"unknown key {key!r}{hint}, got {_short(first['input'])}"


def _kind(value: object) -> str:
    return "nothing" if value is None else type(value).__name__


def _short(value: object) -> str:
    text = reprlib.repr(value)  # the repr of nested YAML aliases can fill the memory
    return text if len(text) <= 80 else text[:77] + "..."
