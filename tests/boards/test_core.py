"""The core of a board is one that FuseSoC takes, and its flow places as this project does."""

import subprocess
import sys
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import pytest

from hardwall.model.runtime import extras
from hardwall.sim.boards.core import CORE, core
from hardwall.sim.boards.description import BOARDS, Description
from support.own_flow import CLOCKS_HZ


def in_fusesoc(board: Description, tmp_path: Path, name: str) -> str:
    """Set a core up in FuseSoC by its name; return the makefile of its flow."""
    folder, clock_hz = tmp_path / "core", CLOCKS_HZ[board.name]
    folder.mkdir()
    pins = f"{board.family}{board.part.suffixes.pins}"
    for file, text in (
        ("board.v", ""),
        ("top.v", "module top; endmodule\n"),
        (pins, ""),
        (CORE, core(board, clock_hz)),
    ):
        (folder / file).write_text(text)
    words = ["--cores-root", str(folder), "run", "--setup", "--work-root", str(tmp_path / "work")]
    done = subprocess.run(
        [sys.executable, "-m", "fusesoc.main", *words, name],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "ERROR" not in done.stderr
    return (tmp_path / "work/Makefile").read_text()


@pytest.mark.parametrize("board", BOARDS.values(), ids=BOARDS)
def test_fusesoc_takes_the_core_and_calls_the_placer_as_this_project_does(board, tmp_path):
    calls = in_fusesoc(board, tmp_path, f"hardwall:haptics:{board.name}:{version('hardwall')}").splitlines()
    placer = next(line for line in calls if "nextpnr" in line and "--gui" not in line)
    assert " ".join(board.part.nextpnr[1:]) in placer
    assert f"--freq {CLOCKS_HZ[board.name] / 1e6:g}" in placer
    assert f"{board.family}{board.part.suffixes.pins}" in placer


def test_the_core_of_a_copied_folder_has_no_version(tmp_path, monkeypatch):
    """Such a folder has no metadata."""

    def absent(name: str) -> str:
        raise PackageNotFoundError(name)

    monkeypatch.setattr(extras, "version", absent)
    in_fusesoc(BOARDS["icebreaker"], tmp_path, "hardwall:haptics:icebreaker")
    assert "\nname: hardwall:haptics:icebreaker:0\n" in (tmp_path / "core" / CORE).read_text()
