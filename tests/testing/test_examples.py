"""The bench outside the checkout: a custom block passes, and a wrong block leaves its seed and waveform."""

import re
import shlex
import shutil
import sys
from pathlib import Path

import pylibfst
import pytest

from stimuli.lengths import LONG
from support.outside import run

EXAMPLES = Path(__file__).absolute().parents[2] / "docs/examples"
pytestmark = pytest.mark.rtl


@pytest.fixture
def outside(tmp_path: Path) -> Path:
    """Return a folder with the example's two files and nothing else."""
    for path in EXAMPLES.glob("*moving_average.py"):
        shutil.copy(path, tmp_path)
    return tmp_path


def signals(waveform: Path) -> set[str]:
    """Return the names of the signals in a waveform."""
    reader = pylibfst.lib.fstReaderOpen(str(waveform).encode())
    try:
        _, by_name = pylibfst.get_scopes_signals2(reader)
        return {name.split(" ")[0] for name in by_name.by_name}
    finally:
        pylibfst.lib.fstReaderClose(reader)


def test_a_block_outside_the_checkout_is_held_to_its_model(outside):
    done = run(outside, [sys.executable, "-m", "pytest", "-q"], HARDWALL_SAMPLES="2000")
    assert done.returncode == 0, done.stdout + done.stderr
    assert "1 passed" in done.stdout
    assert len(list(outside.glob("build/cocotb/moving_average-*/results-*.xml"))) == 1


def test_a_wrong_block_leaves_its_seed_and_its_waveform(outside):
    block = outside / "moving_average.py"
    block.write_text(block.read_text().replace("sum(before)) >> 2", "sum(before)) >> 2) ^ (self.sample == -1)"))
    block.write_text(block.read_text().replace("self.mean.eq((", "self.mean.eq((("))
    done = run(outside, [sys.executable, "-m", "pytest", "-q"], HARDWALL_SAMPLES="2000", HARDWALL_SEED="7")
    assert done.returncode == 1
    said = re.findall(r"^FAILED .*", done.stdout, re.M)
    assert len(said) == 1, done.stdout
    found = re.search(
        r"follows_its_model failed: mean differs at \d+ of 2013 samples, first at 11: RTL .*, "
        r"inputs {'sample': -1}; seed 7, waveform at (build/cocotb/\S+\.fst), again: (.*)$",
        done.stdout,
        re.M,
    )
    waveform = outside / found[1]
    assert any(name.endswith("mean") for name in signals(waveform))
    # The message gives a shell command with the number of samples of this run.
    assert found[2].startswith("HARDWALL_SEED=7 HARDWALL_SAMPLES=2000 ")
    if LONG:
        again = run(outside, ["env", *shlex.split(found[2])])
        assert found[0] in again.stdout
