"""The standard streams of the command line. A failed write to stdout is an error; a failed write to stderr is
ignored."""

import errno
import io
import os
import sys

CLOSED = 141
"""The exit code if nobody reads stdout any more, as of a process ended by SIGPIPE."""


class StdoutError(RuntimeError):
    """Stdout cannot be written.

    Attributes:
        code: the exit code; the message is empty if nobody reads stdout any more, because this is no fault.
    """

    def __init__(self, error: OSError):
        closed = error.errno == errno.EPIPE
        super().__init__("" if closed else f"stdout: cannot be written ({error.strerror})")
        self.code = CLOSED if closed else 1


class _Stream(io.FileIO):
    """A standard stream. After its first failure everything goes nowhere, so that the end of the process is quiet."""

    def write(self, data) -> int | None:
        try:
            return super().write(data)
        except OSError as error:
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, self.fileno())
            os.close(nowhere)
            if self.fileno() == 1:
                raise StdoutError(error) from None
            return len(data)


def prepare() -> None:
    """Replace the standard streams of this process; characters that they cannot show are written as escapes."""
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            # If a stream is closed at the start, the next opened file takes its number. This one cannot be written.
            os.open(os.devnull, os.O_RDONLY)
    # Where a caller of `main` collects the output, its streams stay.
    if sys.stdout is sys.__stdout__:
        sys.stdout = _text(1, sys.stdout)
    if sys.stderr is sys.__stderr__:
        sys.stderr = _text(2, sys.stderr)


def _text(number: int, before: io.TextIOBase | None) -> io.TextIOWrapper:
    """Return the text stream of a file descriptor, with the encoding of the stream before."""
    file = _Stream(number, "w", closefd=False)
    by_line = number == 2 or file.isatty()
    encoding = before.encoding if before else "utf-8"
    return io.TextIOWrapper(io.BufferedWriter(file), encoding, "backslashreplace", line_buffering=by_line)
