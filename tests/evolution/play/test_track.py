"""The track: batches of runs that stream, and that a newer batch ends."""

from __future__ import annotations

import os
import threading
import time

import pytest

from evolution.driving import JobPlan, Resources, run_job
from evolution.play.newest import Newest
from evolution.play.streaming import CancelledError
from evolution.play.track import Track, ignore
from tests.evolution.play.fake_runs import count, go_on, hang


def always():
    return True


def run_cancelled(track, function, jobs, on_message=ignore):
    with pytest.raises(CancelledError):
        track.run(function, jobs, always, on_message)


@pytest.fixture
def track():
    made = Track(Resources(workers=2).evaluator(run_job, retries=0))
    yield made
    made.close()


@pytest.fixture(scope="module")
def jobs(given, room):
    from evolution.play.plans import own_settings
    from tests.evolution.play.conftest import WORLD

    return JobPlan(given.controllers, own_settings(WORLD, given)).jobs(room)


def test_every_message_comes_before_the_result(track, jobs):
    seen = []
    track.run(
        count,
        jobs,
        always,
        lambda job, part: seen.append((job, part.first)),
        lambda job, _: seen.append((job, -1)),
    )
    for job in jobs:
        assert [number for one, number in seen if one is job] == [0, 1, 2, -1]


def test_a_new_batch_ends_the_one_under_way(track, jobs):
    errors, begun = [], threading.Event()

    def run():
        try:
            track.run(go_on, jobs, always, lambda _job, _part: begun.set())
        except CancelledError as error:
            errors.append(str(error))

    thread = threading.Thread(target=run)
    thread.start()
    begun.wait(30.0)
    results = track.run(count, jobs, always)
    thread.join()
    assert errors == ["the run was cancelled"]
    assert [result.outcome for result in results] == ["goal"] * len(jobs)


def test_a_cancelled_run_leaves_its_worker_alive(track, jobs, monkeypatch):
    monkeypatch.setattr("evolution.play.track.END_SECONDS", 30.0)
    before, begun = track.run(count, jobs, always), threading.Event()
    thread = threading.Thread(target=run_cancelled, args=(track, go_on, jobs, lambda _job, _part: begun.set()))
    thread.start()
    assert begun.wait(30.0)
    after = track.run(count, jobs, always)
    thread.join()
    assert {result.reason for result in after} <= {result.reason for result in before}


def test_a_run_that_does_not_end_is_killed(track, jobs):
    thread = threading.Thread(target=run_cancelled, args=(track, hang, jobs[:1]))
    thread.start()
    time.sleep(0.5)
    (result,) = track.run(count, jobs[:1], always)
    thread.join()
    assert result.success


def test_a_batch_that_is_not_wanted_any_more_does_not_begin(track, jobs):
    with pytest.raises(CancelledError):
        track.run(count, jobs, lambda: False)


def test_no_worker_is_left_when_a_track_is_closed(jobs):
    track = Track(Resources(workers=2).evaluator(run_job, retries=0))
    workers = {int(result.reason) for result in track.run(count, jobs, always)}
    track.close()
    for worker in workers:
        with pytest.raises(ProcessLookupError):
            os.kill(worker, 0)


def test_only_the_newest_task_waits():
    place = Newest()
    for number in range(1000):
        place.put(number)
    assert place.take() == 999
    assert place.is_empty()


def test_a_closed_place_gives_nothing():
    place = Newest()
    place.put(1)
    place.close()
    assert place.take() is None
