"""Server: listens on one address until it is told to end."""

from __future__ import annotations

import contextlib
import socket
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from evolution.driving import ControllerSpec, JobPlan, Resources, preparation_of, run_job, try_controllers
from evolution.play.catalogue import state_of
from evolution.play.exporting import export
from evolution.play.messages.requests import MAX_TEXT, Scene, WorldSettings
from evolution.play.messages.start import State
from evolution.play.track import Track
from evolution.play.worlds import Given, PageWorld
from gym_mapbench.errors import ConfigError

BACKLOG = 64
LAST_PORT = 65535
MAX_CONNECTIONS = 64
END_SECONDS = 3
"""How long open connections may take to end."""
LOOK_WORKERS = 1
"""Worker processes that show instants."""


@dataclass(frozen=True)
class Beginning:
    """What a playground begins with.

    Args:
        given: What the command line gives.
        scenes: The maps; the page begins with the first.
        world: The world.
        chosen: The controllers.
        resources: Workers and time limits.
    """

    given: Given
    scenes: Sequence[Scene]
    world: WorldSettings
    chosen: Sequence[ControllerSpec]
    resources: Resources

    def state(self) -> State:
        """Return what the page starts with.

        Raises:
            ConfigError: If a controller cannot run.
        """
        try_controllers(self.chosen, PageWorld(self.world, self.given).own_settings)
        return state_of(self.given, self.scenes, self.world, self.chosen)

    def tracks(self) -> tuple[Track, Track]:
        """Return the pools for runs and for instants; their workers load the kernels of the chosen controllers now."""
        warm_up = preparation_of([JobPlan(tuple(self.chosen), PageWorld(self.world, self.given).own_settings)])
        sizes = self.resources, self.resources.replace(workers=LOOK_WORKERS)
        runs, looks = (Track(one.evaluator(run_job, warm_up=warm_up, retries=0)) for one in sizes)
        runs.get_ready()
        looks.get_ready()
        return runs, looks


def serve(beginning: Beginning, *, host: str, port: int, on_start: Callable[[str], object]) -> None:
    """Serve the playground until Ctrl-C.

    Args:
        beginning: What it begins with.
        host: Address to listen on.
        port: Port; 0 for any that is free.
        on_start: Called with the address of the page once the server listens.

    Raises:
        ConfigError: If a package is missing, or the address cannot be used.
    """
    uvicorn = _import_uvicorn()
    from evolution.play.app import Application
    from evolution.play.desk import Desk
    from evolution.play.guard import Door

    state = beginning.state()
    with _listening(host, port) as listener:
        door = Door(host, listener.getsockname()[1])
        app = Application(beginning.given, state, Desk(beginning.given, *beginning.tracks())).behind(door)
        config = uvicorn.Config(
            app,
            log_level="warning",
            access_log=False,
            server_header=False,
            ws_max_size=MAX_TEXT,
            limit_concurrency=MAX_CONNECTIONS,
            timeout_graceful_shutdown=END_SECONDS,
        )
        on_start(door.address)
        with contextlib.suppress(KeyboardInterrupt):
            uvicorn.Server(config).run(sockets=[listener])


def export_session(beginning: Beginning, folder: Path) -> Path:
    """Run what the page would begin with, write it into a new folder as a page without a server, and return the file.

    Raises:
        ConfigError: If the folder holds something, or a variant cannot run.
    """
    tracks = beginning.tracks()
    try:
        return export(beginning.given, beginning.state(), tracks, folder)
    finally:
        for track in tracks:
            track.close()


def _import_uvicorn() -> Any:
    """Import uvicorn, and see whether the other packages are there."""
    try:
        import starlette  # noqa: F401
        import uvicorn
        import websockets  # noqa: F401
    except ModuleNotFoundError as error:
        raise ConfigError(
            f"the playground needs starlette, uvicorn and websockets ({error}); install them with "
            "pip install 'gym-mapbench[play]'"
        ) from None
    return uvicorn


def _listening(host: str, port: int) -> socket.socket:
    """Return a socket that listens.

    Raises:
        ConfigError: If the address cannot be used.
    """
    if port > LAST_PORT:
        raise ConfigError(f"--port: expected 0 to {LAST_PORT}, got {port}")
    try:
        return socket.create_server(
            (host, port), family=socket.AF_INET6 if ":" in host else socket.AF_INET, backlog=BACKLOG
        )
    except OSError as error:
        reason = str(error).partition("(while")[0].strip()
        raise ConfigError(f"--host {host} --port {port}: cannot be listened on ({reason})") from None
