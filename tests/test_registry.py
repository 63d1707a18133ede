"""Names: where they are looked for, and the one line that says what is wrong with them."""

from __future__ import annotations

import sys
from importlib.metadata import EntryPoint

import pytest

from gym_mapbench import registry
from gym_mapbench.errors import ConfigError, PluginError, unknown_name
from gym_mapbench.registry import Registry, must_be, must_be_callable

HERE = "tests.test_registry"


def answer():
    return 42


class Box:
    inside = 7


@pytest.fixture
def numbers(monkeypatch):
    points = [EntryPoint("seven", f"{HERE}:Box.inside", ""), EntryPoint("gone", f"{HERE}:nothing", "")]
    monkeypatch.setattr(registry, "entry_points", lambda group: points if group == "gym_mapbench.numbers" else [])
    return Registry("number", "numbers", {"one": 1, "two": 2}, check=must_be(int))


def test_every_kind_of_name(numbers):
    numbers.register("three", 3)
    assert [numbers.get(name) for name in ("one", "three", "seven", f"{HERE}:Box.inside")] == [1, 3, 7, 7]
    assert numbers.built_in == ("one", "two")
    assert numbers.names() == tuple(numbers) == ("gone", "one", "seven", "three", "two")
    assert numbers.added() == ("gone", "seven", "three")
    assert "seven" in numbers
    assert "four" not in numbers


def test_a_name_of_two_packages_is_refused(monkeypatch):
    """Which of them is meant depends on the order in which Python finds the packages."""
    values = {"own": ["a:x", "b:y"], "twice": [f"{HERE}:Box.inside"] * 2}
    points = [EntryPoint(name, value, "") for name, some in values.items() for value in some]
    monkeypatch.setattr(registry, "entry_points", lambda group: points)
    numbers = Registry("number", "numbers", {"one": 1})
    assert numbers["twice"] == 7
    with pytest.raises(
        ConfigError, match="number 'own': expected one installed package with this name, got a:x and b:y"
    ):
        numbers.get("own")


def test_decorator_gives_back_what_it_registers():
    functions = Registry("function", "functions", {}, check=must_be_callable)

    @functions.register("mine")
    def mine():
        return 5

    assert mine() == functions["mine"]() == 5


def test_a_cell_may_be_run_twice_but_built_in_names_stay(numbers):
    numbers.register("three", 3)
    numbers.register("three", 33)
    assert numbers["three"] == 33
    for name in ("one", "a:b"):
        with pytest.raises(ConfigError, match=f"number '{name}': expected a new name without ':'"):
            numbers.register(name, 4)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("oen", "unknown number 'oen'; did you mean 'one'? (expected one of: gone, one, other, seven, two)"),
        ("gone", f"number 'gone': {HERE}:nothing cannot be loaded ({HERE} has no 'nothing')"),
        (f"{HERE}:answr", f"number '{HERE}:answr' cannot be loaded ({HERE} has no 'answr'; did you mean 'answer'?)"),
        (f"{HERE}:answer", f"number '{HERE}:answer': expected int, got function"),
        ("no.such:thing", "number 'no.such:thing' cannot be loaded (ModuleNotFoundError: No module named 'no')"),
    ],
)
def test_refusals(numbers, name, message):
    with pytest.raises(ConfigError) as refused:
        numbers.get(name, others=["other"])
    assert str(refused.value) == message


def test_an_error_with_the_nearest_name_does_not_list_a_hundred_others():
    names = [f"weight_{n}" for n in range(100)]
    assert str(unknown_name("parameter", "weihgt_7", names)) == "unknown parameter 'weihgt_7'; did you mean 'weight_7'?"
    assert str(unknown_name("parameter", "xyz", names)).startswith(
        "unknown parameter 'xyz' (expected one of: weight_0,"
    )


def test_modules_come_from_the_current_directory_too(numbers, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [path for path in sys.path if path != ""])
    (tmp_path / "beside_me.py").write_text("many = 99\n")
    assert numbers.get("beside_me:many") == 99
    (tmp_path / "broken_beside_me.py").write_text("many = 1\nmany += other\n")
    with pytest.raises(ConfigError, match=r"NameError: name 'other' is not defined, broken_beside_me.py line 2\)$"):
        numbers.get("broken_beside_me:many")
    (tmp_path / "leaving_me.py").write_text("raise SystemExit(3)\n")
    with pytest.raises(ConfigError, match="SystemExit: 3"):
        numbers.get("leaving_me:many")


def test_what_workers_cannot_know_is_refused_before(numbers):
    numbers.register("three", 3)
    for name in ("one", "seven", f"{HERE}:Box.inside"):
        assert numbers.for_workers(name) == name
    with pytest.raises(ConfigError, match=r"number 'three': is registered in this process alone; .* module:attribute"):
        numbers.for_workers("three")
    with pytest.raises(ConfigError, match=r"number '__main__:three': is defined in this script or notebook alone; .*"):
        numbers.for_workers("__main__:three")


def test_a_decorator_without_a_name_is_refused(numbers):
    with pytest.raises(ConfigError, match=r"^number: expected register\(NAME, ENTRY\) or @register\(NAME\), got <f"):

        @numbers.register
        def mine():
            """Count nothing."""


def test_an_error_that_cannot_say_what_it_is_costs_its_text_alone(numbers, caplog):
    class Mute(Exception):
        def __str__(self):
            raise ValueError

    numbers.register("three", 3)
    caplog.set_level("INFO")
    with pytest.raises(PluginError, match=r"^number 'three': Mute, test_registry.py line"), numbers.blamed("three"):
        raise Mute
    assert "Traceback (most recent call last)" in caplog.text


def test_blame_is_for_third_parties_only(numbers):
    numbers.register("three", 3)
    said = pytest.raises(PluginError, match=r"^number 'three': ValueError: .*, test_registry.py line \d+$")
    with said, numbers.blamed("three"):
        int("three")
    with pytest.raises(PluginError, match=r"^number 'three': KeyError, test_registry.py line"), numbers.blamed("three"):
        raise KeyError
    with pytest.raises(ValueError, match="invalid literal"), numbers.blamed("one"):
        int("one")
    with pytest.raises(ConfigError, match=r"^as it was$"), numbers.blamed("three"):
        raise ConfigError("as it was")
