"""Messages of the page: every one is read or refused in one line."""

from __future__ import annotations

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from evolution.play.messages.requests import MAX_TEXT, REQUESTS, Cancel, WorldSettings, read_request
from gym_mapbench.errors import ConfigError

VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=20),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=10), inner, max_size=3),
    max_leaves=8,
)


def test_cancel_is_read():
    assert read_request('{"type": "cancel"}') == Cancel()


@given(
    st.text(max_size=50)
    | st.dictionaries(st.sampled_from(["type", "id", "scene", "runs", "goal", "time"]), VALUES).map(json.dumps)
    | st.tuples(st.sampled_from(sorted(REQUESTS)), st.dictionaries(st.text(max_size=8), VALUES, max_size=4)).map(
        lambda pair: json.dumps({"type": pair[0], **pair[1]})
    )
)
def test_anything_is_read_or_refused_in_one_line(text):
    try:
        answer = read_request(text).type
    except ConfigError as error:
        answer = str(error)
    assert "\n" not in answer


@pytest.mark.parametrize(
    ("message", "problem"),
    [
        ({"type": "fly"}, "unknown type of message 'fly'"),
        ({"type": "instant", "id": 1, "variant": "os:system", "time": 0}, "variant"),
        ({"type": "instant", "id": 1, "variant": "dwb", "time": -1}, "time: expected greater than or equal to 0"),
        ({"type": "instant", "id": 1, "variant": "dwb", "time": "1"}, "time: expected a number"),
        ({"type": "search", "id": 1, "goal": "harder", "runs": 10**6}, "runs: expected less than or equal to 600"),
        ({"type": "search", "id": 1, "goal": "harder", "module": "x:y"}, "unknown key 'module'"),
    ],
)
def test_bad_values_name_what_was_expected(message, problem):
    with pytest.raises(ConfigError, match=problem):
        read_request(json.dumps(message))


def test_seeds_that_a_page_would_round_are_refused():
    document = {"preset": "thesis", "seed": 2**53 - 1}
    assert json.loads(WorldSettings.from_mapping(document, "world").model_dump_json())["seed"] == 2**53 - 1
    with pytest.raises(ConfigError, match="seed: expected less than"):
        WorldSettings.from_mapping({**document, "seed": 2**53}, "world")


def test_a_long_message_is_not_parsed():
    with pytest.raises(ConfigError, match="at most"):
        read_request("[" * (MAX_TEXT + 1))
