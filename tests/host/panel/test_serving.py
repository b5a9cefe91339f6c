"""The server of the page: who does not know its token gets nothing, and an address that cannot be had is one line."""

import asyncio
import socket
from collections.abc import Sequence

import pytest

from hardwall.host.panel.serving import REFUSED, STATIC, AddressError, FreshFiles, Guard, ServerError, listen


async def inner(scope, receive, send) -> None:
    await send({"type": "inner", "path": scope.get("path")})


HOST = "127.0.0.1:8080"


def answered(
    kind: str, path: str, hosts: Sequence[str] = (HOST,), origins: Sequence[str] = (f"http://{HOST}",), at: str = HOST
) -> list[dict]:
    """Return what is sent for a request with some headers Host and Origin to a page that is served at an address."""
    sent = []

    async def send(message: dict) -> None:
        sent.append(message)

    pairs = [(b"host", host.encode()) for host in hosts] + [(b"origin", origin.encode()) for origin in origins]
    address, _, port = at.rpartition(":")
    guard = Guard(inner, "token", {address, "localhost"}, int(port))
    asyncio.run(guard({"type": kind, "path": path, "headers": pairs}, None, send))
    return sent


def passes(kind: str, *args: object, **named: object) -> bool:
    return answered(kind, "/token/", *args, **named)[0]["type"] == "inner"


@pytest.mark.parametrize("kind", ["http", "websocket"])
@pytest.mark.parametrize(
    ("hosts", "origins"),
    [
        # A page of another site that has learned the token.
        ([HOST], ["http://evil.example"]),
        ([HOST], ["http://127.0.0.1:8081"]),
        ([HOST], ["https://127.0.0.1:8080"]),
        ([HOST], ["null"]),
        ([HOST], [f"http://{HOST}", "http://evil.example"]),
        # A name that another site points here.
        (["evil.example:8080"], ["http://evil.example:8080"]),
        (["evil.example:8080"], []),
        (["10.0.0.1:8080"], []),
        (["127.0.0.1"], []),
        (["127.0.0.1:80"], []),
        ([""], []),
        ([], []),
        ([HOST, "evil.example"], []),
    ],
)
def test_who_knows_the_token_and_is_another_page_is_refused(kind, hosts, origins):
    assert not passes(kind, hosts, origins)


def test_a_page_may_be_typed_and_a_socket_is_of_the_page():
    assert passes("http", [HOST], [])
    assert not passes("websocket", [HOST], [])
    assert passes("websocket", ["LOCALHOST:8080"], ["http://localhost:8080"])


@pytest.mark.parametrize(
    ("at", "host", "comes_through"),
    [
        ("0.0.0.0:8080", "10.0.0.1:8080", True),
        ("0.0.0.0:8080", "[fe80::1]:8080", True),
        ("0.0.0.0:8080", "evil.example:8080", False),
        (":::8080", "10.0.0.1:8080", True),
        ("10.0.0.1:80", "10.0.0.1", True),
        ("10.0.0.1:80", "10.0.0.2", False),
        ("[::1]:8080", "[::1]:8080", True),
        ("[::1]:80", "[::1]", True),
    ],
)
def test_a_host_is_that_of_the_address(at, host, comes_through):
    assert passes("http", [host], [], at=at) == comes_through


def test_every_answer_forbids_frames_and_other_servers_and_tells_no_address():
    async def page(scope, receive, send) -> None:
        await send({"type": "http.response.start", "status": 200, "headers": [(b"referrer-policy", b"unsafe-url")]})

    sent = []

    async def send(message: dict) -> None:
        sent.append(message)

    scope = {"type": "http", "path": "/token/", "headers": [(b"host", HOST.encode())]}
    asyncio.run(Guard(page, "token", {"127.0.0.1"}, 8080)(scope, None, send))
    (refusal, _) = answered("http", "/")
    for message in (sent[0], refusal):
        names = [name for name, _ in message["headers"]]
        assert names.count(b"referrer-policy") == 1
        headers = dict(message["headers"])
        assert headers[b"referrer-policy"] == b"no-referrer"
        policy = dict(each.split(" ", 1) for each in headers[b"content-security-policy"].decode().split("; "))
        assert policy["frame-ancestors"] == "'none'"
        assert policy["default-src"] == policy["connect-src"] == "'self'"


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


def test_a_script_of_the_page_is_asked_for_anew():
    """The address may be that of an older version, whose scripts a browser has kept."""
    sent = []

    async def send(message: dict) -> None:
        sent.append(message)

    files = FreshFiles(directory=STATIC)
    asgi = {"asgi": {"spec_version": "2.4"}}
    scope = {"type": "http", "method": "GET", "path": "/panel.js", "headers": [], "root_path": "", **asgi}
    asyncio.run(files(scope, None, send))
    assert sent[0]["status"] == 200
    assert dict(sent[0]["headers"])[b"cache-control"] == b"no-cache"


@pytest.mark.parametrize(("host", "so"), [("127.0.0.1", True), ("localhost", True), ("0.0.0.0", False)])
def test_whether_an_address_is_of_this_machine_only(host, so):
    at = listen(host)
    with at.socket:
        assert at.is_of_this_machine == so


def test_a_port_that_is_taken_is_one_line():
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(ServerError, match=rf"^port {port} of 127\.0\.0\.1 cannot be had: Address already in use$"):
            listen(port=port)


@pytest.mark.parametrize(
    "host",
    [
        *("nowhere.invalid", "192.0.2.1", "a" * 300, "fe80::1"),
        # The system takes these for every address, or for those of a group of machines.
        *("", "<broadcast>", "255.255.255.255", "224.0.0.1", "ff02::1"),
    ],
)
def test_an_address_that_is_none_is_one_line(host):
    with pytest.raises(AddressError, match=rf"^port 0 of {host} cannot be had: that is no address of this machine$"):
        listen(host)


@pytest.mark.parametrize(
    ("host", "shown"),
    [
        ("0", "0.0.0.0"),
        ("0x0", "0.0.0.0"),
        ("0.0.0.0", "0.0.0.0"),
        ("localhost", "localhost"),
        ("::1", "::1"),
        ("::", "::"),
    ],
)
def test_every_name_of_every_address_is_one_of_them(host, shown):
    if ":" in host and not socket.has_dualstack_ipv6():
        pytest.skip("this machine has no IPv6")
    at = listen(host)
    at.socket.close()
    assert at.host == shown
