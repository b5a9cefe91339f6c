"""The words of a board in SI units. Words that take effect together go out in one request."""

import difflib
from collections.abc import Callable, Collection, Mapping
from typing import Any

from ..model.axes.registers import is_shared
from ..model.axis.registers import ACTIVE, PULSES, WRITTEN
from ..model.checks import FieldError, shown
from ..model.register import Kind, Register
from .bounds import word_of
from .device import Device
from .errors import ChangedError, HeldError, RefusedError
from .port import Port
from .requests import Sending

OF_THE_HEARTBEAT = ("heartbeat", "acknowledged")
"""Live words that are no settings."""


class Words:
    """The words of a board, and an image of their written values, which is first read from the board.

    Args:
        port: the line.
        device: the device there.
        once: the last written values of the words that exist once, by name; all axes of the board share it.
        check: called when a request to write goes out; what it raises is raised, and nothing is written.

    Raises:
        HostError: if the board does not answer.
    """

    def __init__(
        self,
        port: Port,
        device: Device,
        once: dict[str, int] | None = None,
        check: Callable[[], None] | None = None,
    ):
        self._port, self._device, self._check = port, device, check
        kinds = Kind.WORD, Kind.LIVE
        words = [word for kind in kinds for word in device.of_kind(kind) if word.name not in OF_THE_HEARTBEAT]
        self._words = {word.name: word for word in words}
        self._written, self._once = self._read(), {} if once is None else once
        if once is not None:
            once |= {name: word for name, word in self._written.items() if is_shared(self._words[name])}
        # The words of a request without an answer: it may have been carried out.
        self._tried: dict[str, int] = {}

    @property
    def names(self) -> tuple[str, ...]:
        """The names of all words that can be set."""
        return tuple(self._words)

    def check(self) -> None:
        """Compare the board's words with what was written.

        Raises:
            ChangedError: if one differs: the board was reset, or another host has written.
        """
        found = self._read()
        for name, word in found.items():
            last = self._last(name)
            if word not in (last, self._tried.get(name, last)):
                raise ChangedError(
                    f"the board at {self._port.name} has {self._si(name, word):g} in {name} instead of "
                    f"the written {self._si(name, last):g}: it was reset, or another host writes to it; connect again"
                )
        self._written, self._tried = found, {}

    def get(self, name: str) -> float:
        """Return the SI value of a word as the axis uses it.

        Raises:
            FieldError: if there is no such word.
            HostError: if the board does not answer.
        """
        word = self._word(name)
        shift = ACTIVE - WRITTEN if word.kind is Kind.WORD else 0
        return self._si(name, word.from_registers(self._port.read(word.address + shift, word.size)))

    def written(self, name: str) -> float:
        """Return the SI value of a word as it was written last."""
        return self._si(name, self._last(name))

    def _last(self, name: str) -> int:
        return self._once.get(name, self._written[name])

    def set(self, values: Mapping[str, Any]) -> None:
        """Write words in SI units: live ones first, which act at once; then the others, all at one sample.

        A value is rounded to the word's unit. Nothing is written unless every value is within its range.

        Raises:
            FieldError: if there is no such word, or a value is out of its range.
            TypeError: if a value is no number.
            ChangedError: if an earlier request had no answer, and the board has neither the words from before it nor
                from after it.
            HostError: if the board does not answer, or refuses. What had no answer may have been carried out: `get`
                says what is used.
        """
        given = {name: word_of(self._word(name), value) for name, value in values.items()}
        committed = [name for name in given if self._words[name].kind is Kind.WORD]
        if self._tried:
            self.check()
        for run in self._runs(given.keys() - committed):
            registers = sum((word.to_registers(given[word.name]) for word in run), ())
            self._write(run[0].address, registers, {word.name: given[word.name] for word in run})
        if committed:
            self._commit({name: given[name] for name in committed})

    def _runs(self, names: Collection[str]) -> list[list[Register]]:
        """Return live words grouped into runs of successive addresses: one request writes a run.

        What there is once for several axes is elsewhere than the words around it.
        """
        runs: list[list[Register]] = []
        for word in (word for word in self._words.values() if word.name in names):
            last = runs[-1][-1] if runs else None
            together = last and (last.name in self._once) == (word.name in self._once)
            if last and together and word.address == last.address + last.size:
                runs[-1].append(word)
            else:
                runs.append([word])
        return runs

    def _commit(self, given: dict[str, int]) -> None:
        """Write words and their commit in one request, with what lies between as it was written last."""
        image = self._written | given
        last = max(self._words[name].address for name in given)
        registers = [1]
        for word in self._device.of_kind(Kind.WORD):
            if word.address <= last:
                registers += word.to_registers(image[word.name])
        assert self._device.registers["commit"].address == WRITTEN - 1 >= PULSES
        self._write(WRITTEN - 1, tuple(registers), given)

    def _write(self, address: int, registers: tuple[int, ...], given: dict[str, int]) -> None:
        """Write registers by which some words are given."""
        self._tried = given
        try:
            self._port.write(address, registers, Sending(check=self._check))
        except (RefusedError, HeldError, ChangedError):
            self._tried = {}
            raise
        self._written, self._tried = self._written | given, {}
        self._once.update((name, word) for name, word in given.items() if name in self._once)

    def _read(self) -> dict[str, int]:
        """Return what is written in the board, by name; every block of words in one request."""
        found = {}
        for kind in (Kind.WORD, Kind.LIVE):
            block = [word for word in self._words.values() if word.kind is kind]
            first = block[0].address
            registers = self._port.read(first, block[-1].address + block[-1].size - first)
            for word in block:
                at = word.address - first
                found[word.name] = word.from_registers(registers[at : at + word.size])
        return found

    def _word(self, name: str) -> Register:
        if name not in self._words:
            near = difflib.get_close_matches(name, self._words, 1)
            known = f"; did you mean {near[0]}?" if near else f"; they are {', '.join(self._words)}"
            raise FieldError("word", f"must be one of the board's, not {shown(name)}{known}")
        return self._words[name]

    def _si(self, name: str, word: int) -> float:
        return word * self._words[name].lsb
