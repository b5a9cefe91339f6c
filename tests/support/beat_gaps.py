"""The longest time between two beats at a board behind a USB bridge, of which one request is lost.

    PYTHONPATH=tests .venv/bin/python -P -m support.beat_gaps

The board, its bridge and all waits are slower than real ones, so that a busy machine adds less. Prints a table in the
time of a real board.
"""

import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from typing import NamedTuple

import pytest
from host.twin_board import TwinBoard

from hardwall.cli.terminal import show
from hardwall.host import relay
from hardwall.host.axis import Axis
from hardwall.host.connect import connect, share
from hardwall.host.errors import HostError
from hardwall.host.port import BRIDGE_S
from hardwall.model.axis.registers import RegisterMap
from hardwall.model.runtime.result import Table
from hardwall.sim.scene.load import load

WATCHDOG_S, SLOWER = 0.2, 8
"""The default watchdog; and by how much all is slower for the table: no watchdog is longer than ten times that."""
OTHERS, LOSSES = 12, 10
"""Programs that read all the time beside the one that beats; and requests that are lost for the table."""
WRITE_MANY = 16


class Scene(NamedTuple):
    """What else is asked: by the program that beats, and whether others share the board."""

    reads: bool
    shared: bool


SCENES = {
    "a program that only beats": Scene(reads=False, shared=False),
    "a program that reads all the time": Scene(reads=True, shared=False),
    f"shared, with {OTHERS} others that read all the time": Scene(reads=False, shared=True),
    "shared, and all of them read": Scene(reads=True, shared=True),
}


class BridgedBoard(TwinBoard):
    """A board behind a USB bridge that keeps every answer.

    Attributes:
        bridge_s: for how long.
        heard_s: when beats came.
        losing: whether the next beat is lost.
    """

    def __init__(self, registers: RegisterMap):
        super().__init__(registers)
        self.bridge_s, self.heard_s, self.losing = 0.0, list[float](), False
        self._last, self._place = 0, registers["heartbeat"].address

    def react(self, pulses: tuple[str, ...]) -> None:
        self.late_s = self.bridge_s
        beat = self.server.file.active["heartbeat"]
        if beat != self._last:
            self._last = beat
            self.heard_s.append(time.monotonic())

    def _frame(self, data: bytes) -> bytes:
        request = super()._frame(data)
        beats = request[1:2] == bytes([WRITE_MANY]) and int.from_bytes(request[2:4], "big") == self._place
        if beats and self.losing:
            self.losing = False
            return b""
        return request


def gaps_s(scene: Scene, slower: float = SLOWER, losses: int = LOSSES) -> list[float]:
    """Return the times between the beats before and behind each beat that is lost, s of a real board."""
    with ExitStack() as stack:
        monkeypatch = stack.enter_context(pytest.MonkeyPatch.context())
        monkeypatch.setattr(relay, "GRACE_S", relay.GRACE_S * slower)
        board = stack.enter_context(BridgedBoard(RegisterMap(load("mhz").spec)))
        name = board.name
        if scene.shared:
            name = stack.enter_context(share(name, pace=1 / slower)).name
        axis = stack.enter_context(connect(name, pace=1 / slower))
        axis.supervisor.watchdog = WATCHDOG_S * slower
        others = [stack.enter_context(connect(name, pace=1 / slower)) for _ in range(OTHERS * scene.shared)]
        for each in others:
            stack.enter_context(_reading(each))
        board.bridge_s = BRIDGE_S * slower
        found = [_gap_s(board, axis, scene.reads) / slower for _ in range(losses)]
        board.bridge_s = 0.0
    return found


def _gap_s(board: BridgedBoard, axis: Axis, reads: bool) -> float:
    """Let a beat be lost, behind one that is not; return the time between those before and behind it."""
    _live(axis, reads, board, len(board.heard_s) + 1)
    heard, board.losing = len(board.heard_s), True
    _live(axis, reads, board, heard + 1)
    return board.heard_s[heard] - board.heard_s[heard - 1]


def _live(axis: Axis, reads: bool, board: BridgedBoard, beats: int) -> None:
    """Renew the lease until so many beats have come."""
    while len(board.heard_s) < beats:
        with suppress(HostError):
            axis.renew()
            if reads:
                _ = axis.status
        time.sleep(0.0 if reads else 0.01)


@contextmanager
def _reading(axis: Axis) -> Iterator[None]:
    """Let a program read all the time."""
    ended = threading.Event()

    def read() -> None:
        while not ended.is_set():
            with suppress(HostError):
                axis.read_registers(0, 2)

    thread = threading.Thread(target=read)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()


def main() -> None:
    """Measure, and print."""
    rows = [[name, f"{1e3 * max(gaps_s(scene)):.0f}"] for name, scene in SCENES.items()]
    show(Table({"host": "left", "longest time between two beats (ms)": "right"}, rows))


if __name__ == "__main__":
    main()
