"""The core of a board is one that FuseSoC takes, and its flow places as this project does."""

import subprocess
import sys

import pytest

from hardwall.sim.boards.core import CORE, core
from hardwall.sim.boards.description import BOARDS
from support.own_flow import CLOCKS_HZ


@pytest.mark.parametrize("board", BOARDS.values(), ids=BOARDS)
def test_fusesoc_takes_the_core_and_calls_the_placer_as_this_project_does(board, tmp_path):
    folder, clock_hz = tmp_path / "core", CLOCKS_HZ[board.name]
    folder.mkdir()
    pins = f"{board.family}{board.part.suffixes.pins}"
    for name, text in (
        ("board.v", ""),
        ("top.v", "module top; endmodule\n"),
        (pins, ""),
        (CORE, core(board, clock_hz)),
    ):
        (folder / name).write_text(text)
    words = ["--cores-root", str(folder), "run", "--setup", "--work-root", str(tmp_path / "work")]
    done = subprocess.run(
        [sys.executable, "-m", "fusesoc.main", *words, f"hardwall:haptics:{board.name}"],
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
    assert f"--freq {clock_hz / 1e6:g}" in placer
    assert pins in placer
