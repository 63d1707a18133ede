"""The application: the page, its files, what it starts with, what it saves, and its socket."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator, Callable
from typing import TypeVar

from starlette.applications import Starlette
from starlette.middleware import Middleware
from starlette.requests import ClientDisconnect
from starlette.requests import Request as HttpRequest
from starlette.responses import FileResponse, JSONResponse, PlainTextResponse, Response
from starlette.routing import Mount, Route, WebSocketRoute
from starlette.staticfiles import StaticFiles
from starlette.types import Message
from starlette.websockets import WebSocket, WebSocketDisconnect

from evolution.files import zip_of
from evolution.play.desk import Desk
from evolution.play.exporting import PAGE
from evolution.play.guard import Door, Guard
from evolution.play.messages.replies import Data, Error
from evolution.play.messages.requests import (
    MAX_TEXT,
    AskOpen,
    AskParameters,
    AskRandom,
    Cancel,
    Scene,
    Session,
    read_request,
)
from evolution.play.messages.start import State
from evolution.play.plans import changed_file, command_lines, parameter_files, planned
from evolution.play.scenes import map_files, opened, sampled, scenario_of
from evolution.play.worlds import Given
from gym_mapbench.errors import ConfigError, MapBenchError
from gym_mapbench.files.documents import parse_json
from gym_mapbench.settings import Settings

MAX_PAGES = 8
"""Most pages, in tabs or windows, that are connected at the same time."""
MAX_WAITING = 4000
"""Most replies that wait for a page; one that reads more slowly is disconnected."""
MAX_BODY = MAX_TEXT + 2_000_000
"""Most bytes of the body of a request."""
MAX_SAVES = 2
"""Most requests that read or write files at the same time."""
Asked = TypeVar("Asked", bound=Settings)


class Application:
    """What the server does for a page.

    Args:
        given: What the command line gives.
        state: What the page starts with.
        desk: Works on the requests of the socket.
    """

    def __init__(self, given: Given, state: State, desk: Desk) -> None:
        self._given, self._state, self._desk = given, state.model_dump_json(), desk
        self._pages: set[asyncio.Queue[str | None]] = set()
        self._saving = asyncio.Semaphore(MAX_SAVES)

    def behind(self, door: Door) -> Starlette:
        """Return the application, which answers nobody who does not come through the door."""
        return Starlette(
            routes=[
                Route("/{token}/", lambda _: FileResponse(PAGE / "index.html")),
                Route("/{token}/state", lambda _: Response(self._state, media_type="application/json")),
                Mount("/{token}/static", StaticFiles(directory=PAGE)),
                WebSocketRoute("/{token}/socket", self._talk),
                self._post("open", AskOpen, self._open),
                self._post("random", AskRandom, self._random),
                self._post("save/map", Scene, self._save_map),
                self._post("save/params", AskParameters, self._save_params),
                self._post("save/session", Session, self._save_session),
            ],
            middleware=[Middleware(Guard, door=door)],
            lifespan=self._lifespan,
        )

    @contextlib.asynccontextmanager
    async def _lifespan(self, _app: Starlette) -> AsyncIterator[None]:
        yield
        await asyncio.to_thread(self._desk.close)

    async def _talk(self, socket: WebSocket) -> None:
        """Take the messages of a page, and send it the replies."""
        if len(self._pages) >= MAX_PAGES:
            await socket.close(code=1013, reason=f"expected at most {MAX_PAGES} pages")
            return
        await socket.accept()
        waiting: asyncio.Queue[str | None] = asyncio.Queue(MAX_WAITING)
        self._pages.add(waiting)
        sending = asyncio.create_task(_send_all(socket, waiting))
        try:
            await self._listen(socket, _sender(waiting))
        finally:
            self._pages.discard(waiting)
            sending.cancel()
            if not self._pages:
                self._desk.submit(Cancel(), lambda _: None)

    async def _listen(self, socket: WebSocket, send: Callable[[Data], None]) -> None:
        """Submit every message; one that cannot be read is answered with one line."""
        while (message := await socket.receive())["type"] == "websocket.receive":
            try:
                self._desk.submit(read_request(_text_of(message)), send)
            except ConfigError as error:
                send(Error(id=None, message=str(error)))

    def _post(self, name: str, kind: type[Asked], answer: Callable[[Asked], Response]) -> Route:
        """Return a route that reads a body and answers in a thread; an error is one line with status 400."""
        what = name.partition("/")[0]

        def read_and_answer(body: str) -> Response:
            return answer(kind.from_mapping(parse_json(body, what, ConfigError), what))

        async def endpoint(request: HttpRequest) -> Response:
            try:
                async with self._saving:
                    return await asyncio.to_thread(read_and_answer, await _body_of(request))
            except MapBenchError as error:
                return PlainTextResponse(f"{error}\n", status_code=400)
            except ClientDisconnect:
                return Response(status_code=400)  # nobody gets it

        return Route(f"/{{token}}/{name}", endpoint, methods=["POST"])

    def _open(self, asked: AskOpen) -> Response:
        return JSONResponse([scene.model_dump(mode="json") for scene in opened(asked)])

    def _random(self, asked: AskRandom) -> Response:
        return Response(sampled(asked, self._given.environment).model_dump_json(), media_type="application/json")

    def _save_map(self, scene: Scene) -> Response:
        return _download(f"{scene.name}.zip", zip_of(map_files(scenario_of(scene))))

    def _save_params(self, asked: AskParameters) -> Response:
        return _download("nav2_params.yaml", changed_file(asked, self._given).encode())

    def _save_session(self, session: Session) -> Response:
        variants = planned(session, self._given)
        texts = {name: text.encode() for name, text in parameter_files(variants).items()}
        command = "\n".join([*command_lines(variants, session.scene.name), ""]).encode()
        return _download(
            f"{session.scene.name}_session.zip",
            zip_of({**map_files(scenario_of(session.scene)), **texts, "command.txt": command}),
        )


def _download(name: str, content: bytes) -> Response:
    return Response(
        content,
        media_type="application/octet-stream",
        headers={"Content-Disposition": f'attachment; filename="{name}"'},
    )


async def _body_of(request: HttpRequest) -> str:
    """Read the body of a request.

    Raises:
        ConfigError: If it is too large, or not text.
    """
    body = bytearray()
    async for part in request.stream():
        body += part
        if len(body) > MAX_BODY:
            raise ConfigError(f"body: expected at most {MAX_BODY} bytes, got more")
    try:
        return body.decode()
    except UnicodeDecodeError:
        raise ConfigError("body: expected text, got other bytes") from None


def _text_of(message: Message) -> str:
    """Return the text of a message; raises ``ConfigError`` if a page sends bytes."""
    text: str | None = message.get("text")
    if text is None:
        raise ConfigError("message: expected text, got bytes")
    return text


def _sender(waiting: asyncio.Queue[str | None]) -> Callable[[Data], None]:
    """Return a function for any thread that sends a reply; a page that reads too slowly is disconnected."""
    loop = asyncio.get_running_loop()

    def put(text: str) -> None:
        if not waiting.full():
            waiting.put_nowait(text if waiting.qsize() < MAX_WAITING - 1 else None)

    def send(reply: Data) -> None:
        with contextlib.suppress(RuntimeError):  # the server has ended meanwhile
            loop.call_soon_threadsafe(put, reply.model_dump_json())

    return send


async def _send_all(socket: WebSocket, waiting: asyncio.Queue[str | None]) -> None:
    """Send what waits, until None comes."""
    with contextlib.suppress(WebSocketDisconnect, RuntimeError):
        while (text := await waiting.get()) is not None:
            await socket.send_text(text)
        await socket.close(code=1013, reason="expected a page that reads faster")
