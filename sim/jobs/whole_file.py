"""Files that are written whole or not at all."""

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path


@contextmanager
def whole_file(path: str | Path) -> Iterator[Path]:
    """Give a file beside `path` to write to; put it in the place of `path` once it is whole.

    Raises:
        OSError: in one line, if that cannot be done.
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
