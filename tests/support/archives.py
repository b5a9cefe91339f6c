"""Archives that are the same bytes whenever, wherever and by whomever they are made."""

import gzip
import io
import subprocess
import tarfile
from pathlib import Path

ROOT = Path(__file__).absolute().parents[2]
WITHOUT_GIT_S = 315_532_800
"""The time of files without a commit, in s: 1980, the first that a wheel can have."""


def commit_time_s() -> int:
    """Return the time of the commit, in s since 1970."""
    command = ["git", "log", "-1", "--format=%ct"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    return int(done.stdout) if done.returncode == 0 else WITHOUT_GIT_S


def normalise(archive: Path) -> None:
    """Write an archive anew: members by name, without owners, with the commit's time and modes of no umask."""
    time_s = commit_time_s()
    with tarfile.open(archive) as tar:
        members = [(member, tar.extractfile(member)) for member in sorted(tar, key=lambda member: member.name)]
        contents = [(member, file.read() if file else b"") for member, file in members]
    with (
        archive.open("wb") as raw,
        gzip.GzipFile("", "wb", mtime=time_s, fileobj=raw) as packed,
        tarfile.open(fileobj=packed, mode="w", format=tarfile.PAX_FORMAT) as tar,
    ):
        for member, content in contents:
            plain = tarfile.TarInfo(member.name)
            plain.type, plain.linkname, plain.size, plain.mtime = member.type, member.linkname, len(content), time_s
            plain.mode = 0o755 if member.isdir() or member.mode & 0o100 else 0o644
            tar.addfile(plain, io.BytesIO(content))
