"""Files that are written completely or not at all."""

import errno
import os
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

unfinished: set[Path] = set()
"""The temporary files under way; a process that is ended in the middle of its work removes them."""


class NotWrittenError(OSError):
    """A file cannot be written; the message is one line and names the file, `strerror` is the reason."""


@contextmanager
def whole_file(path: str | Path) -> Iterator[Path]:
    """Provide a temporary file beside `path` to write to; rename it to `path` once it is complete.

    If `path` is a symbolic link it stays one: its target is written.

    Raises:
        NotWrittenError: if the file cannot be written, or something cannot while it is open.
    """
    whole = Path(os.path.realpath(path))
    part = whole.with_name(f".part-{os.urandom(8).hex()}{whole.suffix}")
    unfinished.add(part)
    try:
        if whole.is_dir():
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
        yield part
        part.replace(whole)
    except NotWrittenError:
        # That of another file: several may be open.
        raise
    except OSError as error:
        reason = error.strerror or str(error)
        failure = NotWrittenError(f"{path}: cannot be written ({reason})")
        failure.strerror = reason
        raise failure from None
    finally:
        with suppress(OSError):
            part.unlink(missing_ok=True)
        unfinished.discard(part)


def write_files(folder: Path, texts: Mapping[str, str]) -> tuple[Path, ...]:
    """Write several files in UTF-8 into a folder, all of them or none; return their paths.

    No file gets its name before all are complete. So a full disk, or a folder with the name of the file, leaves the old
    file as it was.

    Args:
        folder: an existing folder.
        texts: the text of every file by its name.

    Raises:
        NotWrittenError: if a file cannot be written.
    """
    with ExitStack() as files:
        for name, text in texts.items():
            part = files.enter_context(whole_file(folder / name))
            part.write_text(text, encoding="utf-8", newline="\n")
    return tuple(folder / name for name in texts)
