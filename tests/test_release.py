"""A release: the same bytes twice, whole sums, and files that can be used. `make release` makes it with the pages."""

import subprocess
import tarfile
from pathlib import Path

import pytest

from hardwall.sim.rtl.verilator import environment
from support import release
from support.archives import ROOT, normalise
from support.once import once

SCENE = "mhz"


EXTRAS = "host", "sim", "testing"
"""Place and route is not among the tests' tools."""


@pytest.fixture(scope="module")
def first(tmp_path_factory, distributions) -> Path:
    """Return the folder of a release with one scene and without pages."""
    return once(
        tmp_path_factory,
        "release",
        lambda folder: release.made(folder, [SCENE], [], False, EXTRAS, distributions),
    )


def test_two_runs_make_the_same_bytes(first, tmp_path):
    # The wheel and the sdist of the second are built anew, too.
    release.made(tmp_path, [SCENE], [], with_pages=False, extras=EXTRAS)
    files, again = ({path.name: path.read_bytes() for path in folder.iterdir()} for folder in (first, tmp_path))
    assert len(files) == 5
    assert files == again


def test_the_bitstreams_of_the_boards_are_in_an_archive(distributions, tmp_path, monkeypatch):
    def run(*command):
        """Stand in for place and route."""
        _, task, board, _, folder = command
        assert task == "board"
        folder.mkdir(parents=True)
        (folder / "board.bit").write_text(board)

    monkeypatch.setattr(release, "_run", run)
    release.made(tmp_path, [], ["icebreaker", "tangnano9k"], False, ("host",), distributions)
    (archive,) = tmp_path.glob("*-boards.tar.gz")
    with tarfile.open(archive) as tar:
        files = {member.name.partition("/")[2]: tar.extractfile(member).read() for member in tar if member.isfile()}
    assert files == {f"{board}/board.bit": board.encode() for board in ("icebreaker", "tangnano9k")}
    assert archive.name in (tmp_path / release.SUMS).read_text()


def test_an_archive_is_the_same_whatever_wrote_it(tmp_path):
    found = set()
    for owner, time_s, names in ((0, 1, "ab"), (7, 2, "ba")):
        with tarfile.open(tmp_path / "a.tar", "w") as tar:
            for name in names:
                member = tarfile.TarInfo(name)
                member.uid, member.mtime = owner, time_s
                tar.addfile(member)
        normalise(tmp_path / "a.tar")
        found.add((tmp_path / "a.tar").read_bytes())
    assert len(found) == 1


def test_the_sums_are_those_of_every_file(first):
    check = ["sha256sum", "--check", "--strict", release.SUMS]
    done = subprocess.run(check, cwd=first, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout.count(": OK\n")) == (0, 4), done.stderr


def test_the_verilog_is_unpacked_and_read_by_a_simulator(first, tmp_path):
    (archive,) = first.glob("*-verilog.tar.gz")
    with tarfile.open(archive) as tar:
        tar.extractall(tmp_path, filter="data")
    files = sorted(tmp_path.glob(f"*/{SCENE}/*.v"))
    assert files
    lint = ["verilator", "--lint-only", "-Wall", str(ROOT / "sim/rtl/lint.vlt")]
    for file in files:
        done = subprocess.run([*lint, file.name], cwd=file.parent, env=environment(), capture_output=True, check=False)
        assert done.returncode == 0, done.stderr


def test_every_package_has_its_licence(first):
    lines = (first / release.LICENCES).read_text().splitlines()
    assert any(line.startswith("numpy ") and "BSD" in line for line in lines)
    assert len(lines) > 60
