"""The server of the page: in a thread, on one address, and only for who knows its token."""

import hmac
import os
import secrets
import socket
import threading
import time
from pathlib import Path
from typing import Any

import uvicorn
from fastapi import FastAPI, WebSocket
from fastapi.responses import PlainTextResponse
from fastapi.staticfiles import StaticFiles
from nicegui import ui

from .driver import Driver
from .live import Bench, Live
from .page import add_page

STATIC = Path(__file__).with_name("static")
LOCAL, EVERYWHERE = "127.0.0.1", ("0.0.0.0", "::")
REFUSED = "This page needs the whole address that `hardwall panel` printed, with its token.\n"
START_S = 60.0
"""The longest time in which the server begins: it imports and compiles much on a loaded machine."""


class ServerError(RuntimeError):
    """The page cannot be served; one line that says why."""


class Guard:
    """Lets only requests through whose path begins with a token; refuses pages and sockets alike.

    Args:
        inner: the application of ASGI behind it.
        token: the first part of the path.
    """

    def __init__(self, inner: Any, token: str):
        self._inner, self._token = inner, token.encode()

    async def __call__(self, scope: Any, receive: Any, send: Any) -> None:
        if scope["type"] != "lifespan":
            first = scope["path"].lstrip("/").partition("/")[0]
            if not hmac.compare_digest(first.encode(), self._token):
                if scope["type"] == "websocket":
                    await send({"type": "websocket.close", "code": 1008})
                else:
                    await PlainTextResponse(REFUSED, 403)(scope, receive, send)
                return
        await self._inner(scope, receive, send)


class PanelServer:
    """Serves the page of a board; a context manager that ends it. There is one in a process.

    Args:
        driver: the board.
        bench: what is beside a virtual board; None at a real one.
        title: the title of the page.
        host: the address to listen at; port: its port, 0 for any that is free.

    Attributes:
        url: the address of the page, with its token.

    Raises:
        ServerError: if the address cannot be had.
    """

    def __init__(self, driver: Driver, bench: Bench | None, title: str, host: str = LOCAL, port: int = 0):
        token = secrets.token_urlsafe(16)
        family = socket.AF_INET6 if ":" in host else socket.AF_INET
        try:
            self._socket = socket.create_server((host, port), family=family)
        except OSError as error:
            # Of a name that is none, the number is not the system's.
            said = os.strerror(error.errno) if error.errno and error.errno > 0 else error.strerror
            raise ServerError(f"port {port} of {host} cannot be had: {said or error}") from None
        shown = socket.gethostname() if host in EVERYWHERE else f"[{host}]" if ":" in host else host
        self.url = f"http://{shown}:{self._socket.getsockname()[1]}/{token}/"
        config = uvicorn.Config(
            Guard(_application(driver, bench, title, token), token),
            log_level="error",
            access_log=False,
            ws="websockets-sansio",
            timeout_graceful_shutdown=1,
        )
        self._server = uvicorn.Server(config)
        self._thread = threading.Thread(
            target=self._server.run, args=([self._socket],), name="hardwall-server", daemon=True
        )

    def __enter__(self) -> "PanelServer":
        self._thread.start()
        until = time.monotonic() + START_S
        while not self._server.started:
            if not self._thread.is_alive() or time.monotonic() > until:
                raise ServerError("the page's server does not start")
            time.sleep(0.02)
        return self

    def __exit__(self, *_: object) -> None:
        self._server.should_exit = True
        self._thread.join()
        self._socket.close()


def _application(driver: Driver, bench: Bench | None, title: str, token: str) -> FastAPI:
    """Return the application, all of whose paths begin with the token."""
    application, live = FastAPI(openapi_url=None), Live(driver, bench)

    @application.websocket(f"/{token}/live")
    async def _(socket: WebSocket, tab: str) -> None:
        await live.serve(socket, tab)

    application.mount(f"/{token}/static", StaticFiles(directory=STATIC))
    add_page(driver, bench, title)
    # Everything comes from this server: no other one is asked, so that the page works without a network.
    ui.run_with(application, mount_path=f"/{token}", title=title, tailwind=False, show_welcome_message=False)
    return application
