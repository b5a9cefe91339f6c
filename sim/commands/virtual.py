"""The command `virtual`."""

import os
import select
import time
from contextlib import suppress
from typing import Annotated

import typer

from ..scene.load import load
from ..virtual.orders import ORDERS, OrderError, obey
from ..virtual.serial_port import Line
from ..virtual.virtual_board import GRASP_S, VirtualBoard
from .errors import BadInput, one_line
from .options import EstimatorOption, SceneArgument, SetOption, changes_of, within
from .terminal import log

JUDGED_S = 3.0
"""The time after which the speed is told."""


def command(
    scene: SceneArgument = "seed-2011",
    estimator: EstimatorOption = None,
    set_: SetOption = None,
    speed: Annotated[float, typer.Option(help="the most simulated seconds in a second; 0 for no limit")] = 1.0,
    tcp: Annotated[
        int | None, typer.Option(min=0, max=65535, metavar="PORT", help="listen at this port of 127.0.0.1, too")
    ] = None,
    seconds: Annotated[
        float | None, typer.Option(metavar="S", help="simulated time to run", show_default="until it is interrupted")
    ] = None,
) -> None:
    within(speed, "--speed", 0.0, 1000.0, "s/s")
    if seconds is not None:
        within(seconds, "--seconds", 0.0, 1e6, "s")
    of = load(scene, changes_of(set_, controller__estimator=estimator))
    with _line(tcp) as line, VirtualBoard(of) as board:
        # The first call compiles, for which no host would wait.
        board.run()
        print(f"serial port: {line.path}")
        if line.tcp_port is not None:
            print(f"tcp port: 127.0.0.1:{line.tcp_port}")
        print(f"orders: {', '.join(f'{name} {order.operand}' for name, order in ORDERS.items())}", flush=True)
        _run(board, line, speed, seconds)


def _line(tcp: int | None) -> Line:
    try:
        return Line(tcp)
    except OSError as error:
        raise BadInput(f"--tcp {tcp} cannot be had: {os.strerror(error.errno)}") from None


class _Orders:
    """The lines of stdin, without a wait for them: a thread that waited there could not be ended."""

    def __init__(self) -> None:
        self._open, self._rest = True, b""

    def take(self) -> list[str]:
        """Return the lines that have come."""
        with suppress(OSError, ValueError):
            while self._open and select.select([0], [], [], 0)[0]:
                data = os.read(0, 4096)
                self._open = bool(data)
                self._rest += data or b"\n" * bool(self._rest)
        *lines, self._rest = self._rest.split(b"\n")
        return [line.decode(errors="replace") for line in lines]


def _run(board: VirtualBoard, line: Line, speed: float, seconds: float | None) -> None:
    """Let the board run, and carry bytes and orders to it."""
    orders, told = _Orders(), False
    began, begun_s = time.monotonic(), board.handle.time_s
    last_s = float("inf") if seconds is None else seconds
    while board.handle.time_s - begun_s < last_s - GRASP_S / 2:
        took_s = time.monotonic() - began
        passed_s = board.handle.time_s - begun_s
        ahead_s = passed_s / speed - took_s if speed else 0.0
        board.hardware.send(line.take(max(ahead_s, 0.0)))
        for text in orders.take():
            _obey(board, line, text)
        if not board.run():
            raise RuntimeError(f"the handle is faster than its encoder: {board.handle.velocity_m_per_s:.3g} m/s")
        line.give(board.hardware.take())
        if not told and took_s > JUDGED_S:
            told = True
            log.print(f"it runs at {passed_s / took_s:.2f} of real time")
    took_s = time.monotonic() - began
    passed_s = board.handle.time_s - begun_s
    print(f"{passed_s:g} s in {took_s:.3g} s: {passed_s / took_s:.2f} of real time")


def _obey(board: VirtualBoard, line: Line, text: str) -> None:
    try:
        obey(board, line, text)
    except OrderError as error:
        log.print(one_line(str(error)))
