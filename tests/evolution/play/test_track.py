"""The track: batches of runs that stream, and that a newer batch ends."""

from __future__ import annotations

import threading
import time
from contextlib import contextmanager

import pytest

from evolution.driving import JobPlan, Resources, run_job
from evolution.play.newest import Newest
from evolution.play.streaming import CancelledError
from evolution.play.track import Track
from gym_mapbench.errors import ConfigError
from tests.evolution.play.fake_runs import count, go_on, hang
from tests.evolution.processes import PATIENCE, is_gone


@contextmanager
def under_way(track, function, jobs):
    """Let a batch be under way, which must be cancelled within the block."""
    begun, errors = threading.Event(), []

    def run():
        try:
            track.run(function, jobs, lambda _job, _part: begun.set())
        except CancelledError as error:
            errors.append(str(error))

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    assert begun.wait(PATIENCE)
    yield
    thread.join(PATIENCE)
    assert errors == ["the run was cancelled"]


@pytest.fixture
def track():
    made = Track(Resources(workers=2).evaluator(run_job, retries=0))
    yield made
    made.close()


@pytest.fixture(scope="module")
def jobs(given, room):
    from evolution.play.worlds import PageWorld
    from tests.evolution.play.conftest import WORLD

    return JobPlan(given.controllers, PageWorld(WORLD, given).own_settings).jobs(room)


def test_every_message_comes_before_the_result_however_slowly_it_is_read(track, jobs, monkeypatch):
    monkeypatch.setattr("evolution.play.track.END_SECONDS", 0.01)
    seen = []

    def read(job, part):
        time.sleep(0.05)
        seen.append((job, part.first))

    track.run(count, jobs, read, lambda job, _: seen.append((job, -1)))
    for job in jobs:
        assert [number for one, number in seen if one is job] == [0, 1, 2, -1]


def test_a_new_batch_ends_the_one_under_way(track, jobs):
    with under_way(track, go_on, jobs):
        results = track.run(count, jobs)
    assert [result.outcome for result in results] == ["goal"] * len(jobs)


def test_a_cancelled_run_leaves_its_worker_alive(jobs, monkeypatch):
    monkeypatch.setattr("evolution.play.track.END_SECONDS", PATIENCE)
    track = Track(Resources(workers=1).evaluator(run_job, retries=0))
    before = track.run(count, jobs)
    with under_way(track, go_on, jobs):
        after = track.run(count, jobs)
    track.close()
    assert len({result.reason for result in (*before, *after)}) == 1


def test_a_run_that_does_not_end_is_killed(track, jobs):
    """Also where whoever asked for it waits for its end, and asks for nothing else before that."""
    with under_way(track, hang, jobs):
        track.cancel()
    (result,) = track.run(count, jobs[:1])
    assert result.success


def test_a_batch_that_is_not_wanted_any_more_does_not_begin(track, jobs):
    with pytest.raises(CancelledError):
        track.run(count, jobs, wanted=lambda: False)


def test_no_worker_is_left_when_a_track_is_closed(jobs):
    track = Track(Resources(workers=2).evaluator(run_job, retries=0))
    workers = {int(result.reason) for result in track.run(count, jobs)}
    track.close()
    assert all(is_gone(worker) for worker in workers)


def test_a_folder_whose_path_is_too_long_for_a_socket_is_one_line(tmp_path, monkeypatch):
    monkeypatch.setattr("multiprocessing.util.get_temp_dir", lambda: str(tmp_path / ("x" * 100)))
    with pytest.raises(ConfigError, match="set TMPDIR to another folder with a short path"):
        Track(Resources(workers=1).evaluator(run_job))


def test_only_the_newest_task_waits():
    place = Newest()
    for number in range(1000):
        place.put(number, int)
    assert place.take() == 999
    assert place.is_empty()


def test_a_task_is_not_taken_before_the_work_on_the_former_is_ended():
    """The end of the former work would otherwise be that of the new one, and its page would wait for ever."""
    place, taken = Newest(), []
    thread = threading.Thread(target=lambda: taken.append(place.take()))
    thread.start()
    before = []
    place.put(1, lambda: (thread.join(0.1), before.extend(taken)))
    thread.join()
    assert (before, taken) == ([], [1])


def test_a_closed_place_gives_nothing():
    place = Newest()
    place.put(1, int)
    place.close()
    assert place.take() is None
