"""The guard: nobody but the page that was given out is answered."""

from __future__ import annotations

import pytest
from starlette.applications import Starlette
from starlette.responses import PlainTextResponse
from starlette.routing import Route, WebSocketRoute
from starlette.testclient import TestClient
from starlette.websockets import WebSocketDisconnect

from evolution.play.guard import Door, Guard

ORIGIN, SOCKETS = "http://127.0.0.1:8765", "ws://127.0.0.1:8765"
HOSTILE_HOSTS = ["evil.example", "evil.example:8765", "127.0.0.1:80", "127.0.0.1.evil.example:8765", "", "127.0.0.1:x"]
HOSTILE_ORIGINS = [
    "http://evil.example",
    "http://evil.example:8765",
    "https://127.0.0.1:8765",
    "http://127.0.0.1:9999",
    "http://127.0.0.1",
    "null",
    "file://",
    "",
]


async def greet(socket):
    await socket.accept()
    await socket.send_text("hello")
    await socket.close()


def client_of(door):
    routes = [
        Route("/{token}/page", lambda _: PlainTextResponse("page"), methods=["GET", "POST"]),
        WebSocketRoute("/{token}/socket", greet),
    ]
    return TestClient(Guard(Starlette(routes=routes), door), base_url=ORIGIN)


@pytest.fixture(scope="module")
def door():
    return Door("127.0.0.1", 8765)


@pytest.fixture(scope="module")
def client(door):
    return client_of(door)


def test_the_address_that_was_given_out_is_answered(client, door):
    assert client.get(f"{door.address}page").text == "page"
    assert client.post(f"{door.address}page", headers={"origin": ORIGIN}).text == "page"


def test_every_door_has_a_token_of_its_own():
    assert len({Door("127.0.0.1", 1).token for _ in range(100)}) == 100
    assert len(Door("127.0.0.1", 1).token) >= 32


@pytest.mark.parametrize("path", ["", "page", "socket", "x/page", "../page", "%00/page"])
def test_without_the_token_there_is_nothing(client, path):
    answer = client.get(f"/{path}")
    assert (answer.status_code, answer.text.count("\n")) == (403, 1)


@pytest.mark.parametrize("host", HOSTILE_HOSTS)
def test_other_hosts_are_refused(client, door, host):
    assert client.get(f"/{door.token}/page", headers={"host": host}).status_code == 403


@pytest.mark.parametrize("origin", HOSTILE_ORIGINS)
def test_other_origins_are_refused(client, door, origin):
    assert client.post(f"/{door.token}/page", headers={"origin": origin}).status_code == 403
    with (
        pytest.raises(WebSocketDisconnect),
        client.websocket_connect(f"{SOCKETS}/{door.token}/socket", headers={"origin": origin}),
    ):
        pass


def test_a_request_that_another_site_makes_without_an_origin_is_refused(client, door):
    assert client.get(f"/{door.token}/page", headers={"sec-fetch-site": "cross-site"}).status_code == 403


def test_a_socket_must_say_its_origin(client, door):
    with client.websocket_connect(f"{SOCKETS}/{door.token}/socket", headers={"origin": ORIGIN}) as socket:
        assert socket.receive_text() == "hello"
    with pytest.raises(WebSocketDisconnect), client.websocket_connect(f"{SOCKETS}/{door.token}/socket"):
        pass


@pytest.mark.parametrize(("host", "answered"), [("192.168.1.5:8765", True), ("evil.example:8765", False)])
def test_a_server_for_all_addresses_answers_addresses_but_no_names(host, answered):
    door = Door("0.0.0.0", 8765)
    assert client_of(door).get(f"/{door.token}/page", headers={"host": host}).is_success is answered


def test_pages_are_in_no_frame_load_nothing_from_elsewhere_and_are_not_stored(client, door):
    headers = client.get(f"/{door.token}/page").headers
    assert "default-src 'self'" in headers["content-security-policy"]
    assert "frame-ancestors 'none'" in headers["content-security-policy"]
    assert headers["referrer-policy"] == "no-referrer"
    assert headers["cache-control"] == "no-store"


def test_the_address_of_a_server_for_all_addresses_is_of_this_machine():
    assert Door("0.0.0.0", 80).address.startswith("http://127.0.0.1:80/")
    assert Door("::1", 80).address.startswith("http://[::1]:80/")
