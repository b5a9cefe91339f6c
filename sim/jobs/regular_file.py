"""Files that are read whole: regular ones, of a bounded size."""

import errno
import os
import stat
from pathlib import Path


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
        with open(descriptor, "rb", closefd=False) as file:
            content = file.read(most + 1)
    finally:
        os.close(descriptor)
    if len(content) > most:
        raise OSError(errno.EFBIG, f"it has more than {most / 1e6:g} MB", str(path))
    return content
