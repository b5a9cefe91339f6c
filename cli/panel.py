"""The command `panel`."""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from typing import TYPE_CHECKING, Annotated

import typer

from ..host import Axis, PortError, connect
from ..host.panel.driver import Driver
from ..host.panel.serving import LOCAL, AddressError, PanelServer, listen
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
"""The scene of such a board, which then has a clock at which it runs at about the pace of the real one."""


def command(
    port: Annotated[
        str, typer.Argument(metavar="PORT|virtual", help="a port, as of `hardwall connect`; or a board in simulation")
    ],
    scene: Annotated[
        str | None,
        typer.Argument(metavar="SCENE", help="the scene of that", show_default=f"{SCENE}, with a clock of 4 MHz"),
    ] = None,
    estimator: EstimatorOption = None,
    set_: SetOption = None,
    baud: Annotated[
        int | None, typer.Option(min=1, max=BAUD_MAX, help="the board's rate", show_default=f"{BAUD}")
    ] = None,
    identity: IdentityOption = None,
    pace: PaceOption = None,
    host: Annotated[str, typer.Option(metavar="ADDRESS", help="the address at which the page is served")] = LOCAL,
    http: Annotated[int, typer.Option(min=0, max=65535, metavar="PORT", help="its port; 0 for any that is free")] = 0,
    seconds: SecondsOption = None,
) -> None:
    if seconds is not None:
        within(seconds, "--seconds", 0.0, 1e6, "s")
    check_pace(pace)
    if port == VIRTUAL:
        if baud is not None or pace is not None:
            raise BadInput("--baud and --pace are for a board at a port, not for `hardwall panel virtual`")
        from .virtual_bench import bench_of  # noqa: PLC0415  (a board at a port needs no simulation)

        with bench_of(scene or SCENE, estimator, set_, identity, paced=scene is None) as board:
            try:
                _serve(board.connect, board, f"{board.name}, virtual", (host, http), seconds)
            except PortError:
                # A board that ended has said why.
                sys.exit(board.code or 1)
    elif scene or estimator or set_:
        raise BadInput("SCENE, --estimator and --set are for `hardwall panel virtual`, not for a board at a port")
    else:
        _serve(lambda: connect(port, baud or BAUD, identity=identity, pace=pace), None, port, (host, http), seconds)


def _serve(
    open_axis: Callable[[], Axis],
    board: "VirtualBench | None",
    title: str,
    address: tuple[str, int],
    seconds: float | None,
) -> None:
    """Serve the page of a board, until it is interrupted or the time has passed."""
    try:
        at = listen(*address)
    except AddressError:
        raise BadInput(f"--host must be an address of this machine, not {shown(address[0])}") from None
    # The address is had before a board is started.
    with closing(at.socket), _driver(open_axis, board) as driver:
        bench = board.bench if board else None
        with PanelServer(driver, bench, title, at) as server:
            print(f"page: {server.url}", flush=True)
            log.print("Open that page in a browser. Whoever has its address may arm the board.")
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
