"""The right to write to a shared board: one program has it at a time, and only if it knows the board's present
state."""

import os
import socket
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

HELD, STALE, NO_ANSWER = 6, 10, 11
"""The exceptions of a board that is shared, beside the board's own: another program holds the lease; another program
has written since this one came; and the board did not answer."""
LEASE_OBJECT, NAMED_OBJECT = 0x80, 4
"""The object of the identification that names the holder of the lease, and the kind of request for one object."""
HOLD_S = 2.0
"""The time after which a silent program loses the lease: the largest value of the board's watchdog. So no other program
gets the lease while the board may still drive for this one."""
NAME_MAX = 80
"""The most characters of a program's name."""


class Guest:
    """A program at a board that is shared.

    Attributes:
        name: what others are told of it.
        seen: the number of the last write that it knows of.
    """

    def __init__(self, name: str, seen: int):
        self.name, self.seen = name, seen


class Lease:
    """The right to write. The program that writes has it, until it leaves or is silent for `HOLD_S` of the board.

    A program that came before another one's last write may not write: its image of the words is old.

    Args:
        pace: returns the seconds of the board in a second, or fewer.
    """

    def __init__(self, pace: Callable[[], float]):
        self._pace = pace
        self._holder: Guest | None = None
        self._until_s, self._writes = 0.0, 0

    def welcome(self, name: str) -> Guest:
        """Return a new guest, who has not read anything yet."""
        return Guest(name, self._writes)

    def refusal(self, guest: Guest) -> int | None:
        """Return the exception that answers a write of a guest; None if it may write."""
        if self.holder not in (None, guest):
            return HELD
        return STALE if guest.seen != self._writes else None

    def wrote(self, guest: Guest) -> None:
        """Let a guest who has written, or tried to, hold the lease."""
        self._writes += 1
        guest.seen, self._holder = self._writes, guest
        self._until_s = time.monotonic() + HOLD_S / self._pace()

    def leave(self, guest: Guest) -> None:
        """Take the lease from a guest who has gone."""
        if self._holder is guest:
            self._holder = None

    @property
    def holder(self) -> Guest | None:
        """Who holds it."""
        if self._holder and time.monotonic() > self._until_s:
            self._holder = None
        return self._holder


def name_of(peer: tuple[str, int], here: tuple[str, int]) -> str:
    """Return the program at the other end of a connection on this machine, by name and process where that is known.

    Args:
        peer: the address and port of that end.
        here: the address and port of this end.
    """
    with suppress(OSError, ValueError, IndexError):
        if process := _process_of(peer, here):
            words = (Path("/proc") / process / "cmdline").read_bytes().decode("utf-8", "replace").split("\0")
            return f"{_called(words)}, process {process}"
    return f"a program at {peer[0]}:{peer[1]}"


def _called(words: list[str]) -> str:
    """Return what a program is called: its name without folders, and of `hardwall` the command, too."""
    names = [os.path.basename(word) for word in words if word]
    if names[0].startswith("python"):
        names = [name for name in names[1:] if not name.startswith("-")] or names
    shown = names[:2] if names[0] == "hardwall" else names[:1]
    return "".join(letter for letter in " ".join(shown) if letter.isprintable())[:NAME_MAX]


def _process_of(peer: tuple[str, int], here: tuple[str, int]) -> str | None:
    """Return the number of the process that has a connection from an address of the loopback, as text."""
    ends = [_in_the_table(peer), _in_the_table(here)]
    for row in Path("/proc/net/tcp").read_text(encoding="ascii").splitlines()[1:]:
        cells = row.split()
        # Other connections may have the same port at one of their ends.
        if cells[1:3] == ends:
            link = f"socket:[{cells[9]}]"
            break
    else:
        return None
    for folder in Path("/proc").glob("[0-9]*/fd"):
        with suppress(OSError):
            if any(os.readlink(file) == link for file in folder.iterdir()):
                return folder.parent.name
    return None


def _in_the_table(end: tuple[str, int]) -> str:
    """Return an address and its port as the table of connections has them: a number of this machine, in hexadecimal."""
    number = int.from_bytes(socket.inet_aton(end[0]), sys.byteorder)
    return f"{number:08X}:{end[1]:04X}"
