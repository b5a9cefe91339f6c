"""VCD files, of a logic analyser or a simulator: every wire of one bit is a channel, by its name with its scopes.

A capture begins where all its channels have levels; later, a level must be 0 or 1.
"""

from collections.abc import Iterator, Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np

from ...model.runtime.regular_file import opened
from .capture import Capture, Changes
from .error import RecordingError

_UNITS_S = {"s": 1, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "ps": 1e-12, "fs": 1e-15}
_LEVELS = {"0": 0, "1": 1}
_SCALARS = "01xXzZ"
PIECE = 1 << 20
TICK_DIGITS = 18
"""The most digits of a time, with its mark: more do not fit int64."""


class Vcd(Capture):
    """A VCD file.

    Args:
        name: the file, for messages.
        path: the file.

    Raises:
        ModuleNotFoundError: without the extra `data`.
        RecordingError: if it is no VCD, or has no wire of one bit.
    """

    form = "VCD"

    def __init__(self, name: str, path: str | Path):
        self.name, self._path, self._tick_hz = name, path, 0.0
        self._codes: list[str] = []
        self.channels, scopes = [], []
        for token in self._tokens():
            kind = token.kind.name
            if kind == "TIMESCALE":
                self._tick_hz = 1 / (token.timescale.magnitude.value * _UNITS_S[token.timescale.unit.value])
            elif kind == "SCOPE":
                scopes.append(token.scope.ident)
            elif kind == "UPSCOPE" and scopes:
                scopes.pop()
            elif kind == "VAR" and token.var.size == 1:
                self.channels.append(self._called(scopes, token.var.reference))
                self._codes.append(token.var.id_code)
            elif kind == "ENDDEFINITIONS":
                break
        if not self.channels or not self._tick_hz:
            raise RecordingError(f"{name}: must have a timescale, and wires of one bit")

    def _called(self, scopes: list[str], name: str) -> str:
        """Return the name of a wire: its own, or with its scopes if another wire has the same."""
        return name if name not in self.channels else ".".join([*scopes, name])

    def _tokens(self):
        """Yield the tokens of the file. Its declarations are read so; its changes are too many for tokens."""
        try:
            from vcd.reader import VCDParseError, tokenize  # noqa: PLC0415  (it comes with an extra)
        except ModuleNotFoundError:
            raise ModuleNotFoundError("nothing reads VCD", name="pyvcd") from None
        try:
            with opened(self._path) as file:
                yield from tokenize(file)
        except VCDParseError as error:
            raise RecordingError(f"{self.name}: is not VCD ({str(error).splitlines()[0]})") from None

    def changes(self, places: Sequence[int]) -> Changes:
        bits: dict[str, list[int]] = {}
        for bit, place in enumerate(places):
            bits.setdefault(self._codes[place], []).append(bit)
        level: list[int | None] = [None] * len(places)
        found: list[tuple[int, int]] = []
        now = 0
        for word in self._words():
            if word[0] == "#":
                now = self._time(word)
            elif word[1:] in bits and word[0] in _SCALARS:
                if word[0] not in _LEVELS and None not in level:
                    raise RecordingError(
                        f"{self.name}, at #{now}: a level must be 0 or 1 once all are known, not {word[0]!r}"
                    )
                for bit in bits[word[1:]]:
                    level[bit] = _LEVELS.get(word[0])
                if None not in level:
                    # Of several changes at one time, the last levels count.
                    if found and found[-1][0] == now:
                        found.pop()
                    found.append((now, sum(each << bit for bit, each in enumerate(level))))
                    self.check_number(len(found))
        if not found:
            raise RecordingError(f"{self.name}: its channels have no levels")
        first, start = found[0]
        kept = [after for before, after in pairwise(found) if after[1] != before[1]]
        ticks, levels = (np.array([each[place] for each in kept], np.int64) for place in (0, 1))
        return Changes(self._tick_hz, ticks - first, levels, start, max(now - first, 1), first / self._tick_hz)

    def _time(self, word: str) -> int:
        if not word[1:].isdigit() or len(word) > TICK_DIGITS:
            raise RecordingError(
                f"{self.name}: a time must be a number of at most {TICK_DIGITS} digits, not {word[:40]!r}"
            )
        return int(word[1:])

    def _words(self) -> Iterator[str]:
        """Yield the words of the changes that are times or scalars; without comments, and the values of vectors."""
        declared = remark = skip = False
        for word in self._all_words():
            if skip or remark or not declared:
                declared = declared or word == "$enddefinitions"
                remark, skip = remark and word != "$end", False
            elif word[0] in "bBrRsS":
                skip = True
            elif word[0] != "$":
                yield word
            else:
                remark = word == "$comment"

    def _all_words(self) -> Iterator[str]:
        rest = ""
        with opened(self._path) as file:
            while block := file.read(PIECE):
                head, _, rest = (rest + block.decode("ascii", "replace")).rpartition("\n")
                yield from head.split()
        yield from rest.split()
