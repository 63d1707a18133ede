"""Templates: placeholders that a launch file fills in, such as ``<min_x>`` or ``$(find-pkg-share package)``."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

from gym_mapbench.errors import ConfigError, unknown_name

FORMS = (
    r"<(?P<a>[A-Za-z_]\w*)>",
    r"\$\([\w-]+\s+(?P<b>[^()\s]+)\)",
    r"\$\{(?P<c>[A-Za-z_]\w*)\}",
    r"\{\{\s*(?P<d>[A-Za-z_]\w*)\s*\}\}",
    r"@(?P<e>[A-Za-z_]\w*)@",
)
TEMPLATE = re.compile("|".join(FORMS))
PLACEHOLDER = re.compile(r"\b[A-Z][A-Z0-9]*_[A-Z0-9_]+\b")
"""Words that nav2_bringup's launch files replace, such as ``KEEPOUT_ZONE_ENABLED``; templates only if given a value."""
COMMENT = re.compile(r"(^|\s)#.*")


class Template(NamedTuple):
    """One template: how it is written, and its name."""

    text: str
    name: str


def find_template(value: object) -> Template | None:
    """Return the first template in a text or in the texts of a list; None if there is none."""
    if isinstance(value, str):
        return next(_templates(value), None)
    if isinstance(value, (list, tuple)):
        return next(filter(None, map(find_template, value)), None)
    return None


def no_value(where: str, template: Template) -> ConfigError:
    """Build the error for a template that has no value."""
    return ConfigError(
        f"{where}: the template {template.text} has no value; give it one with --define {template.name}=VALUE"
    )


def fill_templates(text: str, defines: Mapping[str, str]) -> str:
    """Replace templates by their values; templates without a value stay.

    Args:
        text: A whole parameter file.
        defines: Name of a template -> its value.

    Raises:
        ConfigError: If the text has no template of one of the names; the error gives the nearest name.
    """
    known = template_names(text)
    for name in defines:
        if name not in known:
            names = {template.name for template in _templates(_code(text))}
            unknown = ConfigError(f"--define {name}: the file has no templates")
            raise unknown_name("template", name, names) if names else unknown
    text = TEMPLATE.sub(lambda match: defines.get(_name(match), match[0]), text)
    return PLACEHOLDER.sub(lambda match: defines.get(match[0], match[0]), text)


def template_names(text: str) -> set[str]:
    """Return the names of the templates of a parameter file, and the words that a value would make templates."""
    code = _code(text)
    return {template.name for template in _templates(code)} | set(PLACEHOLDER.findall(code))


def _code(text: str) -> str:
    """Return a parameter file without its comments."""
    return "\n".join(COMMENT.sub("", line) for line in text.splitlines())


def parse_defines(options: Sequence[str]) -> dict[str, str]:
    """Read options of the form ``name=value``, one for each template.

    Raises:
        ConfigError: If an option is not of this form, or a name comes twice.
    """
    defines: dict[str, str] = {}
    for option in options:
        name, equals, value = option.partition("=")
        if not name or not equals or not value.isprintable():
            raise ConfigError(f"--define: expected NAME=VALUE in one line, got {option!r}")
        if name in defines:
            raise ConfigError(f"--define: expected one value for {name}, got {defines[name]!r} and {value!r}")
        defines[name] = value
    return defines


def first_unreadable(text: str) -> tuple[int, Template] | None:
    """Return the first template that YAML cannot hold without quotes, with its line number; None if there is none."""
    for number, line in enumerate(text.splitlines(), 1):
        for template in _templates(COMMENT.sub("", line)):
            if template.text.startswith(("{{", "@")):
                return number, template
    return None


def _templates(text: str) -> Iterator[Template]:
    return (Template(match[0], _name(match)) for match in TEMPLATE.finditer(text))


def _name(match: re.Match[str]) -> str:
    return next(name for name in match.groups() if name is not None)
