"""Kept kernels: found again, never run when damaged, and always of the sources as they are."""

import importlib.util
import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType

import pytest

from hardwall.model.runtime import build_folder, kernel_cache, provenance
from stimuli.lengths import LONG

ROOT = Path(__file__).absolute().parents[2]
KERNEL = """
from hardwall.model.runtime.compiled import compiled
from constants_of_a_study import FACTOR

@compiled
def scaled(number):
    return FACTOR * number
"""
WALL_IMPORT = "from hardwall.model.axis.wall import render"
LAW = """
from typing import NamedTuple
from hardwall.model.runtime.compiled import compiled
from hardwall.model.axis.wall import render

class Law(NamedTuple):
    stiffness: float

@render.register(Law)
@compiled
def law(params, count, velocity):
    return {stiffness} * params.stiffness * count
"""


def imported(path: Path) -> ModuleType:
    """Return the module of a file as a new process would import it."""
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    sys.modules[path.stem] = module
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def study(tmp_path, monkeypatch) -> Iterator[Callable]:
    """Return a function that imports a study of a user, as a new process would, from a constant and a kernel."""
    monkeypatch.setenv("HARDWALL_BUILD", str(tmp_path / "build"))
    monkeypatch.setattr(build_folder, "_said", set())
    modules = dict(sys.modules)

    def fresh(factor: int, text: str = KERNEL, name: str = "kernels") -> ModuleType:
        monkeypatch.setattr(provenance, "_seen", {})
        monkeypatch.setattr(provenance, "_changed", set())
        constants = tmp_path / "constants_of_a_study.py"
        constants.write_text(f"FACTOR = {factor}")
        imported(constants)
        (tmp_path / f"{name}_of_a_study.py").write_text(text)
        return imported(tmp_path / f"{name}_of_a_study.py")

    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    yield fresh
    for name in set(sys.modules) - set(modules):
        if name.endswith("_of_a_study"):
            del sys.modules[name]


def found(kernel) -> int:
    """Return how many variants of a kernel were found on disk."""
    return sum(kernel.stats.cache_hits.values())


def files(tmp_path: Path, suffix: str = "") -> list[Path]:
    return sorted(path for path in (tmp_path / "build").rglob(f"*{suffix}") if path.is_file())


def test_a_kernel_is_found_again(study):
    assert study(3).scaled(14) == 42
    again = study(3).scaled
    assert (again(14), found(again)) == (42, 1)
    # Other types are another variant.
    assert (again(14.5), found(again)) == (43.5, 1)
    again = study(3).scaled
    assert (again(14), again(14.5), found(again)) == (42, 43.5, 2)


DAMAGE = {
    "half": lambda data: data[: len(data) // 2],
    "empty": lambda data: b"",
    "garbage": lambda data: b"\xff\x00garbage",
    "a bit": lambda data: data[:-9] + bytes([data[-9] ^ 1]) + data[-8:],
    "another pickle": lambda data: b"\x80\x04K\x05.",
}


@pytest.mark.parametrize("suffix", [".nbi", ".nbc"])
@pytest.mark.parametrize("damage", DAMAGE.values(), ids=DAMAGE)
def test_what_was_damaged_is_compiled_again(study, tmp_path, suffix, damage):
    study(3).scaled(14)
    for path in files(tmp_path, suffix):
        path.write_bytes(damage(path.read_bytes()))
    again = study(3).scaled
    assert (again(14), found(again)) == (42, 0)
    again = study(3).scaled
    assert (again(14), found(again)) == (42, 1)


def test_a_file_that_is_gone_is_compiled_again(study, tmp_path):
    study(3).scaled(14)
    for path in files(tmp_path, ".nbc"):
        path.unlink()
    again = study(3).scaled
    assert (again(14), found(again)) == (42, 0)


def test_the_code_of_another_file_is_part_of_the_key(study):
    assert [study(factor).scaled(14) for factor in (3, 4, 3)] == [42, 56, 42]


def test_a_law_that_a_study_adds_is_part_of_the_key(study):
    """The kernel that calls the law is in a file that does not import it."""
    caller = KERNEL.replace("return FACTOR * number", "return render(number, 7, 0)") + WALL_IMPORT
    for stiffness in (2, 3, 2):
        law = study(1, LAW.format(stiffness=stiffness), "law").Law(10.0)
        calling = study(1, caller).scaled
        assert calling(law) == 70 * stiffness
    assert found(calling) == 1


def test_a_source_that_is_edited_while_it_is_in_use_has_no_key(study, tmp_path, caplog):
    scaled = study(3).scaled
    (tmp_path / "constants_of_a_study.py").write_text("FACTOR = 45")
    assert scaled(14) == 42
    assert files(tmp_path) == []
    assert caplog.messages == [
        f"{tmp_path}/constants_of_a_study.py changed while this process ran: its compiled code is not kept"
    ]
    # A new process, which sees the edit, runs it.
    assert study(45).scaled(14) == 630


def test_a_source_of_the_project_that_is_edited_meanwhile_has_no_key(monkeypatch):
    path = Path(kernel_cache.__file__)
    monkeypatch.setattr(provenance, "_changed", set())
    monkeypatch.setitem(provenance._tree(), path, b"of another content")
    monkeypatch.setattr(build_folder, "_said", {"changed"})
    assert provenance.key_of("hardwall.model.axis.wall", ()) == provenance.project_key()
    provenance.note("hardwall.model.runtime.kernel_cache")
    assert provenance.key_of("hardwall.model.axis.wall", ()) is None


def test_a_function_without_a_file_is_not_kept(study, tmp_path):
    module = study(3)
    exec("@compiled\ndef made(number):\n    return 5 * number", vars(module))
    assert module.made(7) == 35
    assert files(tmp_path) == []


def test_the_versions_and_settings_of_the_compiler_are_in_the_key(monkeypatch):
    keys = {provenance.project_key.__wrapped__()}
    monkeypatch.setenv("NUMBA_BOUNDSCHECK", "1")
    keys.add(provenance.project_key.__wrapped__())
    for tool in provenance.TOOLS:
        monkeypatch.setattr(tool, "__version__", "0.0")
        keys.add(provenance.project_key.__wrapped__())
    assert len(keys) == 5


def test_without_a_place_to_keep_it_a_kernel_is_compiled_and_one_line_says_so(study, tmp_path, caplog):
    (tmp_path / "build").write_text("a file in the place of the folder")
    for factor in (3, 4):
        kernel = study(factor).scaled
        assert (kernel(14), kernel(1.5)) == (14 * factor, 1.5 * factor)
    (message,) = caplog.messages
    assert message.startswith(f"{tmp_path}/build/numba/")
    assert message.endswith(" cannot be written (Not a directory): what this run makes is not kept")
    assert list(tmp_path.rglob("*.nb[ic]")) == []


def test_two_processes_that_keep_at_once_never_mix_their_variants(tmp_path, monkeypatch):
    first, second = (kernel_cache._Shelf(tmp_path, "kernel") for _ in range(2))
    first.put((0,), "before")
    entries = first._entries()
    second.put((2,), "of the second")
    # The first one has read the index before the second one wrote it.
    monkeypatch.setattr(first, "_entries", lambda: entries)
    first.put((1,), "of the first")
    shelf = kernel_cache._Shelf(tmp_path, "kernel")
    assert [shelf.get((number,)) for number in range(3)] == ["before", "of the first", None]
    second.put((2,), "of the second")
    assert [shelf.get((number,)) for number in range(3)] == ["before", "of the first", "of the second"]
    assert list(tmp_path.glob("*.tmp")) == []


WALL = """
from hardwall.model.axis.wall import Params, render
print(render(Params(**dict.fromkeys(Params._fields, 0) | {"stiffness": 2, "force_max": 99}), 21, 0))
"""


# That a kernel is compiled where it cannot be kept is tested in this process, too.
@pytest.mark.parametrize("place", ["build", "file/build"] if LONG else ["build"])
def test_an_edit_of_the_arithmetic_is_computed_wherever_the_build_folder_is(tmp_path, place):
    (tmp_path / "hardwall").mkdir()
    left_out = shutil.ignore_patterns("__pycache__")
    shutil.copytree(ROOT / "model", tmp_path / "hardwall" / "model", ignore=left_out)
    (tmp_path / "file").write_text("")
    environ = os.environ | {"PYTHONPATH": str(tmp_path), "HARDWALL_BUILD": str(tmp_path / place)}

    def run() -> tuple[str, int]:
        command = [sys.executable, "-B", "-c", WALL]
        done = subprocess.run(command, cwd=tmp_path, env=environ, capture_output=True, text=True, check=True)
        return done.stdout.strip(), len(done.stderr.splitlines())

    lines = int("file" in place)
    assert run() == ("-42", lines)
    # The wall's kernel rounds by another file, which Numba's own cache does not look at.
    fixed = tmp_path / "hardwall" / "model" / "arithmetic" / "fixed.py"
    fixed.write_text(fixed.read_text() + "\n\n@compiled\ndef shift_round_half_up(word, shift):\n    return word - 2\n")
    assert run() == ("-40", lines)
    assert list((tmp_path / "hardwall").rglob("*.nb[ic]")) == []
