from __future__ import annotations

import json
import pickle
from typing import Annotated

import numpy as np
import pytest
from pydantic import Field

from gym_mapbench.errors import ConfigError, nearest_name
from gym_mapbench.files.documents import MAX_YAML_BYTES, read_yaml
from gym_mapbench.settings import Settings


class Inner(Settings):
    depth: int = 1


class Outer(Settings):
    width: float = 1.0
    inner: Inner = Inner()


class Way(Settings):
    points: Annotated[tuple[float, ...], Field(min_length=2)]


def test_a_list_that_is_too_short_is_said_in_words():
    with pytest.raises(ConfigError, match=r"^points: expected at least 2 entries, got \[1.0\]"):
        Way(points=[1.0])


class Either(Settings):
    value: list[list[float] | int]


@pytest.mark.parametrize(
    ("value", "message"),
    [(["b"], "value.0: expected"), ([1, [2, "b"]], "value.1.1: expected"), ([[float("nan")]], "value.0.0: expected a")],
)
def test_the_types_of_a_union_are_no_keys(value, message):
    with pytest.raises(ConfigError) as caught:
        Either(value=value)
    assert str(caught.value).startswith(message)


def test_a_text_in_place_of_a_list_is_told_so_in_the_words_of_files():
    with pytest.raises(ConfigError, match=r"^points: expected a list, got '1, 2'$"):
        Way(points="1, 2")


def test_settings_are_values():
    outer = Outer(width=2, inner={"depth": 3})
    assert outer == Outer(width=2.0, inner=Inner(depth=3))
    assert hash(outer) == hash(pickle.loads(pickle.dumps(outer)))
    assert Outer(**json.loads(json.dumps(outer.model_dump(mode="json")))) == outer
    assert outer.replace(width=4).inner == Inner(depth=3)
    with pytest.raises(ValueError, match="frozen"):
        outer.width = 3


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"wdith": 1}, r"^unknown key 'wdith'; did you mean 'width'\?, got 1$"),
        ({"dpeht": 1}, r"^unknown key 'dpeht' \(expected one of: inner, width\), got 1$"),
        ({"zzz": 1}, r"^unknown key 'zzz' \(expected one of: inner, width\), got 1$"),
        ({"width": "wide"}, r"^width: expected a valid number.*, got 'wide'$"),
        ({"width": float("nan")}, r"^width: expected a finite number, got nan$"),
        ({"inner": {"dept": 2}}, r"^inner: unknown key 'dept'; did you mean 'depth'\?, got 2$"),
        ({"inner": {"depth": 1.5}}, r"^inner.depth: expected a valid integer.*, got 1.5$"),
        ({"inner": 3}, r"^inner: expected a mapping of options, got 3$"),
    ],
)
def test_errors_name_the_key_what_was_expected_and_what_came(values, message):
    with pytest.raises(ConfigError, match=message) as caught:
        Outer(**values)
    assert "\n" not in str(caught.value)


class Named(Settings):
    name: str
    inner: Inner


def test_a_missing_key_is_called_so():
    with pytest.raises(ConfigError, match=r"^missing key 'name'$"):
        Named(inner={})
    with pytest.raises(ConfigError, match=r"^file\.yaml: missing key 'inner'$"):
        Named.from_mapping({"name": "a"}, "file.yaml")


KEYS = ("robot", "shapes", "start", "time_limit", "turtlebot3_burger", "goal_ends_episode")


@pytest.mark.parametrize("name", ["foo", "bar", "speed", "x", ""])
def test_nonsense_is_like_nothing(name):
    assert nearest_name(name, KEYS) is None


@pytest.mark.parametrize(
    ("name", "near"),
    [("time_limt", "time_limit"), ("limit_time", "time_limit"), ("limit", "time_limit"), ("burger", KEYS[4])],
)
def test_slips_and_parts_of_a_name_are_recognised(name, near):
    assert nearest_name(name, KEYS) == near


class Typed(Settings):
    speed: float = 0.0
    axes: tuple[float, float] = (0.0, 0.0)
    count: int = 0
    reverse: bool = False


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"speed": True}, "speed: expected a number, got True"),
        ({"speed": "0.4"}, "speed: expected a number, got '0.4'"),
        ({"count": False}, "count: expected a number, got False"),
        ({"count": "3"}, "count: expected a number, got '3'"),
        ({"axes": [1, "2"]}, "axes: expected a number, got '2'"),
        ({"reverse": "yes"}, "reverse: expected true or false, got 'yes'"),
        ({"reverse": 1}, "reverse: expected true or false, got 1"),
        ({"reverse": 0.0}, "reverse: expected true or false, got 0.0"),
    ],
)
def test_what_ros_would_not_convert_is_refused(values, message):
    with pytest.raises(ConfigError) as caught:
        Typed(**values)
    assert str(caught.value) == message


def test_numbers_of_every_kind_and_lists_are_taken():
    typed = Typed(speed=1, axes=[np.float32(0.5), np.int64(2)], count=np.int64(3), reverse=True)
    assert typed == Typed(speed=1.0, axes=(0.5, 2.0), count=3, reverse=True)
    assert Typed(speed=np.float64(0.5), count=3.0) == Typed(speed=0.5, count=3)


def test_numbers_in_yaml_need_no_dot(tmp_path):
    path = tmp_path / "a.yaml"
    path.write_text("[1e-3, -2E2, 1.e+2, .5e1, '1e3', 1e, e5, 3]")
    assert read_yaml(path) == [1e-3, -200.0, 100.0, 5.0, "1e3", "1e", "e5", 3]


def test_long_values_are_cut_short():
    with pytest.raises(ConfigError) as caught:
        Outer(width="x" * 10_000)
    assert len(str(caught.value)) < 200


def test_mappings_say_where_they_come_from():
    assert Outer.from_mapping({"width": 3}, "file.yaml").width == 3
    with pytest.raises(ConfigError, match=r"^file\.yaml: unknown key 'widht'"):
        Outer.from_mapping({"widht": 3}, "file.yaml")
    with pytest.raises(ConfigError, match=r"^file\.yaml: expected a mapping of options, got list"):
        Outer.from_mapping([1], "file.yaml")
    with pytest.raises(ConfigError, match=r"^file\.yaml: expected a mapping of options, got nothing"):
        Outer.from_mapping(None, "file.yaml")


def test_yaml_files(tmp_path):
    path = tmp_path / "a.yaml"
    path.write_text("width: 2\n")
    assert read_yaml(path) == {"width": 2}
    path.write_text("width: [1\n")
    with pytest.raises(ConfigError, match=r"a\.yaml: not a YAML file"):
        read_yaml(path)
    path.write_bytes(b"\xff\xfe\x00width")
    with pytest.raises(ConfigError, match=r"a\.yaml: line 1: expected text in UTF-8, got the byte 0x"):
        read_yaml(path)
    path.write_text("!!python/object/apply:os.getcwd []\n")
    with pytest.raises(ConfigError, match=r"a\.yaml: not a YAML file"):
        read_yaml(path)
    path.write_text("#" * (MAX_YAML_BYTES + 1))
    with pytest.raises(ConfigError, match="at most"):
        read_yaml(path)
    with pytest.raises(ConfigError, match="cannot be read"):
        read_yaml(tmp_path / "none.yaml")
