"""The build folder: where it is, and one line when nothing can be kept there."""

import multiprocessing
import os
import subprocess
import sys
from pathlib import Path

import pytest

from hardwall.model.runtime import build_folder
from hardwall.model.runtime.build_folder import SHOWN_MAX, BuildFolderError, build_dir, not_kept, shown_path

PLAIN = Path("/some/where")


@pytest.fixture(autouse=True)
def unsaid(monkeypatch):
    """Forget what this process has warned of."""
    monkeypatch.setattr(build_folder, "_said", set())


def test_the_variable_may_hold_any_path(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for path in ("plain", "a b", "a\nb", "ünï", "../x"):
        monkeypatch.setenv("HARDWALL_BUILD", path)
        assert build_dir() == tmp_path / path
    monkeypatch.setenv("HARDWALL_BUILD", "")
    assert build_dir() == Path(__file__).absolute().parents[2] / "build"


def test_an_installed_copy_has_a_folder_of_the_user(tmp_path, monkeypatch):
    monkeypatch.delenv("HARDWALL_BUILD", raising=False)
    monkeypatch.setattr(build_folder, "__file__", str(tmp_path / "hardwall" / "model" / "build_folder.py"))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    assert build_dir() == tmp_path / "cache" / "hardwall"


def test_the_variable_may_begin_with_a_home(tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("HARDWALL_BUILD", "~/x")
    assert build_dir() == tmp_path / "x"
    monkeypatch.setenv("HARDWALL_BUILD", "~nobody-of-this-name/x")
    with pytest.raises(BuildFolderError, match=r"^HARDWALL_BUILD must not begin with a home that nobody has: '~nobody"):
        build_dir()


NO_HOME = """
import pathlib
def home():
    raise RuntimeError("Could not determine home directory.")
pathlib.Path.home = home
from hardwall.model.runtime import build_folder
build_folder.__file__ = "/nowhere/hardwall/model/runtime/build_folder.py"
first = build_folder.build_dir()
assert first.is_dir() and build_folder.build_dir() == first
print(first)
"""


def test_a_user_without_a_home_has_a_folder_until_the_end():
    environ = {name: value for name, value in os.environ.items() if name not in ("HARDWALL_BUILD", "XDG_CACHE_HOME")}
    done = subprocess.run([sys.executable, "-c", NO_HOME], env=environ, capture_output=True, text=True, check=True)
    assert not Path(done.stdout.strip()).exists()
    (line,) = done.stderr.splitlines()
    assert line.startswith("there is no home folder: what this run makes is not kept")


def test_what_is_not_kept_is_said_once(caplog):
    not_kept(PLAIN, PermissionError(13, "Permission denied"))
    not_kept(PLAIN / "else", OSError(28, "No space left on device"))
    assert caplog.messages == [f"{PLAIN} cannot be written (Permission denied): what this run makes is not kept"]


def _quiet(_: int) -> set[str]:
    not_kept(PLAIN, PermissionError(13, "Permission denied"))
    return build_folder._said


def test_a_worker_says_nothing():
    with multiprocessing.get_context("fork").Pool(1) as pool:
        assert pool.map(_quiet, [0]) == [set()]


@pytest.mark.parametrize("name", ["a\nb", "a\tb", "\udcff", "\x1b[31m", "x" * 5000])
def test_a_path_is_shown_on_one_short_line(name):
    text = shown_path(PLAIN / name)
    assert text.isprintable()
    assert len(text) <= SHOWN_MAX + 3
    assert shown_path(PLAIN) == str(PLAIN)
