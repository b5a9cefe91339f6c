"""A host of a virtual board in the same process: frames of bytes, and registers by name."""

import numpy as np

from hardwall.model.axis.registers import RegisterMap
from hardwall.model.link.line import framed
from hardwall.sim.virtual.virtual_board import VirtualBoard
from stimuli import frames

PATIENCE_S = 1.0
"""The longest time for an answer."""


class SerialHost:
    """A host that lets time pass while it waits.

    Attributes:
        registers: the board's.
    """

    def __init__(self, board: VirtualBoard):
        self.registers = RegisterMap(board.scene.spec)
        self._board, self._beat = board, 0

    def request(self, pdu: bytes) -> bytes:
        """Return the answer to a request, without unit and CRC; empty if there is none."""
        self._board.hardware.send(framed(b"\1" + pdu))
        answer = bytearray()
        for _ in range(20):
            self._board.run()
            answer += self._board.hardware.take()
            if len(answer) > 3 and framed(bytes(answer[:-2])) == answer:
                return bytes(answer[1:-2])
        assert not answer, answer.hex(" ")
        return b""

    def took_s(self, pdu: bytes) -> float:
        """Return the time from the first bit of a request to the last of its answer, within a run of the board."""
        board, answer = self._board, b""
        began_s = board.handle.time_s
        board.hardware.send(framed(b"\1" + pdu))
        while len(answer) < 4 or framed(answer[:-2]) != answer:
            board.run()
            answer += board.hardware.take()
            assert board.handle.time_s - began_s < PATIENCE_S, answer.hex(" ")
        return board.handle.time_s - began_s

    def read(self, name: str) -> int:
        register = self.registers[name]
        data = self.request(frames.read(register.address, register.size))[2:]
        return register.from_registers(tuple(np.frombuffer(data, ">u2").tolist()))

    def write(self, name: str, word: int) -> bool:
        """Write a register; return whether it was taken."""
        register = self.registers[name]
        return self.request(frames.write(register.address, list(register.to_registers(word))))[0] == 16

    def write_si(self, name: str, value: float) -> None:
        assert self.write(name, round(value / self.registers[name].lsb)), name

    def beat(self) -> None:
        self._beat += 1
        assert self.write("heartbeat", self._beat)

    def live(self, seconds: float) -> None:
        """Let time pass, and beat."""
        until_s = self._board.handle.time_s + seconds
        while self._board.handle.time_s < until_s:
            self.beat()
            for _ in range(20):
                self._board.run()

    def bring_up(self, stiffness_n_per_m: float, damping_n_s_per_m: float, wall_m: float) -> None:
        """Write a wall, acknowledge what stands, and arm."""
        self.write_si("wall_stiffness", stiffness_n_per_m)
        self.write_si("wall_damping", damping_n_s_per_m)
        self.write_si("wall_position", wall_m)
        assert self.write("commit", 1)
        self.beat()
        self.write("acknowledged", self.read("latched"))
        self.write("acknowledge", 1)
        self.write("clear_flags", 1)
        self.beat()
        assert self.write("arm", 1)
