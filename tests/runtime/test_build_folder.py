"""The build folder: where it is, and one line when nothing can be kept there."""

import multiprocessing
import os
import subprocess
import sys
from pathlib import Path

import pytest

from hardwall.model.runtime import build_folder
from hardwall.model.runtime.build_folder import (
    SHOWN_MAX,
    BuildFolderError,
    build_dir,
    folder_of_tools,
    home_for_tools,
    not_kept,
    shown_path,
)

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
    with pytest.raises(
        BuildFolderError, match=r"^HARDWALL_BUILD must not begin with the home of an unknown user: '~nobody"
    ):
        build_dir()


NO_HOME = """
import os.path
os.path.expanduser = lambda path: path
from hardwall.model.runtime import build_folder
build_folder.__file__ = "/nowhere/hardwall/model/runtime/build_folder.py"
first = build_folder.build_dir()
assert first.is_dir() and build_folder.build_dir() == first == build_folder.folder_of_tools()
print(first)
"""


@pytest.mark.parametrize("home", [None, "", "home"], ids=["unknown", "empty", "relative"])
def test_a_user_without_a_home_has_a_folder_until_the_end(home, tmp_path):
    unset = ("HARDWALL_BUILD", "XDG_CACHE_HOME", "HOME")
    environ = {name: value for name, value in os.environ.items() if name not in unset}
    environ |= {} if home is None else {"HOME": home}
    command = [sys.executable, "-c", NO_HOME]
    done = subprocess.run(command, env=environ, cwd=tmp_path, capture_output=True, text=True, check=True)
    assert not Path(done.stdout.strip()).exists()
    (line,) = done.stderr.splitlines()
    assert line.startswith("there is no home folder: what this run makes is not kept")
    assert list(tmp_path.iterdir()) == []


@pytest.fixture
def caches(tmp_path, monkeypatch) -> tuple[Path, Path]:
    """Return a home and a build folder that tools may use."""
    home, build = tmp_path / "home", tmp_path / "build"
    home.mkdir()
    monkeypatch.setenv("HOME", str(home))
    monkeypatch.setenv("HARDWALL_BUILD", str(build))
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    return home, build


def test_a_tool_keeps_what_it_compiles_below_the_home(caches, tmp_path, monkeypatch):
    home, _ = caches
    assert home_for_tools() == {"XDG_CACHE_HOME": str(home / ".cache")}
    assert (home / ".cache").is_dir()
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setenv("HOME", str(tmp_path / "absent"))
    assert home_for_tools() == {"XDG_CACHE_HOME": str(tmp_path / "cache")}


def test_a_relative_cache_has_no_effect(caches, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_CACHE_HOME", "cache")
    monkeypatch.delenv("HARDWALL_BUILD")
    monkeypatch.setattr(build_folder, "__file__", str(tmp_path / "hardwall" / "model" / "build_folder.py"))
    assert home_for_tools() == {"XDG_CACHE_HOME": str(caches[0] / ".cache")}
    assert build_dir() == caches[0] / ".cache" / "hardwall"
    assert not Path("cache").exists()


UNUSABLE = {
    "absent": "{0}/absent",
    "relative": "home",
    "empty": "",
    "in /proc": "/proc/x",
    "closed": "/proc",
    "a file": "{0}/file",
}


@pytest.mark.parametrize("home", UNUSABLE.values(), ids=UNUSABLE)
def test_a_home_that_takes_no_files_is_replaced_and_not_made(caches, tmp_path, monkeypatch, home):
    (tmp_path / "file").touch()
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("HOME", home.format(tmp_path))
    build = caches[1]
    assert home_for_tools() == {"HOME": str(build), "XDG_CACHE_HOME": str(build / ".cache")}
    assert {path.name for path in tmp_path.iterdir()} == {"home", "build", "file"}
    assert list(caches[0].iterdir()) == []


@pytest.mark.parametrize("closed", [".cache", ".cache/wasmtime", ".cache/YoWASP"])
def test_a_cache_that_cannot_be_written_is_replaced(caches, monkeypatch, closed):
    home, build = caches
    (home / ".cache" / "wasmtime").mkdir(parents=True)
    (home / ".cache" / "YoWASP").mkdir()
    # As root, every folder can be written.
    access = os.access
    monkeypatch.setattr(os, "access", lambda path, mode: Path(path) != home / closed and access(path, mode))
    assert home_for_tools()["HOME"] == str(build)


def test_where_nothing_can_be_written_tools_have_a_temporary_folder(caches, monkeypatch):
    monkeypatch.setenv("HOME", "/proc/x")
    monkeypatch.setenv("HARDWALL_BUILD", "/proc/x")
    folder = folder_of_tools()
    assert folder.is_dir()
    assert home_for_tools() == {"HOME": str(folder), "XDG_CACHE_HOME": str(folder / ".cache")}


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
