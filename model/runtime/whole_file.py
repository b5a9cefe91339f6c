"""Files that are written completely or not at all."""

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

unfinished: set[Path] = set()
"""The temporary files that are being written, for a process that ends in the middle of its work to remove."""


@contextmanager
def whole_file(path: str | Path) -> Iterator[Path]:
    """Provide a temporary file beside `path` to write to; rename it to `path` once it is complete.

    A `path` that is a symbolic link stays one: the file that it leads to is written.

    Raises:
        OSError: if the file cannot be written; the message is one line and names the file, `strerror` is the reason.
    """
    whole = Path(os.path.realpath(path))
    part = whole.with_name(f".part-{os.urandom(8).hex()}{whole.suffix}")
    unfinished.add(part)
    try:
        yield part
        part.replace(whole)
    except OSError as error:
        reason = error.strerror or str(error)
        failure = OSError(f"{path}: cannot be written ({reason})")
        failure.strerror = reason
        raise failure from None
    finally:
        with suppress(OSError):
            part.unlink(missing_ok=True)
        unfinished.discard(part)
