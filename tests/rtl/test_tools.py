"""The tools that make a bitstream: what one leaves when it is ended."""

import sys
from pathlib import Path

import pytest

from hardwall.sim.rtl import tools

ENDED = """#!{python}
import os, signal, sys, tempfile
print(tempfile.mkdtemp(prefix="yowasp_"), file=sys.stderr, flush=True)
os.kill(os.getpid(), signal.SIGKILL)
"""


def test_a_tool_that_is_ended_leaves_no_folder(tmp_path, monkeypatch):
    work, others = tmp_path / "work", tmp_path / "others"
    work.mkdir()
    others.mkdir()
    (tmp_path / "tool").write_text(ENDED.format(python=sys.executable))
    (tmp_path / "tool").chmod(0o755)
    monkeypatch.setattr(tools, "TOOLS", tmp_path)
    monkeypatch.setenv("TMPDIR", str(others))
    monkeypatch.setenv("HARDWALL_BUILD", str(tmp_path / "build"))
    with pytest.raises(tools.SynthesisError, match=r"^it failed: exit code -9; see "):
        tools.run(work, work / "log", ["tool"], "it")
    assert Path((work / "log").read_text().strip()).parent == work / "tmp"
    assert [path.name for folder in (work, others) for path in folder.iterdir()] == ["log"]
