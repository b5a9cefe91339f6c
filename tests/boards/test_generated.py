"""The files of constraints/ are what the descriptions of the boards give."""

from importlib.resources import files
from pathlib import Path

from hardwall.sim.boards.generated import files as generated
from support.own_flow import CLOCKS_HZ

FOLDER = Path(str(files("hardwall.constraints")))


def test_the_committed_files_are_the_generated_ones():
    found = {path.name: path.read_text() for path in FOLDER.iterdir() if path.is_file() and path.suffix != ".py"}
    assert found == generated(CLOCKS_HZ), "make constraints writes them anew"
