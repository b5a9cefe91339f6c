"""The socket between a tab and the board. It carries messages that must not wait for a page, first of all the tab's
sign of life.

A tab sends objects of JSON with a key `do`: ping, arm, disarm, acknowledge (`latched`), connect, and at a virtual board
hold (`m`), free and turn (`fault`). While it shows the registers it says so again and again: registers. It gets objects
with these keys: `told` when it changed, see `view.told`; `samples`, each a list of a `Sample`'s values; and `registers`
with their `period_s`, see `register_tree.told`. As bytes it gets the records of `Estimates`.

Every object has a time `at_s`, s of the server's time.monotonic. The server's objects have the time at which they were
sent. A tab's objects have the time of their person's wish, by the tab's clock and the last server time that it got. So
a wish that a slow network or a hung server has delayed is known to be old, and is not carried out.
"""

import asyncio
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from fastapi import WebSocket, WebSocketDisconnect

from ...model.checks import check_int
from .driver import LATE, LOOK_S, Driver
from .estimates import Estimates
from .hand import Hand
from .numbers import number_of, time_from
from .register_reader import Reading
from .register_tree import told as tree
from .view import told
from .wishes import is_fresh

TIMED_S = 0.1
"""The longest time between two objects to a tab, from which it takes its time."""
WORD_MAX = (1 << 32) - 1


@dataclass(frozen=True)
class Bench:
    """The tools beside a virtual board.

    Attributes:
        hand: the hand at its handle.
        estimates: two estimators beside it; None if its own needs more than counts.
    """

    hand: Hand
    estimates: Estimates | None


class Live:
    """The sockets of all tabs.

    Args:
        driver: the board.
        bench: what is beside a virtual board; None at a real one.
    """

    def __init__(self, driver: Driver, bench: Bench | None):
        self._driver, self._bench, self._dragging = driver, bench, ""
        self._acts: dict[str, Callable[[str, dict[str, Any]], object]] = {
            "ping": lambda tab, message: driver.ping(tab, message["at_s"]),
            "arm": lambda tab, message: driver.arm(tab, message["at_s"]),
            "disarm": lambda tab, _: driver.disarm(),
            "acknowledge": self._acknowledge,
            "connect": lambda _, message: driver.connect(message["at_s"]),
            "registers": lambda _, message: driver.registers.ask(message["at_s"]),
        }
        if bench:
            hand = bench.hand
            self._acts |= {
                "hold": lambda tab, message: self._hold(tab, hand, message),
                "free": lambda tab, _: self._free(tab, hand),
                "turn": lambda tab, message: self._turn(tab, hand, message),
            }

    async def serve(self, socket: WebSocket, tab: str) -> None:
        """Serve a tab until its socket is closed; then its board is disarmed, and its hand lets go."""
        await socket.accept()
        sending = asyncio.create_task(self._send(socket, tab))
        try:
            while True:
                message = await socket.receive_json()
                message["at_s"] = time_from(message["at_s"])
                self._acts[message["do"]](tab, message)
        except (KeyError, TypeError, ValueError):
            # What is no message of a page of ours is not answered.
            with suppress(RuntimeError):
                await socket.close(1003)
        except (WebSocketDisconnect, RuntimeError):
            pass
        finally:
            sending.cancel()
            self._driver.leave(tab)
            if self._bench:
                self._free(tab, self._bench.hand)

    def _may(self, tab: str) -> bool:
        """Return whether a tab may do more than to disarm: no other one holds the board."""
        return self._driver.view.holder in (None, tab)

    def _acknowledge(self, tab: str, message: dict[str, Any]) -> None:
        latched = message["latched"]
        check_int("latched", latched, 0, WORD_MAX)
        self._driver.acknowledge(latched, message["at_s"])

    def _hold(self, tab: str, hand: Hand, message: dict[str, Any]) -> None:
        view, wanted_m = self._driver.view, number_of("m", message["m"])
        if view.status and self._may(tab) and is_fresh(message["at_s"]) and self._dragging in ("", tab):
            self._dragging = tab
            hand.hold(wanted_m - view.moved_m, view.status.position_m - view.moved_m)

    def _turn(self, tab: str, hand: Hand, message: dict[str, Any]) -> None:
        if not is_fresh(message["at_s"]):
            self._driver.refuse(LATE)
        elif self._may(tab):
            hand.turn(message["fault"])

    def _free(self, tab: str, hand: Hand) -> None:
        if self._dragging == tab:
            self._dragging = ""
            hand.free()

    async def _send(self, socket: WebSocket, tab: str) -> None:
        """Send what is new, until the socket is closed."""
        estimates = self._bench.estimates if self._bench else None
        number, _ = self._driver.samples_since(0)
        record, _ = estimates.since(0) if estimates else (0, [])
        before: dict[str, Any] = {}
        used, timed_s = None, 0.0
        reading: Reading | None = None
        with suppress(WebSocketDisconnect, RuntimeError):
            while True:
                message: dict[str, Any] = {}
                now = self._told(tab)
                if now != before:
                    message["told"] = before = now
                number, samples = self._driver.samples_since(number)
                if samples:
                    message["samples"] = samples
                before_reading, reading = reading, self._driver.registers.reading
                if reading and reading is not before_reading:
                    message |= self._registers(reading)
                if message or time.monotonic() - timed_s > TIMED_S:
                    message["at_s"] = timed_s = time.monotonic()
                    await socket.send_json(message)
                if estimates:
                    view = self._driver.view
                    if used != (view.revision, view.moved_m):
                        used = view.revision, view.moved_m
                        estimates.use(view.values, view.moved_m)
                    record, records = estimates.since(record)
                    for each in records:
                        await socket.send_bytes(each)
                await asyncio.sleep(LOOK_S)

    def _registers(self, reading: Reading) -> dict[str, Any]:
        device = self._driver.view.device
        return {"registers": tree(device, reading.words), "period_s": reading.period_s} if device else {}

    def _told(self, tab: str) -> dict[str, Any]:
        now = told(view := self._driver.view, tab)
        if self._bench:
            hand = self._bench.hand
            held_m = None if hand.held_m is None else hand.held_m + view.moved_m
            now |= {"hand_m": held_m, "broken": sorted(hand.broken)}
        return now
