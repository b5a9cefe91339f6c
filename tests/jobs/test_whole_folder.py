"""Folders that are made whole: once, checked before use, made again when damaged, and without a place to keep them."""

import multiprocessing
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from hardwall.model.runtime import build_folder
from hardwall.sim.jobs import whole_folder as module
from hardwall.sim.jobs.whole_folder import LIST, keep_log, whole_folder
from support.processes import line, started

TEXTS = {"library.so": "machine code" * 1000, "axis.v": "module axis; endmodule"}


def fill(folder: Path) -> None:
    """Make the content of the folder."""
    (folder / "obj").mkdir()
    for name, text in {**TEXTS, "obj/notes": "more"}.items():
        (folder / name).write_text(text)


class Making:
    """A `make` that counts its calls."""

    calls = 0

    def __call__(self, folder: Path) -> None:
        self.calls += 1
        fill(folder)


def test_it_is_made_once_and_nothing_else_is_left(tmp_path):
    making, folder = Making(), tmp_path / "rtl" / "0123"
    for _ in range(2):
        assert whole_folder(folder, making) == folder
    assert making.calls == 1
    assert {path.name for path in folder.iterdir()} == {*TEXTS, "obj", LIST}
    assert list(folder.parent.iterdir()) == [folder]


@pytest.mark.skipif(shutil.which("sha256sum") is None, reason="sha256sum is not installed")
def test_the_list_is_of_the_usual_form(tmp_path):
    folder = whole_folder(tmp_path / "0123", fill)
    done = subprocess.run(["sha256sum", "--check", "--strict", LIST], cwd=folder, capture_output=True, check=False)
    assert done.returncode == 0


@pytest.mark.parametrize("name", ["library.so", "obj/notes", LIST])
@pytest.mark.parametrize(
    "damage",
    [
        lambda path: path.write_bytes(path.read_bytes()[: path.stat().st_size // 2]),
        lambda path: path.write_bytes(b""),
        lambda path: path.write_bytes(b"\xff\x00garbage"),
        lambda path: path.write_bytes(bytes([path.read_bytes()[0] ^ 1]) + path.read_bytes()[1:]),
        lambda path: path.unlink(),
    ],
    ids=["half", "empty", "garbage", "a bit", "absent"],
)
def test_what_is_not_whole_is_made_again(tmp_path, name, damage):
    making, folder = Making(), tmp_path / "0123"
    whole_folder(folder, making)
    damage(folder / name)
    assert whole_folder(folder, making) == folder
    assert (making.calls, (folder / "library.so").read_text()) == (2, TEXTS["library.so"])
    assert whole_folder(folder, making) == folder
    assert making.calls == 2
    assert list(tmp_path.iterdir()) == [folder]


def test_a_file_in_the_place_of_the_folder_is_replaced(tmp_path):
    folder = tmp_path / "0123"
    folder.write_text("not a folder")
    assert (whole_folder(folder, fill) / "library.so").read_text() == TEXTS["library.so"]


def test_what_fails_leaves_nothing(tmp_path):
    def fail(folder: Path) -> None:
        fill(folder)
        raise RuntimeError("the tool failed")

    with pytest.raises(RuntimeError, match=r"^the tool failed$"):
        whole_folder(tmp_path / "0123", fail)
    assert list(tmp_path.iterdir()) == []


def test_one_that_was_whole_meanwhile_is_not_replaced(tmp_path):
    folder = tmp_path / "0123"

    def make(made: Path) -> None:
        whole_folder(folder, fill)
        self_made = folder.stat().st_ino
        fill(made)
        make.first = self_made

    whole_folder(folder, make)
    assert folder.stat().st_ino == make.first


def _make(folder: Path) -> str:
    return (whole_folder(folder, fill) / "library.so").read_text()


def test_many_processes_at_once(tmp_path):
    folder = tmp_path / "0123"
    whole_folder(folder, fill)
    (folder / "library.so").write_text("damaged")
    with multiprocessing.get_context("fork").Pool(4) as pool:
        assert set(pool.map(_make, [folder] * 40)) == {TEXTS["library.so"]}
    assert list(tmp_path.iterdir()) == [folder]


def test_without_a_place_to_keep_it_there_is_one_for_the_process(tmp_path, monkeypatch, caplog):
    monkeypatch.setattr(build_folder, "_said", set())
    (tmp_path / "file").write_text("")
    own = tmp_path / "own"
    monkeypatch.setattr(module, "_own_folder", lambda: own)
    making, folder = Making(), tmp_path / "file" / "rtl" / "0123"
    for _ in range(2):
        assert (whole_folder(folder, making) / "library.so").read_text() == TEXTS["library.so"]
    assert making.calls == 1
    assert caplog.messages == [f"{folder.parent} cannot be written (Not a directory): what this run makes is not kept"]


OWN = """
import time
from pathlib import Path
from hardwall.model.runtime import termination
from hardwall.sim.jobs import whole_folder
termination.hear_signals()
print(whole_folder.whole_folder(Path("/dev/null/rtl/0123"), lambda folder: (folder / "file").touch()), flush=True)
time.sleep({seconds})
"""


@pytest.mark.parametrize("number", [None, "SIGTERM", "SIGINT"])
def test_the_one_for_the_process_ends_with_it(tmp_path, number):
    program = OWN.format(seconds=600 if number else 0)
    with started(sys.executable, "-c", program, TMPDIR=str(tmp_path)) as process:
        assert Path(line(process)).is_relative_to(tmp_path)
        if number:
            process.send_signal(signal.Signals[number])
        process.wait()
    assert list(tmp_path.iterdir()) == []


def test_a_log_is_kept_wherever_possible(tmp_path, monkeypatch):
    assert keep_log(tmp_path / "rtl" / "failed.log", "why").read_text() == "why"
    monkeypatch.setattr(module.tempfile, "tempdir", str(tmp_path))
    (tmp_path / "file").write_text("")
    log = keep_log(tmp_path / "file" / "failed.log", "why")
    assert (log.name, log.read_text()) == ("failed.log", "why")
