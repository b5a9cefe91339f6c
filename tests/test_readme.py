"""The README stays true: its example runs, its commands exist, and what it names is there."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
TEXT = (ROOT / "README.md").read_text()


def test_the_ten_line_example_prints_what_the_readme_says():
    code, printed = re.search(r"```python\n(.*?)```\n\n.*?```\n(.*?)```", TEXT, re.DOTALL).groups()
    assert len(code.strip().splitlines()) <= 16
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == printed


@pytest.mark.parametrize("command", sorted(set(re.findall(r"^hardwall (\w+)", TEXT, re.MULTILINE))))
def test_every_command_of_the_readme_exists(command):
    subprocess.run([Path(sys.executable).with_name("hardwall"), command, "--help"], capture_output=True, check=True)


def test_every_make_target_of_the_readme_exists():
    targets = set(re.findall(r"^(\w+):", (ROOT / "Makefile").read_text(), re.MULTILINE))
    assert set(re.findall(r"`make (\w+)`", TEXT)) <= targets


def test_every_file_that_the_readme_names_exists():
    named = re.findall(r"`((?:hdl|model|sim|tests|constraints)/[\w./-]*)`", TEXT)
    assert named
    assert [name for name in named if not (ROOT / name).exists()] == []
