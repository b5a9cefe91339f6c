"""The command `panel`."""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from typing import TYPE_CHECKING, Annotated, NamedTuple

import typer

from ..host import Axis, PortError, connect
from ..host.panel.driver import Driver
from ..host.panel.serving import LOCAL, AddressError, Listener, PanelServer, listen
from ..host.panel.tokens import Token, kept_token, new_token
from ..host.port import BAUD, BAUD_MAX
from ..model.checks import shown
from ..model.runtime import termination
from .errors import BadInput
from .options import EstimatorOption, SetOption, within
from .port import IdentityOption, PaceOption, SecondsOption, check_pace
from .terminal import log

if TYPE_CHECKING:
    from .virtual_bench import VirtualBench

VIRTUAL = "virtual"
"""The word for a board in simulation."""
SCENE = "seed-2011"
"""The default scene of a board in simulation."""


class Place(NamedTuple):
    """Where a page is served: the address, its port, and whether the token that is kept for the port is replaced."""

    host: str
    port: int
    renew: bool

    def token(self, at: Listener) -> Token:
        """Return the token of the page, whose address is had: kept at a fixed port of this machine, else new."""
        if self.port and at.is_of_this_machine:
            return kept_token(self.port, self.renew)
        if self.renew:
            raise BadInput(
                "--new-token needs a fixed port (--http) of this machine: other pages get a new token at each start"
            )
        return new_token()


def command(
    port: Annotated[
        str,
        typer.Argument(
            metavar="PORT|virtual", help="a port, as for `hardwall connect`; or `virtual`, a board in simulation"
        ),
    ],
    scene: Annotated[
        str | None,
        typer.Argument(metavar="SCENE", help="scene of the board in simulation", show_default=SCENE),
    ] = None,
    estimator: EstimatorOption = None,
    set_: SetOption = None,
    baud: Annotated[
        int | None,
        typer.Option(min=1, max=BAUD_MAX, help="baud rate of the board's serial line", show_default=f"{BAUD}"),
    ] = None,
    identity: IdentityOption = None,
    pace: PaceOption = None,
    host: Annotated[
        str, typer.Option(metavar="ADDRESS", help="address of this machine at which the page is served")
    ] = LOCAL,
    http: Annotated[
        int,
        typer.Option(min=0, max=65535, metavar="PORT", help="port at which the page is served; 0 takes any free one"),
    ] = 0,
    renew: Annotated[
        bool,
        typer.Option(
            "--new-token", help="replace the secret token in the page's address, which is kept for the port --http"
        ),
    ] = False,
    seconds: SecondsOption = None,
) -> None:
    if seconds is not None:
        within(seconds, "--seconds", 0.0, 1e6, "s")
    check_pace(pace)
    place = Place(host, http, renew)
    if port == VIRTUAL:
        if baud is not None or pace is not None:
            raise BadInput("--baud and --pace are for a board at a port, not for `hardwall panel virtual`")
        from .virtual_bench import bench_of  # noqa: PLC0415  (a board at a port needs no simulation)

        with bench_of(scene or SCENE, estimator, set_, identity) as board:
            try:
                _serve(board.connect, board, f"{board.name}, virtual", place, seconds)
            except PortError:
                # A board that ended has said why.
                sys.exit(board.code or 1)
    elif scene or estimator or set_:
        raise BadInput("SCENE, --estimator and --set are for `hardwall panel virtual`, not for a board at a port")
    else:
        _serve(lambda: connect(port, baud or BAUD, identity=identity, pace=pace), None, port, place, seconds)


def _serve(
    open_axis: Callable[[], Axis],
    board: "VirtualBench | None",
    title: str,
    place: Place,
    seconds: float | None,
) -> None:
    """Serve the page of a board, until it is interrupted or the time has passed."""
    try:
        at = listen(place.host, place.port)
    except AddressError:
        raise BadInput(f"--host must be an address of this machine, not {shown(place.host)}") from None
    # The address is had before a board is started.
    with closing(at.socket):
        token = place.token(at)
        with _driver(open_axis, board) as driver:
            bench = board.bench if board else None
            with PanelServer(driver, bench, title, at, token) as server:
                _say(server.url, token)
                _wait(seconds)


def _say(url: str, token: Token) -> None:
    """Print the address of the page, and who may have it."""
    print(f"page: {url}", flush=True)
    if token.note:
        log.print(f"{token.note}", soft_wrap=True)
    stays = f" It stays the same at this port: {token.file} has its token." if token.file else ""
    log.print(f"Open that page in a browser. Whoever has its address may arm the board.{stays}", soft_wrap=True)


def _wait(seconds: float | None) -> None:
    """Wait until the time has passed, or for ever."""
    until = None if seconds is None else time.monotonic() + seconds
    while until is None or time.monotonic() < until:
        time.sleep(0.05 if seconds else 0.5)


@contextmanager
def _driver(open_axis: Callable[[], Axis], board: "VirtualBench | None") -> Iterator[Driver]:
    """Yield what polls a board; in the end, or before a signal ends the process, disarm it."""

    def end() -> None:
        if driver:
            driver.close()
        if board:
            board.end()

    driver = None
    with termination.undone(end):
        driver = Driver(open_axis)
        yield driver
