"""Signals side by side in one word: reading one wide signal takes cocotb as long as reading a narrow one."""

from collections.abc import Iterable
from itertools import accumulate

import numpy as np
from amaranth.hdl import Shape


class Packing:
    """The layout of signals side by side in one word, the first in its lowest bits.

    Attributes:
        shapes: the shapes by name.
        width: bits of the word.
    """

    def __init__(self, shapes: dict[str, Shape]):
        self.shapes = shapes
        self.width = sum(shape.width for shape in shapes.values())
        widths = [shape.width for shape in shapes.values()]
        self._offsets = dict(zip(shapes, accumulate(widths, initial=0), strict=False))
        self._masks = {name: (1 << width) - 1 for name, width in zip(shapes, widths, strict=True)}
        signs = (1 << shape.width >> 1 if shape.signed else 0 for shape in shapes.values())
        self._places = list(zip(shapes, self._offsets.values(), self._masks.values(), signs, strict=True))

    def pack(self, values: dict[str, int]) -> int:
        """Return the word for values by name; negative values are taken modulo their width, missing ones are 0."""
        word = 0
        for name, value in values.items():
            word |= (int(value) & self._masks[name]) << self._offsets[name]
        return word

    def pack_rows(self, names: Iterable[str], rows: list[tuple[int, ...]]) -> list[int]:
        """Return the words for rows of the values of `names`; everything else is 0."""
        shifted = []
        for name, column in zip(names, zip(*rows, strict=True), strict=True):
            mask, offset = self._masks[name], self._offsets[name]
            shifted.append([(int(value) & mask) << offset for value in column])
        return list(map(sum, zip(*shifted, strict=True)))

    def bit(self, name: str) -> int:
        """Return the word in which a signal of one bit is 1 and all else is 0."""
        return 1 << self._offsets[name]

    def mask(self, name: str) -> int:
        """Return the word in which every bit of a signal is 1 and all else is 0."""
        return self._masks[name] << self._offsets[name]

    def unpack(self, word: int) -> dict[str, int]:
        """Return the values in a word, by name."""
        return {name: ((word >> offset & mask) ^ sign) - sign for name, offset, mask, sign in self._places}

    def column(self, name: str, words: Iterable[int]) -> list[int]:
        """Return the values of one signal in many words."""
        offset, shape = self._offsets[name], self.shapes[name]
        mask, sign = self._masks[name], (self._masks[name] + 1 >> 1) * shape.signed
        return [((word >> offset & mask) ^ sign) - sign for word in words]


class Rows:
    """The values of signals at some clocks, a row for each.

    Attributes:
        names: the signals, in the order of a row.
        clocks: the clock number of each row.
    """

    def __init__(self, names: tuple[str, ...], packing: Packing, words: list[int], clocks: list[int]):
        self.names, self.clocks = names, clocks
        self._packing, self._words = packing, words

    def add(self, clock: int, word: int) -> None:
        """Add the packed values at a clock edge."""
        self.clocks.append(clock)
        self._words.append(word)

    @property
    def rows(self) -> list[tuple[int, ...]]:
        """Return the values in the order of `names`, row by row."""
        return list(zip(*(self._packing.column(name, self._words) for name in self.names), strict=True))

    def column(self, name: str) -> np.ndarray:
        """Return one recorded signal as int64."""
        return np.array(self._packing.column(name, self._words), np.int64)
