"""The token in the address of a page: new at each start, or kept for a port in a file of its user alone.

Whoever has the token may arm the board. So a token is kept only where it can be kept from others:

- The file is in the user's state folder, has the mode 0600 and belongs to the user; so must the folder, which nobody
  else may write to. A file that is anything else is not believed: it is removed, and the page has a new address.
- It is kept only for a page at this machine itself. At another address the token goes through a network without
  encryption, where a listener could learn it, and would then have it for ever.
- There is one file per port, because a page's address names its port.
"""

import ipaddress
import os
import re
import secrets
import stat
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from ...model.runtime.whole_file import whole_file

BITS = 128
FORM = re.compile(r"[A-Za-z0-9_-]{22}")
"""The form of a token of so many bits."""
OTHERS, OTHERS_WRITE = 0o077, 0o022
"""The mode bits that give others any access, and the mode bits that let others write."""


class Token(NamedTuple):
    """The token in the address of a page.

    Attributes:
        text: the token.
        file: where it is kept for the next start; None if it is of this start only.
        note: why it is not kept, or is not the kept one; empty if it is as expected.
    """

    text: str
    file: Path | None = None
    note: str = ""

    @property
    def about(self) -> str:
        """The text on the page about its address."""
        if self.file is None:
            return "This address ends with this program: the next start has another one."
        return (
            f"This address stays when the program starts again at this port. Its token is kept in {self.file}, which "
            "only your user can read. The browser's history has the address, too. Start the program with --new-token "
            "if somebody else may have seen it: then this address ends. While no program of yours has this port, "
            "another user of this computer can take the port, and learn the address from a tab that is still open. "
            "So close the tabs first, or start with --new-token, where others use this computer."
        )


def new_token(note: str = "") -> Token:
    """Return a token that nobody has had."""
    return Token(secrets.token_urlsafe(BITS // 8), note=note)


def is_of_this_machine(address: str) -> bool:
    """Return whether an address of numbers can be reached from this machine only."""
    return ipaddress.ip_address(address.partition("%")[0]).is_loopback


def kept_token(port: int, renew: bool = False) -> Token:
    """Return the token kept for a port, or a new one, kept from now on.

    A folder that cannot be had, or is not the user's alone, is no error: the token is of this start only, and `note`
    says why.

    Args:
        port: the port of the page.
        renew: whether what is kept is replaced.
    """
    token = new_token()
    try:
        folder = _state_folder()
        file = folder / f"panel-{port}.token"
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        if not _is_ours(folder.stat(), OTHERS_WRITE):
            return token._replace(note=f"its address is not kept: others may write to {folder}")
        kept = None if renew else _kept(file)
        if kept:
            return Token(kept, file)
        note = f"{file} was no token of yours alone: the page has a new address" if file.exists() and not renew else ""
        _keep(file, token.text)
        return Token(token.text, file, note)
    except (OSError, RuntimeError) as error:
        # A user may have no home.
        return token._replace(note=f"its address is not kept: {getattr(error, 'strerror', None) or error}")


def _state_folder() -> Path:
    """Return the folder for what a program of this user keeps between two starts."""
    given = os.environ.get("XDG_STATE_HOME", "")
    return (Path(given) if os.path.isabs(given) else Path.home() / ".local" / "state") / "hardwall"


def _is_ours(found: os.stat_result, barred: int) -> bool:
    """Return whether a file or folder belongs to this user, and none of some bits is in its mode."""
    # Where there are no such users, a folder of a user is the user's alone.
    return not hasattr(os, "geteuid") or (found.st_uid == os.geteuid() and not found.st_mode & barred)


def _kept(file: Path) -> str | None:
    """Return the token in a file; None if there is none, or others may have it."""
    # No link is followed, and a file that is none does not hold the program up.
    flags = os.O_RDONLY | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)
    with suppress(OSError), open(os.open(file, flags), "rb") as opened:
        found = os.fstat(opened.fileno())
        if stat.S_ISREG(found.st_mode) and _is_ours(found, OTHERS):
            text = opened.read(64).decode("ascii", "replace").strip()
            return text if FORM.fullmatch(text) else None
    return None


def _keep(file: Path, text: str) -> None:
    """Write a token into a file of its own; what was there before is removed, and no link is followed."""
    file.unlink(missing_ok=True)
    with whole_file(file) as part, open(os.open(part, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w") as opened:
        opened.write(f"{text}\n")
