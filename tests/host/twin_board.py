"""A board whose link is the model's, behind a port of the loopback; what its axis shows is the test's to say."""

import socket
import threading
import time
from contextlib import suppress

from hardwall.model.axis import register_file
from hardwall.model.axis.registers import RegisterMap
from hardwall.model.link.line import Verdict, framed
from hardwall.model.link.server import Server

SILENCE_S = 0.02
"""The silence that ends a request which was cut short."""
PATIENT = {"answer_s": 0.2, "pace": 0.1}
"""How its host waits for it: ten times as long, for what is late on a busy machine is not lost."""


class TwinBoard:
    """A board for one host. A context manager.

    Args:
        registers: its registers.
        server: its link, if that is not one of an axis.

    Attributes:
        server: the link, whose register file has the axis's inputs.
        requests: the frames that it has heard.
        late_s: the time by which its next answer, and those behind it, are late.
        lost: how many of its next answers are lost; spoilt: of how many a bit is wrong.
        name: its port.
    """

    def __init__(self, registers: RegisterMap, server: Server | None = None):
        self.server, self.requests = server or Server(register_file.Design(registers)), []
        self.late_s, self.lost, self.spoilt = 0.0, 0, 0
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.name = f"tcp://127.0.0.1:{self._listener.getsockname()[1]}"
        self._guest, self._ended = None, threading.Event()
        self._begun, self._heard_s = b"", 0.0
        self._thread = threading.Thread(target=self._serve)

    def __enter__(self) -> "TwinBoard":
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.hang_up()
        self._ended.set()
        self._listener.shutdown(socket.SHUT_RDWR)
        self._thread.join()
        self._listener.close()

    def show(self, **words: int) -> None:
        """Let the axis show words of its status."""
        self.server.file.status |= words

    def hang_up(self) -> None:
        """Pull the cable."""
        if self._guest:
            with suppress(OSError):
                self._guest.shutdown(socket.SHUT_RDWR)

    def _serve(self) -> None:
        while not self._ended.is_set():
            try:
                connection, _ = self._listener.accept()
            except OSError:
                return
            with connection:
                self._guest = connection
                self._answer_all(connection)

    def _answer_all(self, connection: socket.socket) -> None:
        try:
            while data := connection.recv(1000):
                if not (request := self._frame(data)):
                    continue
                self.requests.append(request)
                self.server.file.pulses = ()
                answer = self.server.take(Verdict.REQUEST, request)
                self.react(self.server.file.pulses)
                late_s, self.late_s = self.late_s, 0.0
                time.sleep(late_s)
                if self.lost:
                    self.lost -= 1
                elif answer:
                    frame = bytearray(framed(answer))
                    frame[-1] ^= self.spoilt > 0
                    self.spoilt -= self.spoilt > 0
                    connection.sendall(frame)
        except OSError:
            return

    def _frame(self, data: bytes) -> bytes:
        """Return the request that ends with these bytes, or none; a silence ends what came before."""
        now = time.monotonic()
        self._begun = data if now > self._heard_s + SILENCE_S else self._begun + data
        self._heard_s = now
        whole = self._begun if self._begun == framed(self._begun[:-2]) else b""
        if whole:
            self._begun = b""
        return whole

    def react(self, pulses: tuple[str, ...]) -> None:
        """Do what the axis does at the pulses of a request; nothing, unless a test says so."""
