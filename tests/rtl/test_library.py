"""The cache of built axes: checked before use, and built again when damaged; builds that cannot be, and early ends."""

import signal
import subprocess
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import pytest

from hardwall.model.runtime.build_folder import build_dir
from hardwall.sim.rtl import library, shared_library
from hardwall.sim.rtl.shared_library import LIBRARY, Recipe
from hardwall.sim.rtl.verilator import BuildError
from stimuli.specs import spec
from support.processes import HARDWALL, ended, session, started, wait_until

CODE = b"machine code" * 1000


@pytest.fixture
def builds(tmp_path, monkeypatch) -> list[Path]:
    """Set up a stand-in for Verilator and an empty build folder; return the list of its calls."""
    calls = []

    def verilate(recipe: Recipe, rules: str, work: Path) -> None:
        calls.append(work)
        for name, text in recipe.files.items():
            (work / name).write_text(text)
        (work / LIBRARY).write_bytes(CODE)

    monkeypatch.setattr(shared_library, "_verilate", verilate)
    monkeypatch.setenv("HARDWALL_BUILD", str(tmp_path / "build"))
    return calls


def test_an_axis_is_built_once_for_every_way_to_build_it(builds):
    ways = [{}, {"short": True}, {"traced": True}]
    paths = {library.build(spec("mhz"), **way) for way in ways for _ in range(2)}
    assert len(paths) == len(builds) == len(ways)


@pytest.mark.parametrize("content", [CODE[: len(CODE) // 2], b"", b"garbage"], ids=["half", "empty", "garbage"])
def test_a_damaged_library_is_built_again(builds, content):
    path = library.build(spec("mhz"))
    path.write_bytes(content)
    assert library.build(spec("mhz")) == path
    assert path.read_bytes() == CODE
    assert len(builds) == 2


def test_the_verilog_of_an_axis_is_made_once(builds, monkeypatch):
    made = []
    monkeypatch.setattr(library, "to_verilog", lambda *_: made.append(1) or "module axis; endmodule")
    axis = spec("mhz", "kalman")
    for short in (False, True):
        library.build(axis, short=short)
    assert (len(made), len(builds)) == (1, 2)
    library._sources.cache_clear()


def test_a_build_has_the_rules_that_its_name_tells(tmp_path, monkeypatch):
    """The digest in the name of the library's folder, and the build, take the rules from one reading."""
    rules, built = tmp_path / "library.mk", []

    def whole_folder(folder: Path, make: Callable[[Path], None]) -> None:
        rules.write_text("second")
        (tmp_path / "work").mkdir()
        make(tmp_path / "work")

    def run(*_: object, cwd: Path, **__: object) -> None:
        built.append((cwd / rules.name).read_text())
        raise OSError

    rules.write_text("first")
    for name, stand_in in (("RULES", rules), ("whole_folder", whole_folder), ("children", SimpleNamespace(run=run))):
        monkeypatch.setattr(shared_library, name, stand_in)
    with pytest.raises(BuildError):
        shared_library.build(Recipe({"a.v": ""}, "a.cpp", "A", ()))
    assert built == ["first"]


def test_a_tool_that_is_not_there_is_named(tmp_path, monkeypatch):
    monkeypatch.setenv("HARDWALL_BUILD", str(tmp_path))
    monkeypatch.setattr(shared_library, "environment", lambda: {"PATH": str(tmp_path)})
    with pytest.raises(BuildError, match=r"^verilator cannot be run: No such file or directory$"):
        library.build(spec("mhz"))


def test_a_build_that_fails_says_the_first_error(tmp_path, monkeypatch):
    monkeypatch.setenv("HARDWALL_BUILD", str(tmp_path / "build"))
    wrong = Recipe({"a.v": "module a;\n  wire;\nendmodule\n"}, "a.cpp", "A", ())
    with pytest.raises(BuildError, match=r"built: %Error: a\.v:2:7: syntax error.*; see .*failed\.log$"):
        shared_library.build(wrong)


@pytest.mark.parametrize("letter", [" ", "\n", "\t", *"$:#%;&|<>()[]{}*?!~^`'\"\\"])
def test_a_path_that_make_cannot_read_is_one_line_before_anything_runs(tmp_path, monkeypatch, letter):
    monkeypatch.setattr(subprocess, "run", None)
    monkeypatch.setenv("HARDWALL_BUILD", str(tmp_path / f"a{letter}b"))
    with pytest.raises(BuildError) as caught:
        library.build(spec("mhz"))
    message = str(caught.value)
    told = f"the path of the build folder ($HARDWALL_BUILD) must be without {letter!r} for make, not "
    assert message.startswith(told)
    assert message.isprintable()


def building(build: Path) -> list[Path]:
    """Return the folders of unfinished builds in which Verilator has begun."""
    return [path.parent for path in build.glob("rtl/building-*/*/obj")]


@pytest.mark.parametrize("number", ["SIGINT", "SIGKILL"])
def test_a_build_that_is_ended_leaves_no_process_behind(tmp_path, number):
    (tmp_path / "numba").symlink_to(build_dir() / "numba")
    with started(HARDWALL, "hit", "--backend", "rtl", "--json", HARDWALL_BUILD=str(tmp_path)) as process:
        wait_until(lambda: building(tmp_path))
        process.send_signal(signal.Signals[number])
        wait_until(lambda: session(process) == [])
        code, out, err = ended(process)
    if number == "SIGINT":
        assert (code, out, err.splitlines()[-1]) == (130, "", "hardwall: error: interrupted")
        assert building(tmp_path) == []
    else:
        assert (code, out) == (-signal.SIGKILL, "")
