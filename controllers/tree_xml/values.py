"""Values of ports: what their texts mean."""

from __future__ import annotations

import math
import re
from typing import Any

from controllers.tree_xml.nodes import Above, Key, Name, Number, Port, Required, Switch, Text, Variable
from controllers.tree_xml.scopes import SWITCHES, Constants, Scope, is_variable
from gym_mapbench.errors import ConfigError


def value_of(key: str, port: Port, text: str | None, scope: Scope, constants: Constants) -> Any:
    """Return the value of a port: that of its text, or its default.

    Args:
        key: The name of the port.
        port: The port.
        text: The text that the file gives; None for none.
        scope: The variables around the node.
        constants: The variables whose texts are known.

    Raises:
        ConfigError: If the text is no value of the port.
    """
    if isinstance(port, Variable):
        name = key if text == "{=}" else _variable(text)
        return scope.variable(name or port.default) if name or port.default else ""
    if isinstance(port, Name):
        return port.default if text is None else _name(text, scope, constants)
    if isinstance(port, Key | Text):
        return scope.variable(_plain(text)) if isinstance(port, Key) else _plain(text)
    if text is not None and is_variable(text):
        text = constants.number(scope.variable(text[1:-1]))
    return _number_or_switch(port, text)


def _number_or_switch(port: Number | Above | Required | Switch, text: str | None) -> float:
    """Return the value of a port without variables; a switch is a number, too."""
    if isinstance(port, Required):
        return _required(port, text)
    if text is None:
        return port.default
    return _switch(text) if isinstance(port, Switch) else _number(port, text)


def _variable(text: str | None) -> str | None:
    """Return the name of a variable, None for none."""
    if text is None:
        return None
    if not is_variable(text):
        raise ConfigError(f"expected a variable such as {{path}}, got {text!r}")
    return text[1:-1]


def _name(text: str, scope: Scope, constants: Constants) -> str:
    """Return a name, or the variable of the whole tree that will hold it, in braces."""
    if not text.startswith("{"):
        return text
    variable = scope.variable(_variable(text) or "")
    known = constants.text(variable)
    return f"{{{variable}}}" if known is None else known


def _plain(text: str | None) -> str:
    """Return a text that has to be given, without a variable in its place."""
    if not text or is_variable(text):
        raise ConfigError(f"expected a text without braces, got {text or 'none'}")
    return text


def _switch(text: str) -> bool:
    if text.lower() not in SWITCHES:
        raise ConfigError(f"expected true or false, got {text!r}")
    return SWITCHES[text.lower()]


def _required(port: Required, text: str | None) -> float:
    if text is None or not re.fullmatch(port.pattern, text.strip()):
        raise ConfigError(f"expected {port.expected}, got {text or 'none'}")
    return port.value_of(text)


def _number(port: Number | Above, text: str) -> float:
    """Return the number in a text, a whole one if the port's default is."""
    of = int if isinstance(port.default, int) else float
    try:
        value = of(text)
    except ValueError:
        raise ConfigError(f"expected a {'whole ' if of is int else ''}number, got {text!r}") from None
    if not abs(value) < math.inf and value != port.default:
        raise ConfigError(f"expected a finite number, got {text}")
    if isinstance(port, Above) and value <= 0.0:
        raise ConfigError(f"expected a number above 0, got {text}")
    if isinstance(port, Number) and value < port.least:
        raise ConfigError(f"expected {port.least:g} or more, got {text}")
    return value
