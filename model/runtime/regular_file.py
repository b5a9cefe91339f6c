"""Files that are read: regular ones, of a bounded size where they are read whole."""

import errno
import os
import stat
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

PIECE = 1 << 20
"""The most bytes of one read: a read takes as much memory as it may return, however little there is."""


def opened(path: str | Path) -> BinaryIO:
    """Open a regular file for reading.

    A pipe would wait for its writer, and a device may have no end, so that neither is read.

    Raises:
        OSError: if there is no such file, it cannot be read, or is no regular file.
    """
    # Without this flag, opening a pipe waits until somebody writes to it.
    descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
    try:
        if not stat.S_ISREG(os.fstat(descriptor).st_mode):
            raise OSError(errno.EINVAL, "it is not a regular file", str(path))
        return os.fdopen(descriptor, "rb", PIECE)
    except OSError:
        os.close(descriptor)
        raise


def content_of(path: str | Path, most: int) -> bytes:
    """Return the content of a regular file.

    Raises:
        OSError: if there is no such file, it cannot be read, is no regular file or has more than `most` bytes.
    """
    with opened(path) as file:
        content = b"".join(_pieces(file, most))
    if len(content) > most:
        raise OSError(errno.EFBIG, f"it has more than {most / 1e6:g} MB", str(path))
    return content


def _pieces(file: BinaryIO, most: int) -> Iterator[bytes]:
    """Yield the pieces of a file in their order, until its end or until they have more than `most` bytes."""
    while most >= 0 and (piece := file.read(min(PIECE, most + 1))):
        most -= len(piece)
        yield piece
