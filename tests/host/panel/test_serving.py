"""The server of the page: who does not know its token gets nothing, and an address that cannot be had is one line."""

import asyncio
import socket

import pytest

from hardwall.host.panel.serving import REFUSED, Guard, PanelServer, ServerError


async def inner(scope, receive, send) -> None:
    await send({"type": "inner", "path": scope.get("path")})


def answered(kind: str, path: str) -> list[dict]:
    sent = []

    async def send(message: dict) -> None:
        sent.append(message)

    asyncio.run(Guard(inner, "token")({"type": kind, "path": path}, None, send))
    return sent


@pytest.mark.parametrize("path", ["/token", "/token/", "/token/live", "/token/_nicegui/x"])
def test_who_knows_the_token_comes_through(path):
    for kind in ("http", "websocket"):
        assert answered(kind, path) == [{"type": "inner", "path": path}]


@pytest.mark.parametrize(
    "path", ["/", "", "/live", "/toke", "/tokens/", "/x/token/", "/TOKEN/", "/_nicegui/static/x.js", "/\u0663/"]
)
def test_who_does_not_is_refused(path):
    begin, body = answered("http", path)
    assert begin["status"] == 403
    assert body["body"].decode() == REFUSED
    assert answered("websocket", path) == [{"type": "websocket.close", "code": 1008}]


def test_the_server_s_own_life_needs_no_token():
    assert answered("lifespan", "") == [{"type": "inner", "path": ""}]


def test_a_port_that_is_taken_is_one_line(driver):
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(ServerError, match=rf"^port {port} of 127\.0\.0\.1 cannot be had: Address already in use$"):
            PanelServer(driver, None, "title", port=port)


def test_an_address_that_is_none_is_one_line(driver):
    with pytest.raises(ServerError, match=r"^port 0 of nowhere\.invalid cannot be had: "):
        PanelServer(driver, None, "title", host="nowhere.invalid")
