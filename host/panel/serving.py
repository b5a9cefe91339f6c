"""The server of the page: in a thread, on one address, and only for who knows its token."""

import errno
import hmac
import ipaddress
import os
import socket
import threading
import time
from collections.abc import Collection
from pathlib import Path
from typing import Any, NamedTuple

import uvicorn
from fastapi import FastAPI, WebSocket
from fastapi.responses import PlainTextResponse, Response
from fastapi.staticfiles import StaticFiles
from nicegui import app, ui

from .driver import Driver
from .live import Bench, Live
from .page import add_page
from .tokens import Token, is_of_this_machine

STATIC = Path(__file__).with_name("static")
LOCAL, EVERYWHERE = "127.0.0.1", ("0.0.0.0", "::")
BROADCAST = "255.255.255.255"
LOCALS, HTTP = ("localhost", LOCAL), 80
"""Names of this machine for itself; and the port that an address need not name."""
REFUSED = "This page needs the whole address that `hardwall panel` printed, as it is, with its token.\n"
HEADERS = {
    "Content-Security-Policy": "; ".join(
        (
            "default-src 'self'",
            # The page's framework has scripts within the page, and makes handlers of events from texts.
            "script-src 'self' 'unsafe-inline' 'unsafe-eval'",
            "style-src 'self' 'unsafe-inline'",
            "img-src 'self' data: blob:",
            "font-src 'self' data:",
            "connect-src 'self'",
            "object-src 'none'",
            "base-uri 'none'",
            "form-action 'none'",
            "frame-ancestors 'none'",
        )
    ),
    # The address of the page has its token.
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
}
"""Headers of every answer: all comes from this server, no other page frames this one, and none learns its address."""
START_S = 60.0
"""The longest time in which the server begins: it imports and compiles much on a loaded machine."""


class ServerError(RuntimeError):
    """The page cannot be served; one line that says why."""


class AddressError(ServerError):
    """The address at which the page is to be served is none of this machine."""


class Guard:
    """Lets a request through under three conditions: its path begins with a token, its Host is the page's address, and
    its Origin, if it has one, is the page itself. Pages and sockets are refused alike. So a page of another site, or a
    name that another site points here, gets nothing even if the token leaked. What is let through gets `HEADERS`.

    Args:
        inner: the application of ASGI behind it.
        token: the first part of the path.
        hosts: the names and addresses that are the page's; with one of `EVERYWHERE`, every address of numbers is.
        port: the port of the page.
    """

    def __init__(self, inner: Any, token: str, hosts: Collection[str], port: int):
        self._inner, self._token, self._port = inner, token.encode(), port
        self._hosts = {host.lower() for host in hosts}

    async def __call__(self, scope: Any, receive: Any, send: Any) -> None:
        if scope["type"] == "lifespan":
            await self._inner(scope, receive, send)
        elif self._is_ours(scope):
            await self._inner(scope, receive, _with_headers(send))
        elif scope["type"] == "websocket":
            await send({"type": "websocket.close", "code": 1008})
        else:
            await PlainTextResponse(REFUSED, 403, HEADERS)(scope, receive, send)

    def _is_ours(self, scope: Any) -> bool:
        first = scope["path"].lstrip("/").partition("/")[0]
        if not hmac.compare_digest(first.encode(), self._token):
            return False
        hosts, origins = (_values(scope, name) for name in (b"host", b"origin"))
        if len(hosts) != 1 or not self._is_host(hosts[0]):
            return False
        # A browser sends an Origin with every socket, and none with a page that is typed.
        needed = scope["type"] == "websocket"
        return origins == [f"http://{hosts[0]}"] or not (origins or needed)

    def _is_host(self, value: str) -> bool:
        """Return whether a value of the header Host is the page's: a name, and its port unless that is `HTTP`."""
        host, colon, port = value.rpartition(":")
        if not colon or value.endswith("]"):
            host, port = value, f"{HTTP}"
        if port != f"{self._port}":
            return False
        return host in self._hosts or (not self._hosts.isdisjoint(EVERYWHERE) and _is_address(host))


def _is_address(host: str) -> bool:
    """Return whether a host is an address of numbers, which no other site can point here."""
    try:
        ipaddress.ip_address(host.removeprefix("[").removesuffix("]"))
    except ValueError:
        return False
    return True


def _values(scope: Any, name: bytes) -> list[str]:
    """Return all values of a header of a request, in lower case."""
    return [value.decode("latin-1").lower() for key, value in scope["headers"] if key.lower() == name]


def _with_headers(send: Any) -> Any:
    """Return what sends with `HEADERS`, in place of the application's own of these names."""
    ours = [(name.lower().encode(), value.encode()) for name, value in HEADERS.items()]
    names = {name for name, _ in ours}

    async def sends(message: Any) -> None:
        if message["type"] == "http.response.start":
            others = [each for each in message.get("headers", []) if each[0].lower() not in names]
            message = {**message, "headers": [*others, *ours]}
        await send(message)

    return sends


class FreshFiles(StaticFiles):
    """Files that a browser must always ask for: at a kept address, another version's files may be in its cache."""

    def file_response(self, *args: Any, **named: Any) -> Response:
        response = super().file_response(*args, **named)
        response.headers["Cache-Control"] = "no-cache"
        return response


class Listener(NamedTuple):
    """An address that is listened at.

    Attributes:
        host: the address as it was given; one of `EVERYWHERE` if it is every address.
        socket: the socket there.
    """

    host: str
    socket: socket.socket

    @property
    def is_of_this_machine(self) -> bool:
        """Whether it can be reached from this machine only."""
        return is_of_this_machine(self.socket.getsockname()[0])


def listen(host: str = LOCAL, port: int = 0) -> Listener:
    """Listen at an address; a browser that comes before there is a server waits for it.

    Args:
        host: the address.
        port: its port, 0 for any that is free.

    Raises:
        AddressError: if the address is none of this machine.
        ServerError: if it cannot be had.
    """
    refused = f"port {port} of {host} cannot be had"
    none_of_ours = AddressError(f"{refused}: that is no address of this machine")
    # The system takes an empty name for every address, and one in angle brackets for a broadcast.
    if not host or host.startswith("<"):
        raise none_of_ours
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    try:
        found = socket.create_server((host, port), family=family)
    except (OSError, UnicodeError) as error:
        number = getattr(error, "errno", None)
        # Of a name that is none, the number is not the system's.
        if not number or number < 0 or number in (errno.EADDRNOTAVAIL, errno.EINVAL):
            raise none_of_ours from None
        raise ServerError(f"{refused}: {os.strerror(number)}") from None
    address = ipaddress.ip_address(found.getsockname()[0])
    if address.is_multicast or str(address) == BROADCAST:
        found.close()
        raise none_of_ours
    # `0` and `0x0` are names of every address, too.
    return Listener(str(address) if address.is_unspecified else host, found)


class PanelServer:
    """Serves the page of a board; a context manager that ends it. There is one in a process.

    Args:
        driver: the board.
        bench: what is beside a virtual board; None at a real one.
        title: the title of the page.
        at: where it is served; the socket is closed at the end.
        token: the secret beginning of the page's address.

    Attributes:
        url: the address of the page, with its token.
    """

    def __init__(self, driver: Driver, bench: Bench | None, title: str, at: Listener, token: Token):
        host, self._socket = at.host, at.socket
        name = socket.gethostname() if host in EVERYWHERE else f"[{host}]" if ":" in host else host
        port = self._socket.getsockname()[1]
        self.url = f"http://{name}:{port}/{token.text}/"
        config = uvicorn.Config(
            Guard(_application(driver, bench, title, token), token.text, {host, name, *LOCALS}, port),
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


def _application(driver: Driver, bench: Bench | None, title: str, token: Token) -> FastAPI:
    """Return the application, all of whose paths begin with the token."""
    application, live, first = FastAPI(openapi_url=None), Live(driver, bench), f"/{token.text}"

    @application.websocket(f"{first}/live")
    async def _(socket: WebSocket, tab: str) -> None:
        await live.serve(socket, tab)

    application.mount(f"{first}/static", FreshFiles(directory=STATIC))
    add_page(driver, bench, title, token.about)
    # The framework shows a bar, which has no name, while the page asks for something. All comes from this machine: the
    # bar would tell nobody anything.
    app.config.quasar_config["loadingBar"]["skipHijack"] = True
    # Everything comes from this server: no other one is asked, so that the page works without a network.
    # Whether it is light or dark is the browser's to say.
    ui.run_with(application, mount_path=first, title=title, dark=None, tailwind=False, show_welcome_message=False)
    return application
