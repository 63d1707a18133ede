"""The short version of the campaign: some inputs of every kind, one kill of every kind, and four faulty controllers."""

from __future__ import annotations

from collections import Counter

import pytest

from evolution.driving.evaluator import RUN_TIMEOUT_SECONDS
from tests.evolution.processes import PATIENCE
from tests.faults import inputs, kills, workers
from tests.faults.__main__ import WANTED, table


@pytest.mark.parametrize("kind", inputs.SETTINGS)
def test_damaged_files_are_read_or_refused_in_one_line(kind, tmp_path, monkeypatch):
    for limit in ("SLOW", "HANG_SECONDS"):  # kernels may have to be compiled first
        monkeypatch.setattr(inputs, limit, PATIENCE)
    for seed in range(40):
        end = inputs.try_one(tmp_path, kind, seed)
        assert end.how in WANTED, (seed, end)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Where the searches of this file are."""
    return tmp_path_factory.mktemp("searches")


@pytest.mark.slow
@pytest.mark.parametrize("kind", kills.KINDS[:-1])
def test_what_was_stopped_is_continued_to_the_same_bytes(kind, folder):
    end = kills.try_one(folder, kind, seed=1)
    assert end.how in ("same bytes", "was too late"), end


def test_the_table_tells_right_from_wrong():
    counts = {"run": Counter({"refused": 3, "accepted": 1}), "model": Counter({"refused": 1, "traceback": 2})}
    assert table(counts).splitlines()[2:] == [
        "| run | 4 | 4 (3 refused, 1 accepted) | none |",
        "| model | 3 | 1 (1 refused) | 2 traceback |",
    ]


@pytest.mark.parametrize(
    "kind", ["recurses_with_memory", "writes_garbage", "speaks_to_the_terminal", "answers_too_much"]
)
def test_a_controller_that_misbehaves_costs_no_other_run(kind, monkeypatch):
    monkeypatch.setattr(workers, "TIMEOUT_SECONDS", RUN_TIMEOUT_SECONDS)
    assert workers.try_one(kind, seed=0).how == "no other run lost"
