"""The files of constraints/ are what the descriptions of the boards give, and the core is one that FuseSoC takes."""

import shutil
import subprocess
import sys
from importlib.resources import files
from pathlib import Path

import pytest

from hardwall.sim.boards.description import BOARDS
from hardwall.sim.boards.generated import CORE
from hardwall.sim.boards.generated import files as generated
from support.own_flow import CLOCKS_HZ

FOLDER = Path(str(files("hardwall.constraints")))


def test_the_committed_files_are_the_generated_ones():
    found = {path.name: path.read_text() for path in FOLDER.iterdir() if path.is_file() and path.suffix != ".py"}
    assert found == generated(CLOCKS_HZ), "make constraints writes them anew"


@pytest.mark.parametrize("board", BOARDS.values(), ids=BOARDS)
def test_fusesoc_takes_the_core_and_calls_the_placer_as_this_project_does(board, tmp_path):
    core = tmp_path / "core"
    shutil.copytree(FOLDER, core)
    (core / "board.v").write_text("module board; endmodule\n")
    words = [
        "--cores-root",
        str(core),
        "run",
        "--setup",
        "--work-root",
        str(tmp_path / "work"),
        f"--target={board.name}",
    ]
    done = subprocess.run(
        [sys.executable, "-m", "fusesoc.main", *words, "hardwall:haptics:board"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "ERROR" not in done.stderr
    calls = (tmp_path / "work/Makefile").read_text().splitlines()
    placer = next(line for line in calls if "nextpnr" in line and "--gui" not in line)
    assert " ".join(board.part.nextpnr[1:]) in placer
    assert f"--freq {CLOCKS_HZ[board.name] / 1e6:g}" in placer
    assert f"{board.family}{board.part.suffixes.pins}" in placer
    assert (FOLDER / CORE).exists()
