"""Guard: refuses requests that do not come from the page that this server has given out.

The address of the page holds a random token. ``Host`` must be an address of this server, so that a name that an
attacker lets point here is refused (DNS rebinding). ``Origin`` must be this server, so that pages of other sites cannot
reach it, neither by forms nor by WebSockets.
"""

from __future__ import annotations

import ipaddress
import secrets
from dataclasses import dataclass, field
from urllib.parse import urlsplit

from starlette.datastructures import Headers, MutableHeaders
from starlette.requests import HTTPConnection
from starlette.responses import PlainTextResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from starlette.websockets import WebSocketClose

ANY_ADDRESS = ("0.0.0.0", "::", "")
HEADERS = {
    "Content-Security-Policy": "default-src 'self'; img-src 'self' data: blob:; object-src 'none'; base-uri 'none'; "
    "form-action 'none'; frame-ancestors 'none'",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cache-Control": "no-store",
}
"""The page loads nothing from other hosts, is in no frame, tells nobody its address, and is not stored."""


@dataclass(frozen=True)
class Door:
    """Where the server listens.

    Args:
        host: Address or name that it is bound to.
        port: Its port.
        token: First part of every path.
    """

    host: str
    port: int
    token: str = field(default_factory=lambda: secrets.token_urlsafe(24))

    @property
    def address(self) -> str:
        """The address of the page."""
        host = "127.0.0.1" if self.host in ANY_ADDRESS else self.host
        return f"http://{f'[{host}]' if ':' in host else host}:{self.port}/{self.token}/"

    def is_ours(self, host: str) -> bool:
        """Whether a ``Host``, or the host of an ``Origin``, is this server."""
        try:
            parts = urlsplit(f"//{host}")
            name, port = parts.hostname or "", parts.port or 80
        except ValueError:
            return False
        return port == self.port and (name in {"localhost", "127.0.0.1", self.host} or self._is_reachable(name))

    def _is_reachable(self, name: str) -> bool:
        """Whether a host is a numeric address of a server that is bound to all addresses."""
        try:
            ipaddress.ip_address(name)
        except ValueError:
            return False
        return self.host in ANY_ADDRESS


class Guard:
    """Refuses what comes from elsewhere with status 403, and adds the headers of safety.

    Args:
        app: The application behind it.
        door: Where the server listens.
    """

    def __init__(self, app: ASGIApp, door: Door) -> None:
        self._app, self._door = app, door

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on, or refuse it."""
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
        elif (problem := self._problem(HTTPConnection(scope))) is None:
            await self._app(scope, receive, _with_headers(send))
        elif scope["type"] == "websocket":
            await WebSocketClose(code=1008, reason=problem)(scope, receive, send)
        else:
            await PlainTextResponse(f"{problem}\n", status_code=403)(scope, receive, _with_headers(send))

    def _problem(self, request: HTTPConnection) -> str | None:
        """Return why a request is refused; None if it is not."""
        if not self._door.is_ours(request.headers.get("host", "")):
            return "host: expected the address that mapbench play printed"
        if not self._comes_from_us(request.headers, must_say=request.scope["type"] == "websocket"):
            return "origin: expected the page that mapbench play printed"
        token = request.scope["path"].lstrip("/").partition("/")[0]
        if not secrets.compare_digest(token.encode(), self._door.token.encode()):
            return "token: expected the address that mapbench play printed"
        return None

    def _comes_from_us(self, headers: Headers, *, must_say: bool) -> bool:
        origin = headers.get("origin")
        if origin is None:
            return not must_say and headers.get("sec-fetch-site", "none") in ("none", "same-origin")
        scheme, _, host = origin.partition("://")
        return scheme == "http" and self._door.is_ours(host)


def _with_headers(send: Send) -> Send:
    async def send_safely(message: Message) -> None:
        if message["type"] == "http.response.start":
            MutableHeaders(scope=message).update(HEADERS)
        await send(message)

    return send_safely
