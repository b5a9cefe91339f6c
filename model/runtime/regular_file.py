"""Files that are read whole: regular ones, of a bounded size."""

import errno
import os
import stat
from collections.abc import Iterator
from pathlib import Path

PIECE = 1 << 20
"""The most bytes of one read: a read takes as much memory as it may return, however little there is."""


def content_of(path: str | Path, most: int) -> bytes:
    """Return the content of a regular file.

    A pipe would wait for its writer, and a device may have no end, so that neither is read.

    Raises:
        OSError: if there is no such file, it cannot be read, is no regular file or has more than `most` bytes.
    """
    # Without this flag, opening a pipe waits until somebody writes to it.
    descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
    try:
        if not stat.S_ISREG(os.fstat(descriptor).st_mode):
            raise OSError(errno.EINVAL, "it is not a regular file", str(path))
        content = b"".join(_pieces(descriptor, most))
    finally:
        os.close(descriptor)
    if len(content) > most:
        raise OSError(errno.EFBIG, f"it has more than {most / 1e6:g} MB", str(path))
    return content


def _pieces(descriptor: int, most: int) -> Iterator[bytes]:
    """Yield the pieces of a file in their order, until its end or until they have more than `most` bytes."""
    while most >= 0 and (piece := os.read(descriptor, min(PIECE, most + 1))):
        most -= len(piece)
        yield piece
