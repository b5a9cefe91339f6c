"""The words of a board as a file: TOML in SI units, with the identity of the board, and back into it, all or none."""

import tomllib
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

from ..model.checks import FieldError, shown
from ..model.register import Register
from ..model.runtime.regular_file import content_of
from ..model.runtime.whole_file import whole_file
from .axis import Axis
from .bounds import check_within, is_whole, word_of
from .device import Device
from .errors import ChangedError, ConfigError, HostError, NotReadyError
from .status import State

BYTES_MAX = 10**6
"""The largest file."""
DIGITS = 17
"""The digits with which every float is told from every other."""
FACTS = "identity", "clock_hz", "clocks_per_sample", "capture_registers", "axes"
"""The facts on a board in its file: attributes of `Device`."""
HEAD = """\
# The words of a board, in SI units, for `hardwall config load PORT FILE`. A word that is left out stays as it is.

[board]
"""


class Difference(NamedTuple):
    """A word that is another one in a file than on a board: its name, both values in the unit, and the unit."""

    name: str
    board: float
    file: float
    unit: str


@dataclass(frozen=True)
class Config:
    """Words of a board, and what board it is.

    Attributes:
        source: the name of the file, or of the port.
        facts: what the board says of itself, by `FACTS`.
        words: values in SI units, by the names of their words.
    """

    source: str
    facts: MappingProxyType[str, Any]
    words: MappingProxyType[str, float]

    @classmethod
    def of(cls, axis: Axis, source: str = "the board") -> "Config":
        """Return all words of an axis as it uses them.

        Raises:
            HostError: if the board is not reached.
        """
        words = {name: _nearest(axis.device.registers[name], axis.get(name)) for name in axis.names}
        return cls(source, MappingProxyType(_facts(axis.device)), MappingProxyType(words))

    @classmethod
    def read(cls, path: Path) -> "Config":
        """Return what a file says.

        Raises:
            ConfigError: if it cannot be read, or is no configuration; the message names the file and what is accepted.
        """
        name = shown(path.name or str(path))
        try:
            found = tomllib.loads(content_of(path, BYTES_MAX).decode("utf-8-sig"))
        except OSError as error:
            raise ConfigError(f"{name} cannot be read: {error.strerror}") from None
        except (ValueError, RecursionError) as error:
            raise ConfigError(f"{name} is no TOML: {error}") from None
        if found.keys() != {"board", "words"} or not all(isinstance(each, dict) for each in found.values()):
            raise ConfigError(
                f"{name} must have only the tables [board] and [words], as `hardwall config save` writes them"
            )
        facts, words = found["board"], found["words"]
        if facts.keys() != {*FACTS}:
            raise ConfigError(f"{name}: [board] must have {', '.join(FACTS)}, not {shown([*facts])}")
        return cls(name, MappingProxyType(facts), MappingProxyType(words))

    def write(self, path: Path, device: Device) -> None:
        """Write a file, whole or not at all: each word with its unit and its range.

        Raises:
            OSError: if it cannot be written.
        """
        lines = [f"{name} = {_toml(value)}" for name, value in self.facts.items()] + ["", "[words]"]
        for name, value in self.words.items():
            word = device.registers[name]
            unit = f"{word.unit}, " if word.unit else ""
            lines.append(f"{name} = {value!r}  # {unit}{word.low * word.lsb:g} to {word.high * word.lsb:g}")
        with whole_file(path) as part:
            part.write_text(HEAD + "\n".join(lines) + "\n", encoding="utf-8")

    def differences(self, axis: Axis) -> list[Difference]:
        """Return the words whose values differ from those in use, in the order of the board's words.

        Raises:
            ChangedError: if the file is of another board; the message says what differs.
            ConfigError: if a word is none of the board's, or cannot hold its value.
            HostError: if the board is not reached.
        """
        self._check_board(axis)
        words = self._rounded(axis)
        found = []
        for name in (name for name in axis.names if name in words):
            word, used = axis.device.registers[name], axis.get(name)
            if words[name] != round(used / word.lsb):
                wanted = _nearest(word, words[name] * word.lsb)
                found.append(Difference(name, _nearest(word, used), wanted, word.unit))
        return found

    def load(self, axis: Axis, differences: Sequence[Difference]) -> None:
        """Write the words, all or none: live ones in a request, and the others with their commit in another.

        Words that the file leaves out stay as the board uses them. It arms nothing. If the board does not take all, it
        gets again what it had.

        Args:
            axis: the axis, which must not be ARMED.
            differences: what `differences` returned, and a person has seen.

        Raises:
            NotReadyError: if the axis is ARMED.
            ChangedError: if the file is of another board, or the differences are others now.
            HeldError: if another program holds the lease of a board that is shared.
            ConfigError: if a word is none of the board's, or cannot hold its value.
            HostError: if the board is not reached. The message says whether it has its words of before.
        """
        if axis.status.state is State.ARMED:
            raise NotReadyError("the axis is ARMED: disarm it before a configuration is loaded")
        if self.differences(axis) != list(differences):
            raise ChangedError("the words of the board have changed since they were shown: nothing was loaded")
        before = {name: axis.get(name) for name in axis.names}
        # Where another program may write, or has written, that is said before anything is.
        axis.renew()
        try:
            axis.set(**{**before, **self.words})
            if left := self.differences(axis):
                raise HostError(f"the board did not take the words {', '.join(each.name for each in left)}")
        except HostError as error:
            raise _undone(axis, before, error) from error

    def _check_board(self, axis: Axis) -> None:
        found = _facts(axis.device)
        if self.facts == found:
            return
        others = [name for name in FACTS if self.facts[name] != found[name]]
        unknown = sorted(self.words.keys() - set(axis.names))
        said = [
            f"{name} is {shown(self.facts[name])} in the file, and {shown(found[name])} on the board" for name in others
        ]
        said += [f"the board has no word {shown(unknown[0])}"] if unknown else []
        raise ChangedError(f"{self.source} is of another board: {'; '.join(said)}")

    def _rounded(self, axis: Axis) -> dict[str, int]:
        """Return the words by their names."""
        found = {}
        for name, value in self.words.items():
            if name not in axis.names:
                raise ConfigError(f"{self.source}: [words] must be words of the board, not {shown(name)}")
            try:
                found[name] = word_of(axis.device.registers[name], value)
            except (FieldError, TypeError) as error:
                raise ConfigError(f"{self.source}: {error}") from None
        return found


def _undone(axis: Axis, before: dict[str, float], error: HostError) -> HostError:
    """Write back the words that the board had before; return an error that says whether this succeeded."""
    with suppress(HostError):
        axis.set(**before)
        if all(axis.get(name) == value for name, value in before.items()):
            return HostError(f"nothing was loaded, because the board did not take all: {error}")
    return HostError(
        f"some words may be loaded and others not, because the board does not answer: load again ({error})"
    )


def _facts(device: Device) -> dict[str, Any]:
    return {name: getattr(device, name) for name in FACTS}


def _nearest(word: Register, value: float) -> float:
    """Return the SI value of a word with as few digits as give the same word again; an int for a plain number."""
    number = round(value / word.lsb)
    if is_whole(word):
        return number
    for digits in range(1, DIGITS):
        short = float(f"{value:.{digits}g}")
        with suppress(FieldError):
            check_within(word.name, word, short)
            if word_of(word, short) == number:
                return short
    return value


def _toml(value: Any) -> str:
    return f'"{value}"' if isinstance(value, str) else f"{value}"
