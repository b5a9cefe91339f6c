"""The written Verilog in a cocotb project that has no bench of ours: the example of the page."""

import shutil
import sys
from pathlib import Path

import pytest

from hardwall.sim.rtl.verilator import environment
from stimuli.lengths import LONG
from support.command_line import call
from support.outside import run

EXAMPLE = Path(__file__).absolute().parents[2] / "docs/examples/plain_cocotb/test_axis.py"


@pytest.mark.rtl
@pytest.mark.parametrize("simulator", ["verilator", "icarus"])
def test_each_sample_has_the_words_of_the_model(simulator, tmp_path, monkeypatch, capsys):
    if simulator == "icarus" and not shutil.which("iverilog"):
        pytest.skip("iverilog is not installed")
    shutil.copy(EXAMPLE, tmp_path)
    monkeypatch.chdir(tmp_path)
    assert call(monkeypatch, capsys, "verilog", "mhz", "-o", "rtl")[0] == 0
    command = [sys.executable, "-m", "pytest", "-q", "-n", "0", "test_axis.py"]
    given = {name: value for name, value in environment().items() if not name.startswith(("HARDWALL_", "PY", "COCOTB"))}
    # 400 samples are simulated: what is soon compiled is soon done.
    given["MAKEFLAGS"] += " OPT_FAST=-O0 OPT_SLOW=-O0 OPT_GLOBAL=-O0"
    done = run(tmp_path, command, **given, SIM=simulator)
    assert (done.returncode, "1 passed" in done.stdout) == (0, True), done.stdout
    if not LONG:
        return
    # A wrong word is seen.
    test = tmp_path / "test_axis.py"
    test.write_text(test.read_text().replace("**AXIS.words}", '**AXIS.words, "wall_damping": 0}'))
    done = run(tmp_path, command, **given, SIM=simulator)
    assert (done.returncode, "1 failed" in done.stdout) == (1, True), done.stdout
