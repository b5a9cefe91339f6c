"""The socket of a tab: what it may ask for, what it is told, and what its end does."""

import asyncio
import json
import time
from itertools import pairwise

import numpy as np
import pytest
from fastapi import WebSocketDisconnect

from hardwall.host.panel.driver import Driver
from hardwall.host.panel.estimates import Estimates
from hardwall.host.panel.hand import Hand
from hardwall.host.panel.live import Bench, Live
from hardwall.host.panel.wishes import STALE_S
from hardwall.sim.scene.load import load
from support.processes import wait_until

TAB, OTHER = "tab", "other"
NUMBERLESS = [json.loads(text) for text in ("NaN", "-Infinity", "1e999", f"1{'0' * 400}")]
"""What JSON of a browser may have in place of a number, as Python reads it."""


class Socket:
    """A socket whose browser says some messages, the next when something was so; then it goes.

    A message without a time is of now.
    """

    def __init__(self, *messages: object):
        self._messages, self.sent, self.bytes, self.code = list(messages), [], [], None

    async def accept(self) -> None:
        pass

    async def receive_json(self) -> object:
        while self._messages and callable(self._messages[0]):
            so = self._messages[0]
            while not so():
                await asyncio.sleep(0.01)
            self._messages.pop(0)
        if not self._messages:
            raise WebSocketDisconnect
        message = self._messages.pop(0)
        return {"at_s": time.monotonic(), **message} if isinstance(message, dict) else message

    async def send_json(self, message: dict) -> None:
        self.sent.append(message)

    async def send_bytes(self, data: bytes) -> None:
        self.bytes.append(data)

    async def close(self, code: int) -> None:
        self.code = code


def serve(live: Live, socket: Socket, tab: str = TAB) -> Socket:
    asyncio.run(live.serve(socket, tab))
    return socket


@pytest.fixture(scope="module")
def estimates() -> Estimates:
    return Estimates(load("mhz").spec)


@pytest.fixture
def orders() -> list[str]:
    return []


@pytest.fixture
def live(driver, orders, estimates) -> Live:
    return Live(driver, Bench(Hand(orders.append, 0.0, 0.15), estimates))


def state(driver: Driver) -> str:
    return driver.view.status.state.name


def test_a_tab_arms_and_its_end_disarms(driver, live):
    ping = {"do": "ping"}
    socket = Socket(ping, {"do": "arm"}, lambda: driver.ping(TAB) or driver.view.holder == TAB, ping)
    serve(live, socket)
    wait_until(lambda: driver.view.holder is None and state(driver) == "DISARMED")
    # It is no silence.
    assert not driver.view.said


def test_what_is_told_is_told_when_it_changes_and_samples_always(driver, live, board):
    socket = Socket(lambda: len(socket.sent) > 5, lambda: board.show(a_channel_idle=1) or socket.sent[-1].get("told"))
    serve(live, socket)
    told = [message["told"] for message in socket.sent if "told" in message]
    assert all(before != after for before, after in pairwise(told))
    assert "a_channel_idle" in told[-1]["flags"]
    times = [sample[0] for message in socket.sent for sample in message.get("samples", [])]
    assert len(times) >= 5
    assert times == sorted(set(times))


def test_registers_are_sent_while_a_tab_shows_them(driver, live, board):
    board.show(count=5)
    quiet = Socket(lambda: len(quiet.sent) > 5)
    serve(live, quiet)
    assert not any("registers" in message for message in quiet.sent)
    socket = Socket({"do": "registers"}, lambda: any("registers" in message for message in socket.sent))
    serve(live, socket)
    (found,) = (message for message in socket.sent if "registers" in message)
    assert found["registers"]["count"] == ["5e-06 m", "5 = 0x00000005"]
    assert found["period_s"] >= 0.5
    # What is read is not kept for a tab that comes later.
    wait_until(lambda: driver.registers.reading is None)


def test_a_tab_that_only_looks_at_registers_writes_nothing(driver, live, board):
    wait_until(lambda: driver.view.status)
    before = len(board.requests)
    socket = Socket({"do": "registers"}, lambda: any("registers" in message for message in socket.sent))
    serve(live, socket)
    assert {request[1] for request in board.requests[before:]} == {3}


@pytest.mark.parametrize(
    "message",
    [
        *({}, {"do": "leap"}, {"do": "acknowledge"}, {"do": "hold", "m": "x"}, [], "arm", {"do": "turn"}, 3),
        *({"do": "hold", "m": m} for m in (*NUMBERLESS, None, True, [1.0])),
        *({"do": "acknowledge", "latched": word} for word in (*NUMBERLESS, 1.0, -1, 1 << 32, True)),
        *({"do": "ping", "at_s": at_s} for at_s in (*NUMBERLESS, "0", True)),
        *({"do": "registers", "at_s": at_s} for at_s in (*NUMBERLESS, "0")),
        *({"do": "turn", "fault": fault} for fault in (["wire"], None, 0)),
    ],
)
def test_what_is_no_message_ends_the_socket(live, orders, message):
    assert serve(live, Socket(message)).code == 1003
    assert orders == []


@pytest.mark.parametrize("fault", ["motor swapped", "clock\nhold 100"])
def test_only_the_faults_that_there_are_reach_the_board(live, orders, fault):
    assert serve(live, Socket({"do": "turn", "fault": fault})).code == 1003
    assert orders == []


def test_a_hand_holds_and_lets_go_when_its_tab_goes(live, orders):
    serve(live, Socket({"do": "hold", "m": 1e-3}))
    assert orders[0].startswith("hold ")
    assert orders[-1] == "hold free"


def test_at_a_real_board_there_is_no_hand(driver):
    assert serve(Live(driver, None), Socket({"do": "hold", "m": 1e-3})).code == 1003


def test_while_another_tab_holds_the_board_a_tab_may_only_disarm(driver, live, orders):
    driver.ping(OTHER)
    driver.arm(OTHER)
    wait_until(lambda: driver.ping(OTHER) or driver.view.holder == OTHER)
    serve(live, Socket({"do": "hold", "m": 1e-3}, {"do": "turn", "fault": "stop"}))
    assert orders == []
    driver.ping(OTHER)
    assert driver.view.holder == OTHER
    serve(live, Socket({"do": "disarm"}))
    wait_until(lambda: state(driver) == "DISARMED")


def test_what_was_wished_long_ago_is_not_done(driver, live, orders):
    """A network that stood still delivers at once what it has kept."""
    old = {"at_s": time.monotonic() - 1.05 * STALE_S}
    asked = [{"do": "ping"}, {"do": "arm"}, {"do": "hold", "m": 1e-3}, {"do": "turn", "fault": "wire"}]
    said = lambda: driver.view.said == "the board did not answer in time: nothing was done"  # noqa: E731
    # Life of long ago is none, and a page that does not know the time says nothing that counts.
    for late in (old, {"at_s": None}):
        serve(live, Socket(*(each | late for each in asked), said))
        assert state(driver) == "DISARMED"
        assert orders == []
    serve(live, Socket({"do": "ping"}, {"do": "arm"}, lambda: driver.view.holder, {"do": "disarm", "at_s": None}))
    wait_until(lambda: state(driver) == "DISARMED")


def test_every_message_has_the_time_of_the_server(driver, live, board):
    board.lost = 1 << 30
    wait_until(lambda: driver.view.status is None)
    began_s = time.monotonic()
    socket = Socket(lambda: len(socket.sent) > 5)
    serve(live, socket)
    times = [message["at_s"] for message in socket.sent]
    assert times == sorted(times)
    assert all(began_s < at_s < time.monotonic() for at_s in times)


def test_records_of_the_estimators_are_sent_with_the_words_of_the_board(driver, live, estimates):
    driver.set(TAB, "wall_stiffness", 2000.0)
    driver.set(TAB, "wall_position", -1e-3)
    wait_until(lambda: driver.view.values["wall_stiffness"] > 0 and driver.view.values["wall_position"] < 0)
    socket = Socket(lambda: estimates.feed([0]) or len(socket.bytes) > 3)
    serve(live, socket)
    assert socket.code is None
    assert {len(each) for each in socket.bytes} == {16}
    # 1 mm deep in the wall that was written.
    assert np.frombuffer(socket.bytes[-1], "<f4")[2:] == pytest.approx([-2.0, -2.0], rel=0.01)
