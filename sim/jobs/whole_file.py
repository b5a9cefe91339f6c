"""Files that are written completely or not at all."""

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path


@contextmanager
def whole_file(path: str | Path) -> Iterator[Path]:
    """Provide a temporary file beside `path` to write to; rename it to `path` once it is complete.

    Raises:
        OSError: if the file cannot be written; the message is one line.
    """
    part = Path(path).with_name(f".{Path(path).stem}-{os.getpid()}{Path(path).suffix}")
    try:
        yield part
        part.replace(path)
    except OSError as error:
        raise OSError(f"{path}: cannot be written ({error.strerror or error})") from None
    finally:
        with suppress(OSError):
            part.unlink(missing_ok=True)
