"""Desk: takes the requests of all pages; the newest request ends what is under way."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from evolution.play.drives import Driven, Send, drive, prepared
from evolution.play.instants import look
from evolution.play.messages.replies import Error, Instant
from evolution.play.messages.requests import AskInstant, AskSearch, AskWhy, Cancel, Drive, Request
from evolution.play.newest import Newest
from evolution.play.searches import search, why
from evolution.play.streaming import CancelledError
from evolution.play.track import Track
from evolution.play.worlds import Given
from gym_mapbench.errors import ConfigError, MapBenchError, RunError

LOG = logging.getLogger(__name__)
TAKEN = "another page of this playground has begun to run; change something here to run this map again"


@dataclass
class Task:
    """A request of a page.

    Args:
        request: What the page asks for.
        send: Takes the replies, in a thread; each page has its own.
        done: Whether the work on it has ended.
    """

    request: Request
    send: Send
    done: bool = False


class Desk:
    """Works on the newest request in the background, and on instants beside it.

    Args:
        given: What the command line gives.
        runs: Runs what is driven and searched.
        looks: Runs what shows an instant.
    """

    def __init__(self, given: Given, runs: Track, looks: Track) -> None:
        self._given, self._runs, self._looks = given, runs, looks
        self._driven: tuple[Driven, Send] | None = None
        self._newest: Task | None = None
        self._work, self._instants = Newest[Task](), Newest[Task]()
        self._threads = [
            threading.Thread(target=self._serve, args=(place, answer), daemon=True)
            for place, answer in ((self._work, self._do), (self._instants, self._show))
        ]
        for thread in self._threads:
            thread.start()

    def submit(self, request: Request, send: Send) -> None:
        """Begin to work on a request; a page hears if another page's request ends its own.

        Args:
            request: What the page asks for; a ``cancel`` ends what is under way.
            send: Takes the replies, in a thread; the same one for all requests of a page.
        """
        task = Task(request, send)
        if isinstance(request, AskInstant):
            self._instants.put(task, self._looks.cancel)
            return
        ended, self._newest = self._newest, None if isinstance(request, Cancel) else task
        self._work.put(self._newest, self._runs.cancel)
        if ended is not None and not ended.done and ended.send is not send:
            ended.send(Error(id=getattr(ended.request, "id", None), message=TAKEN))

    def close(self) -> None:
        """End everything; no worker is left."""
        for place in (self._work, self._instants):
            place.close()
        for track in (self._runs, self._looks):
            track.close()
        for thread in self._threads:
            thread.join()

    def _serve(self, place: Newest[Task], answer: Callable[[Request, Send], None]) -> None:
        """Answer requests until the place is closed; an error is a reply of one line."""
        while (task := place.take()) is not None:
            number = getattr(task.request, "id", None)
            try:
                answer(task.request, task.send)
            except CancelledError:
                continue
            except MapBenchError as error:
                task.send(Error(id=number, message=str(error)))
            except Exception as error:
                LOG.exception("the playground failed")
                task.send(Error(id=number, message=f"{type(error).__name__}: {error}"))
            finally:
                task.done = True

    def _do(self, request: Request, send: Send) -> None:
        run = partial(self._runs.run, wanted=self._work.is_empty)
        if isinstance(request, Drive):
            self._driven = None
            driven = prepared(request, self._given)
            self._driven = driven, send
            drive(driven, run, send)
        elif isinstance(request, AskSearch):
            search(self._last(request.id, send), request, run, send)
        elif isinstance(request, AskWhy):
            why(self._last(request.id, send), request, run, send)

    def _show(self, request: Request, send: Send) -> None:
        """Show an instant of a run of the last drive."""
        if isinstance(request, AskInstant):
            job = self._last(request.id, send).job(request.variant, request.repeat)
            answer = partial(Instant, id=request.id, variant=request.variant, repeat=request.repeat)
            (result,) = self._looks.run(
                partial(look, (request.time,)),
                [job],
                lambda _job, fields: send(answer(**fields)),
                wanted=self._instants.is_empty,
            )
            if result.outcome == "error":
                raise RunError(result.reason)

    def _last(self, number: int, send: Send) -> Driven:
        """Return the last drive, which must have a number and be of the page that asks.

        Raises:
            ConfigError: If the last drive is another one.
        """
        driven, owner = self._driven or (None, send)
        if driven is None or driven.request.id != number or owner is not send:
            reason = "" if owner is send else f"; {TAKEN}"
            raise ConfigError(f"id: expected that of the last drive, got {number}{reason}")
        return driven
