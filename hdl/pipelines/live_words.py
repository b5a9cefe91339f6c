"""Run-time words of every axis that act in its next turn, without a commit."""

from typing import NamedTuple

from amaranth.hdl import Mux, Value

from hardwall.model.words import Word

from ..arithmetic.fixed import shape
from .pipe import Pipe


class Writing(NamedTuple):
    """What the host writes in this clock: the axis, the number of a word and the word, and whether it does."""

    axis: Value
    number: Value
    value: Value
    enable: Value


class LiveWords:
    """The live words of every axis, each in a memory of its own, for it is written alone.

    Args:
        pipe: the pipeline; in its first rota after a reset every axis takes its reset words in stage 0.
        first: whether this is the first rota. The host cannot write in it.
        writing: what the host writes.
    """

    def __init__(self, pipe: Pipe, first: Value, writing: Writing):
        self._pipe, self._first, self._writing = pipe, first, writing
        self._taken: dict[str, tuple[int, Value]] = {}

    def add(self, word: Word, number: int, stage: int) -> None:
        """Keep a word of that number, which is taken in a stage."""
        pipe, first, writing, bits = self._pipe, self._first, self._writing, word.format.width
        kept = pipe.kept(f"kept_{word.name}", bits)
        kept.write(
            Mux(first, word.reset & (1 << bits) - 1, writing.value[:bits]),
            axis=Mux(first, pipe.axis(0), writing.axis),
            enable=Mux(first, pipe.valid(0), writing.enable & (writing.number == number)),
        )
        taken = pipe.taken(kept.read(stage), word.name)
        self._taken[word.name] = stage + 1, taken.as_signed() if shape(word.format).signed else taken

    def __call__(self, name: str, stage: int) -> Value:
        """Return the word of the axis that is in a stage, which comes after the one in which it was taken."""
        since, taken = self._taken[name]
        return self._pipe.later(taken, stage - since)
