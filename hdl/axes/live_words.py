"""Run-time words of every axis that act in its next turn, without a commit."""

from collections.abc import Sequence
from typing import NamedTuple

from amaranth.hdl import Mux, Signal, Value

from hardwall.model.words import Word

from .pipe import Pipe


class Writing(NamedTuple):
    """The host's write in this clock: the axis, the number of a word, the word, and whether there is a write."""

    axis: Value
    number: Value
    value: Value
    enable: Value


class LiveWords:
    """The live words of every axis, each in its own memory, because it is written alone.

    Args:
        pipe: the pipeline; in its first rota after a reset every axis takes its reset words in stage 0.
        first: whether this is the first rota. The host cannot write in it.
        words: the words that the host knows, by their numbers.
        writing: what the host writes.
    """

    def __init__(self, pipe: Pipe, first: Value, words: Sequence[Word], writing: Writing):
        self._pipe, self._first, self._writing = pipe, first, writing
        self._numbers = {word.name: (number, word) for number, word in enumerate(words)}
        self._taken: dict[str, tuple[int, Value]] = {}

    def _is_written(self, name: str) -> Value:
        """Return whether the host writes a word, of whichever axis."""
        return self._writing.enable & (self._writing.number == self._numbers[name][0])

    def add(self, word: Word, stage: int) -> None:
        """Keep a word that is taken in a stage."""
        pipe, first, writing, bits = self._pipe, self._first, self._writing, word.format.width
        kept = pipe.kept(f"kept_{word.name}", bits)
        kept.write(
            Mux(first, word.reset & (1 << bits) - 1, writing.value[:bits]),
            axis=Mux(first, pipe.axis(0), writing.axis),
            enable=Mux(first, pipe.valid(0), self._is_written(word.name)),
        )
        taken = pipe.taken(kept.read(stage), word.name)
        self._taken[word.name] = stage + 1, taken.as_signed() if word.format.signed else taken

    def __call__(self, name: str, stage: int) -> Value:
        """Return the word of the axis in a stage; this stage comes after the one that took the word."""
        since, taken = self._taken[name]
        return self._pipe.later(taken, stage - since)

    def written(self, name: str, bit: int) -> Signal:
        """Return a bit of a word for every axis, at every clock, as the host has written it last."""
        pipe, reset = self._pipe, self._numbers[name][1].reset >> bit & 1
        written = Signal(pipe.axes, init=((1 << pipe.axes) - 1) * reset, name=f"written_{name}")
        for axis in range(pipe.axes):
            with pipe.m.If(self._is_written(name) & (self._writing.axis == axis)):
                pipe.m.d.sync += written[axis].eq(self._writing.value[bit])
        return written
