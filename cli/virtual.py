"""The command `virtual`."""

import math
import os
import select
import time
from contextlib import nullcontext, suppress
from dataclasses import dataclass
from typing import Annotated

import typer

from ..model.checks import shown
from ..model.link.board_pace import Teller
from ..model.link.uart import BAUD_MAX, BAUD_MIN
from ..model.runtime.termination import undone
from ..sim.rtl.families import FAMILIES
from ..sim.scene.load import load
from ..sim.virtual.orders import ORDERS, OrderError, obey
from ..sim.virtual.real_time import Keeping
from ..sim.virtual.serial_port import Line
from ..sim.virtual.virtual_board import GRASP_S, VirtualBoard
from .errors import BadInput, one_line
from .options import EstimatorOption, SetOption, within
from .scenes import SceneArgument, changes_of
from .terminal import log

JUDGED_S = 3.0
"""The time after which the speed is told."""
LOOK_S = 0.05
"""The longest wait for bytes of hosts between two looks for orders."""
LINE_MAX = 1024
"""The most bytes of an order: what is longer is none."""
COUNTS = "counts:"
"""How a line of counts begins."""
COUNTED_RUNS = 20
"""The runs of the board whose counts are in a line."""
WAITING_MAX = 4096
"""The host's bytes that may wait for the board's line: many frames. What comes beyond is lost."""


def command(
    scene: SceneArgument = "seed-2011",
    estimator: EstimatorOption = None,
    set_: SetOption = None,
    speed: Annotated[float, typer.Option(help="most simulated seconds in a real second, 0 to 1000; 0: no limit")] = 1.0,
    tcp: Annotated[
        int | None,
        typer.Option(
            min=0, max=65535, metavar="PORT", help="also listen at this port of 127.0.0.1; 0 takes any free one"
        ),
    ] = None,
    baud: Annotated[
        int | None,
        typer.Option(min=BAUD_MIN, max=BAUD_MAX, help="baud rate of the serial line", show_default="the board's own"),
    ] = None,
    seconds: Annotated[
        float | None,
        typer.Option(metavar="S", help="simulated time to run, 0 to 1e6 s", show_default="until interrupted"),
    ] = None,
    counts: Annotated[bool, typer.Option("--counts", help="also print the encoder's count at every sample")] = False,
    netlist: Annotated[
        str | None,
        typer.Option(
            metavar="FAMILY",
            help=f"simulate the synthesised netlist for an FPGA family, much slower: {', '.join(FAMILIES)}",
            show_default="the Verilog",
        ),
    ] = None,
) -> None:
    within(speed, "--speed", 0.0, 1000.0, "s/s")
    if seconds is not None:
        within(seconds, "--seconds", 0.0, 1e6, "s")
    if netlist is not None and netlist not in FAMILIES:
        raise BadInput(f"--netlist must be one of {', '.join(FAMILIES)}, not {shown(netlist)}")
    of = load(scene, changes_of(set_, controller__estimator=estimator))
    counted = _Counts() if counts else None
    # The first context is left last: a terminal that takes no more counts then blocks nothing else.
    counting = undone(counted.end) if counted else nullcontext()
    # A host that knows a port asks at once who tells its pace.
    with counting, Line(tcp) as line, Teller(line.names) as teller, VirtualBoard(of, baud, netlist) as board:
        # The first call compiles; no host would wait so long.
        board.run()
        print(f"serial port: {line.path}")
        if line.tcp_port is not None:
            print(f"tcp port: 127.0.0.1:{line.tcp_port}")
        print(f"orders: {', '.join(f'{name} {order.operand}' for name, order in ORDERS.items())}", flush=True)
        pace = _Pace(speed, math.inf if seconds is None else seconds)
        simulated_s, real_s = _run(board, line, teller, pace, counted)
        if counted:
            counted.end()
        print(f"{simulated_s:g} s in {real_s:.3g} s: {simulated_s / real_s:.2f} of real time")


@dataclass(frozen=True)
class _Pace:
    """The most simulated seconds in a second, 0 for no limit; and the simulated time to run."""

    speed: float
    seconds: float


class _Counts:
    """Prints the counts of the encoder, many samples in a line."""

    def __init__(self) -> None:
        self._counts: list[str] = []
        self._runs = 0

    def take(self, board: VirtualBoard) -> None:
        """Take the counts of a run of the board, and print them with those before when there are enough."""
        self._counts += map(str, board.counts.tolist())
        self._runs += 1
        if self._runs == COUNTED_RUNS:
            self.end()

    def end(self) -> None:
        """Print the counts that are left."""
        if self._counts:
            print(COUNTS, *self._counts, flush=True)
        self._counts, self._runs = [], 0


class _Orders:
    """The lines of stdin, without a wait for them: a thread that waited there could not be ended."""

    def __init__(self) -> None:
        self._open, self._rest = True, b""

    def take(self) -> str | None:
        """Return the next line that has come; None if there is none."""
        if b"\n" not in self._rest:
            self._read()
        line, end, rest = self._rest.partition(b"\n")
        if not end and len(line) < LINE_MAX:
            return None
        self._rest = rest
        return line.decode(errors="replace")

    def _read(self) -> None:
        with suppress(OSError, ValueError):
            if self._open and select.select([0], [], [], 0)[0]:
                data = os.read(0, LINE_MAX)
                self._open = bool(data)
                self._rest += data or b"\n" * bool(self._rest)


def _run(board: VirtualBoard, line: Line, teller: Teller, pace: _Pace, counts: _Counts | None) -> tuple[float, float]:
    """Let the board run, carry bytes and orders to it, and tell its hosts how much of real time it keeps.

    Returns:
        The simulated time and the real time that it took, s.

    Raises:
        RuntimeError: if the handle is too fast for its encoder.
    """
    orders, keeping, told = _Orders(), Keeping(), False
    began, begun_s = time.monotonic(), board.handle.time_s

    def passed() -> tuple[float, float]:
        """Return the simulated time and the real time since the beginning."""
        return board.handle.time_s - begun_s, time.monotonic() - began

    while board.handle.time_s - begun_s < pace.seconds - GRASP_S / 2:
        # What an order does lasts a run at least, before the next order.
        text = None
        while True:
            simulated_s, real_s = passed()
            ahead_s = simulated_s / pace.speed - real_s if pace.speed else 0.0
            _carry(board, line, min(max(ahead_s, 0.0), LOOK_S))
            if text is None and (text := orders.take()) is not None:
                _obey(board, line, text)
            if ahead_s <= 0:
                break
        if not board.run():
            raise RuntimeError(f"the handle is too fast for its encoder: {board.handle.velocity_m_per_s:.3g} m/s")
        line.give(board.hardware.take())
        if counts:
            counts.take(board)
        keeping.take(*passed())
        if keeping.least is not None:
            teller.tell(keeping.least)
        if not told and real_s > JUDGED_S:
            told = True
            log.print(f"it runs at {simulated_s / real_s:.2g} of real time")
    return passed()


def _carry(board: VirtualBoard, line: Line, wait_s: float) -> None:
    """Wait for a host for some time, and carry its bytes to the board; more than its line has room for are lost."""
    before = line.sent_away
    board.hardware.send(line.take(wait_s, max(WAITING_MAX - board.hardware.waiting, 0)))
    if line.sent_away > before:
        log.print(f"a host of the network port was sent away: more than {WAITING_MAX} of its bytes waited for the line")


def _obey(board: VirtualBoard, line: Line, text: str) -> None:
    try:
        obey(board, line, text)
    except OrderError as error:
        log.print(one_line(str(error)))
