"""Desk: takes the requests of all pages; the newest request ends what is under way."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from functools import partial

from evolution.play.drives import Driven, Send, drive, prepared
from evolution.play.instants import instant_message, look
from evolution.play.messages import AskInstant, AskSearch, AskWhy, Cancel, Drive, Error, Request
from evolution.play.newest import Newest
from evolution.play.plans import Given
from evolution.play.searches import search, why
from evolution.play.streaming import CancelledError
from evolution.play.track import Track
from gym_mapbench.errors import ConfigError, MapBenchError, RunError

LOG = logging.getLogger(__name__)
Task = tuple[Request, Send]


class Desk:
    """Works on the newest request in the background, and on instants beside it.

    Args:
        given: What the command line gives.
        runs: Runs what is driven and searched.
        looks: Runs what shows an instant.
    """

    def __init__(self, given: Given, runs: Track, looks: Track) -> None:
        self._given, self._runs, self._looks = given, runs, looks
        self._driven: Driven | None = None
        self._work, self._instants = Newest[Task](), Newest[Task]()
        self._threads = [
            threading.Thread(target=self._serve, args=(place, answer), daemon=True)
            for place, answer in ((self._work, self._do), (self._instants, self._show))
        ]
        for thread in self._threads:
            thread.start()

    def submit(self, request: Request, send: Send) -> None:
        """Begin to work on a request.

        Args:
            request: What the page asks for; a ``cancel`` ends what is under way.
            send: Takes the replies, in a thread.
        """
        if isinstance(request, AskInstant):
            self._instants.put((request, send))
            self._looks.cancel()
            return
        self._work.put(None if isinstance(request, Cancel) else (request, send))
        self._runs.cancel()

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
            request, send = task
            try:
                answer(request, send)
            except CancelledError:
                continue
            except MapBenchError as error:
                send(Error(id=getattr(request, "id", None), message=str(error)))
            except Exception as error:
                LOG.exception("the playground failed")
                send(Error(id=getattr(request, "id", None), message=f"{type(error).__name__}: {error}"))

    def _do(self, request: Request, send: Send) -> None:
        if isinstance(request, Drive):
            self._driven = None
            self._driven = prepared(request, self._given)
            drive(self._driven, self._given, self._runs, self._work.is_empty, send)
        elif isinstance(request, AskSearch):
            search(self._last(request.id), request, self._runs, self._work.is_empty, send)
        elif isinstance(request, AskWhy):
            why(self._last(request.id), request, self._runs, self._work.is_empty, send)

    def _show(self, request: Request, send: Send) -> None:
        """Show an instant of a run of the last drive."""
        if isinstance(request, AskInstant):
            job = self._last(request.id).job(request.variant, request.repeat)
            answer = partial(instant_message, request.id, request.variant, request.repeat)
            function = partial(look, (request.time,))
            (result,) = self._looks.run(
                function, [job], self._instants.is_empty, lambda _job, fields: send(answer(fields))
            )
            if result.outcome == "error":
                raise RunError(result.reason)

    def _last(self, number: int) -> Driven:
        """Return the last drive, which must have a number.

        Raises:
            ConfigError: If the last drive has another one.
        """
        driven = self._driven
        if driven is None or driven.request.id != number:
            raise ConfigError(f"id: expected that of the last drive, got {number}")
        return driven
