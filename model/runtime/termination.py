"""The end of the program by a signal: at once, with one line on stderr, and with nothing left behind.

An exception that a signal raises in compiled code, or in its compiler, crashes the process. A signal therefore ends
the process where it is. What has to be undone before is registered with `undone`; results are kept as they come.
"""

import _thread
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass

from .whole_file import unfinished

CODES = {signal.SIGINT: (130, "interrupted"), signal.SIGTERM: (143, "terminated")}
"""The exit code after every signal that is handled, and the word for it."""
HANGUP = getattr(signal, "SIGHUP", None)
"""The signal of a terminal that is closed, where there is one; under nohup it stays ignored."""
if HANGUP is not None:
    CODES[HANGUP] = (129, "the terminal was closed")
GRACE_S = 1.0
"""The time for what is printed to go out."""
UNDO_S = 10.0
"""The time allowed for an undo step. A step that waits longer, perhaps for a lock of the interrupted thread, is given
up."""
TO_THE_START_OF_THE_LINE, SHOW_THE_CURSOR = "\r\x1b[K", "\x1b[?25h"


@dataclass
class _Kept:
    """The results that outlive this process, the way to continue from them, and a remark on the run."""

    results: int = 0
    way: str = "the same command goes on from there"
    said: Callable[[], str] | None = None


_kept = _Kept()
_undoing: dict[object, Callable[[], object]] = {}
_ending = threading.RLock()
_ended = False


@contextmanager
def undone(undo: Callable[[], object]) -> Iterator[None]:
    """Call `undo` at the end of the context, and before a signal ends the process within the context."""
    with undone_by_signal(undo):
        try:
            yield
        finally:
            undo()


@contextmanager
def undone_by_signal(undo: Callable[[], object]) -> Iterator[None]:
    """Call `undo` before a signal ends the process within the context."""
    key = object()
    _undoing[key] = undo
    try:
        yield
    finally:
        _undoing.pop(key, None)


def count_kept() -> None:
    """Count a result that outlives this process."""
    _kept.results += 1


def go_on_by(way: str) -> None:
    """Say how the user goes on from the results that are kept: the end of `remark`."""
    _kept.way = way


def said_by(say: Callable[[], str]) -> None:
    """Set a function that describes an ended run: it gives the end of `remark` if no results are counted."""
    _kept.said = say


def remark() -> str:
    """Return the end of a message on an unfinished run: the kept results and the way to continue; often empty."""
    if not _kept.results and _kept.said:
        return f"; {_kept.said()}"
    if not _kept.results:
        return ""
    results = "1 new result is" if _kept.results == 1 else f"{_kept.results} new results are"
    return f"; {results} kept, and {_kept.way}"


def begin() -> None:
    """Begin a run: nothing is kept yet."""
    global _kept  # noqa: PLW0603
    _kept = _Kept()


def hear_signals() -> None:
    """End this process when a signal of `CODES` arrives.

    A signal that arrives just before the main thread waits for a lock is not noticed there until the wait is over. So a
    thread hears it, too, and whichever is first ends the process.
    """
    heard, told = os.pipe()
    os.set_blocking(told, False)
    signal.set_wakeup_fd(told, warn_on_full_buffer=False)
    for number in CODES:
        if number != HANGUP or signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, lambda number, _: _end(number))
    threading.Thread(target=_hear, args=[heard], daemon=True).start()


def _hear(heard: int) -> None:
    while number := os.read(heard, 1):
        if number[0] in CODES:
            _end(number[0])


def _within(seconds: float, do: Callable[[], object]) -> None:
    """Call a function in a thread of its own; wait for its end, but not longer than `seconds`."""
    over = threading.Lock()
    over.acquire()

    def run() -> None:
        with suppress(Exception):
            do()
        over.release()

    # Starting a `threading.Thread` takes locks, which the interrupted thread may hold.
    _thread.start_new_thread(run, ())
    over.acquire(timeout=seconds)


def _end(number: int) -> None:
    global _ended  # noqa: PLW0603
    if not _ending.acquire(blocking=False):
        # The other thread ends this process.
        threading.Event().wait()
    if _ended:
        # This thread does, and was interrupted by one more signal.
        return
    _ended = True
    code, word = CODES[signal.Signals(number)]
    # A print that was interrupted holds stdout for good.
    _within(GRACE_S, sys.stdout.flush)
    # A progress bar may have hidden the cursor.
    begin = TO_THE_START_OF_THE_LINE + SHOW_THE_CURSOR if os.isatty(2) else ""
    # A reader that has stopped to read holds stderr.
    _within(GRACE_S, lambda: os.write(2, f"{begin}hardwall: error: {word}{remark()}\n".encode()))
    _within(UNDO_S, _undo)
    os._exit(code)


def _undo() -> None:
    for undo in reversed(list(_undoing.values())):
        with suppress(Exception):
            undo()
    for part in list(unfinished):
        with suppress(OSError):
            part.unlink(missing_ok=True)
