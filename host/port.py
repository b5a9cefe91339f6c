"""The line to a board: requests of Modbus RTU, one after the other, on a serial port or a port of the network."""

import math
import secrets
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager
from typing import Any

from pymodbus.exceptions import ConnectionException, ModbusException
from pymodbus.pdu import ModbusPDU

from ..model.checks import check_int, check_range
from ..model.link.board_pace import NETWORK, PACE_LEAST, Told
from ..model.link.server import FAILURE, READ_MAX, VALUE, WRITE_MAX
from .clients import client_of, reason
from .errors import ChangedError, ForeignError, HeldError, PortError, RefusedError, SilentError
from .leases import HELD, LEASE_OBJECT, NO_ANSWER, STALE
from .precedence import Precedence
from .requests import PLAIN, Request, Sending

BAUD, BAUD_MAX = 921_600, 4_000_000
"""The board's rate unless its clock is slow, and the highest of a serial port."""
ANSWER_S = 1.0
"""The time after which a board without an answer counts as silent. Until then, requests that may be repeated are
repeated."""
ANSWER_S_LEAST, ANSWER_S_MOST = 1e-3, 3600.0
"""The limits of that."""
BYTE_BITS, DEVICE_BITS = 10, 1500
"""Bits of a byte on the line; and the longest time in which a board prepares an answer, in bits: 6000 clocks of at
least 4 a bit."""
BRIDGE_S = 0.016
"""The time in which a USB bridge holds received bytes back, by its driver's default."""
MACHINE_S = 0.02
"""The longest delay of a request or an answer by this machine's scheduling."""
BEAT_S = 0.15
"""The longest wait of other requests for a beat that loses one of its requests."""
FIRST_TRIES = 2
"""Requests that are sent in `answer_s` to a board that has not answered yet: one may be lost."""
TRIES = 5
"""Attempts to find the beginning of an answer again."""
PAUSE_S = 0.025
"""The silence behind which the board takes the next byte for the beginning of a request."""
EXCEPTIONS = {1: "it does not know the function", 2: "it has no such register", VALUE: "a value is out of its range"}
"""The meaning of a Modbus exception, except `FAILURE`."""


class Port:
    """A line to a board. Requests may come from several threads: each waits for its turn, and they come in order.

    An answer of Modbus RTU does not say which request it belongs to. So after a request without an answer, and at the
    beginning, the board is asked to repeat a random word until it does: what it had left to say is then over.

    Once the board has answered, an answer is waited for only as long as it can take, because no beat can be sent
    meanwhile: the bits of request and answer, `DEVICE_BITS`, `BRIDGE_S` and `MACHINE_S`, some 40 ms at 921 600 baud.
    What may be asked twice is then asked again, until `answer_s` is over.

    A port that `hardwall share` serves loses nothing and always answers, though later: it is waited for `answer_s`.

    Args:
        name: a serial port's path, or tcp://HOST:PORT.
        baud: the rate of a serial port.
        answer_s: how long an answer is waited for in all, in the board's time.
        pace: seconds of the board in a second, or fewer; None: what a virtual board tells, and 1 of any other.

    Attributes:
        name: as given.

    Raises:
        FieldError: if a number is out of its range.
        PortError: if the port cannot be had.
    """

    def __init__(self, name: str, baud: int = BAUD, answer_s: float = ANSWER_S, pace: float | None = None):
        check_int("baud", baud, 1, BAUD_MAX)
        check_range("answer_s", answer_s, ANSWER_S_LEAST, ANSWER_S_MOST)
        if pace is not None:
            check_range("pace", pace, PACE_LEAST, 1.0)
        self.name, self._given, self._baud, self._board_s = name, pace or 1.0, baud, answer_s
        self._told = Told(name) if pace is None else None
        try:
            self._client = client_of(name, baud, self._answer_s)
        except BaseException:
            self._leave()
            raise
        self._in_step, self._gone = False, False
        # Whether other programs have the board, too, behind this port.
        self._shared = False
        # Whether it has ever been in step; and the time of the last sent bytes, whose rest the board may await.
        self._known, self._sent_s = False, time.monotonic()
        try:
            self._client.connect()
        except (OSError, ValueError, OverflowError) as error:
            self._leave()
            raise PortError(f"{name} cannot be opened: {reason(error)}") from None
        # A request that waits in a thread of its own is not torn by an interrupt, and none overtakes another.
        self._turns = ThreadPoolExecutor(1, "hardwall-port")
        self._precedence = Precedence()

    def close(self) -> None:
        """Close the port, behind the requests that wait for their turn."""
        self._gone = True
        self._turns.shutdown()
        self._client.close()
        self._leave()

    def _leave(self) -> None:
        """Hear no more of the board's pace."""
        if self._told is not None:
            self._told.close()

    @property
    def pace(self) -> float:
        """The seconds of the board in a real second, or fewer: as given, or else as the board tells it now."""
        return self._given if self._told is None else self._told.pace

    @property
    def _is_of_network(self) -> bool:
        return self.name.startswith(NETWORK)

    @property
    def _answer_s(self) -> float:
        return self._board_s / self.pace

    def line_s(self, count: int) -> float:
        """Return the time that a read of so many registers takes of the line, s: its bits, and the board's thinking."""
        return self._line_s(Request.reading(0, count))

    def _line_s(self, request: Request) -> float:
        return (BYTE_BITS * request.size + DEVICE_BITS) / self._baud / self.pace

    def read(self, address: int, count: int) -> tuple[int, ...]:
        """Return successive registers, in as many requests as they need.

        Raises:
            HostError: if the board does not answer, or refuses.
        """
        registers: list[int] = []
        while len(registers) < count:
            some = min(count - len(registers), READ_MAX)
            registers += self._ask(Request.reading(address + len(registers), some)).registers
        return tuple(registers)

    def first(self) -> AbstractContextManager[None]:
        """Give this thread's requests precedence over all others, except urgent writes. A beat uses it.

        An application that reads all the time would part the requests of a beat. Behind a USB bridge the board would
        trip after one lost frame.
        """
        return self._precedence.taken()

    def write(self, address: int, registers: tuple[int, ...], sending: Sending = PLAIN) -> None:
        """Write successive registers, all in one request.

        Args:
            address: the first one's.
            registers: their words.
            sending: how the request goes out.

        Raises:
            ValueError: if they are more than a request takes.
            HostError: if the board does not answer, or refuses.
        """
        if not 1 <= len(registers) <= WRITE_MAX:
            raise ValueError(f"registers must be 1 to {WRITE_MAX}, not {len(registers)}")
        self._ask(Request.writing(address, registers), sending)

    def identify(self) -> dict[int, bytes]:
        """Return the objects by which the device identifies itself: 0 its vendor, 1 its product, 2 its revision."""
        return dict(self._ask(Request.identifying()).information)

    def relay(self, request: bytes) -> bytes:
        """Return the answer to another program's request, both as unit, function and data; it is asked once.

        Raises:
            HostError: if the board does not answer.
        """
        return self._ask(Request.relaying(request), Sending(once=True)).frame

    @property
    def lease(self) -> str | None:
        """The program that holds the lease of a shared board, empty if none does; None if the board is not shared.

        Raises:
            HostError: if nothing answers.
        """
        if not self._shared:
            return None
        return self._ask(Request.lease()).information[LEASE_OBJECT].decode("utf-8", "replace")

    def _ask(self, request: Request, sending: Sending = PLAIN) -> Any:
        """Return the answer to a request, which is asked again without one, in a turn of its own each time."""
        until_s, silent = time.monotonic() + self._answer_s, None
        while True:
            if self._gone:
                raise PortError(f"{self.name} is closed or gone: connect again")
            if not sending.at_once:
                self._precedence.wait(BEAT_S / self.pace)
            try:
                turn = self._turns.submit(self._turn, request, sending.check)
            except RuntimeError:
                # Another thread has closed it just now, or the program ends.
                raise PortError(f"{self.name} is closed: connect again") from None
            try:
                return turn.result()
            except SilentError as error:
                silent = silent or error
                if sending.once or time.monotonic() >= until_s:
                    raise silent from None

    def _turn(self, request: Request, check: Callable[[], None] | None) -> ModbusPDU:
        if not self._in_step:
            self._find_step()
        if check:
            check()
        answer = self._answer(request)
        if answer.isError():
            code = getattr(answer, "exception_code", 0)
            self._check_shared(request, code)
            said = "it does not do that in its present state" if code == FAILURE else EXCEPTIONS.get(code, f"{code}")
            raise RefusedError(f"the board refuses to {request.what}: {said}", code)
        if not request.fits(answer):
            self._in_step = False
            raise ForeignError(f"the answer does not fit the request to {request.what}")
        return answer

    def _check_shared(self, request: Request, code: int) -> None:
        """Raise the error for an exception that comes from `hardwall share`, not from the board."""
        if code == NO_ANSWER:
            raise SilentError(f"the board behind {self.name} does not answer the request to {request.what}")
        if code == STALE:
            raise ChangedError(
                f"another program has written to the board at {self.name} since this program connected: connect again"
            )
        if code == HELD:
            said = self._answer(Request.lease())
            holder = b"" if said.isError() else said.information.get(LEASE_OBJECT, b"")
            name = holder.decode("utf-8", "replace") or "another program"
            raise HeldError(
                f"the lease of the board at {self.name} is held by {name}: it alone writes, others may read and disarm"
            )

    def _answer(self, request: Request) -> Any:
        wait_s = self._answer_s if self._known else self._answer_s / FIRST_TRIES
        if self._known and not self._shared:
            wait_s = min(wait_s, self._line_s(request) + (BRIDGE_S + MACHINE_S) / self.pace)
        self._sent_s = time.monotonic()
        self._client.until_s = self._sent_s + wait_s
        try:
            return request.send(self._client)
        except ConnectionException:
            raise self._lost() from None
        except ModbusException:
            if self._in_step:
                self._in_step = False
                raise SilentError(
                    f"nothing answers any more at {self.name}, to the request to {request.what}, which may have been "
                    "carried out: is the cable in, and the board powered?"
                ) from None
            if self._is_of_network:
                said = "a board that is powered and configured, and is it this port"
                raise SilentError(f"nothing answers at {self.name}: is behind it {said}?") from None
            raise SilentError(
                f"nothing answers at {self.name} at {self._baud} baud: is the board powered and configured, "
                "and is it this port and this rate?"
            ) from None

    def _lost(self) -> PortError:
        """Return the error of a port that is gone from now on."""
        self._gone = True
        if self._is_of_network and not self._known:
            return PortError(
                f"{self.name} ended the connection at once: it is no board, or has as many programs as it takes"
            )
        return PortError(f"{self.name} is gone: is the cable in, and the board powered?")

    def _find_step(self) -> None:
        """Let the board repeat random words until it says the last one; at first for `answer_s` in all."""
        until_s = math.inf if self._known else time.monotonic() + self._answer_s
        pause_s = PAUSE_S / self.pace
        silent_s = self._sent_s + pause_s - time.monotonic()
        for tries_left in reversed(range(TRIES)):
            self._drain(silent_s)
            silent_s = pause_s
            request = Request.echoing(secrets.token_bytes(2))
            try:
                if request.fits(self._answer(request)):
                    if not self._known and self._is_of_network:
                        self._shared = not self._answer(Request.lease()).isError()
                    self._in_step = self._known = True
                    return
            except SilentError:
                if not tries_left or time.monotonic() >= until_s:
                    raise
            if time.monotonic() >= until_s:
                break
        if self._known:
            # What came may have been late, of requests before.
            raise SilentError(f"the device at {self.name} answers late, or no longer echoes a test request")
        raise ForeignError(f"the device at {self.name} does not echo a test request, as an axis does")

    def _drain(self, silent_s: float) -> None:
        """Read and drop bytes until none comes for some time. If bytes keep coming, the device is no board."""
        until_s = time.monotonic() + self._answer_s
        try:
            while time.monotonic() < until_s:
                self._client.until_s = time.monotonic() + silent_s
                if not self._client.recv(None):
                    return
        except ConnectionException:
            raise self._lost() from None
