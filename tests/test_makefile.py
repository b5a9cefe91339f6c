"""The Makefile: every task has its line in the help, and missing system packages are named before anything starts."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).absolute().parent.parent
MAKE = shutil.which("make")
NEEDED = ["Makefile", "pyproject.toml", "requirements.lock"]
PACKAGES = {"python3": "python3", "c++": "g++", "perl": "perl"}


@pytest.fixture
def tree(tmp_path) -> Path:
    """Return a folder with the files that make reads, where nothing was installed."""
    folder = tmp_path / "tree"
    folder.mkdir()
    for name in NEEDED:
        shutil.copy(ROOT / name, folder)
    return folder


def run_by(body: str, path: Path) -> None:
    """Write a tool that is a shell script."""
    path.write_text(f"#!/bin/sh\n{body}\n")
    path.chmod(0o755)


def make(tree: Path, *arguments: str, path: str | None = None) -> subprocess.CompletedProcess:
    # The call must not look like a part of the make that runs these tests.
    environ = {name: value for name, value in os.environ.items() if not name.startswith(("MAKE", "MFLAGS", "PYTHON"))}
    environ |= {"PATH": path or os.environ["PATH"], "LC_ALL": "C"}
    return subprocess.run([MAKE, *arguments], cwd=tree, env=environ, capture_output=True, text=True, check=False)


def test_help_lists_every_task(tree):
    tasks = re.search(r"^\.PHONY: (.*)", (tree / "Makefile").read_text(), re.M)[1].split()
    done = make(tree, "help")
    assert [line.split()[1] for line in done.stdout.splitlines()] == [t for t in tasks if t not in ("tools", "FORCE")]
    assert done.stderr == ""


def test_what_runs_from_the_tests_folder_has_the_tests_tools():
    rules = re.findall(r"^(\w+): (.*)\n((?:\t.*\n)+)", (ROOT / "Makefile").read_text(), re.M)
    runs = {task: needs for task, needs, recipe in rules if re.search(r"tests/|\$\((PYTEST|IN_TESTS)\)", recipe)}
    assert {"test", "prove", "faults", "gate", "coverage", "mutate", "digests"} <= set(runs)
    assert [task for task, needs in runs.items() if "$(VENV)/.test" not in needs.split()] == []


@pytest.mark.parametrize("lacks", [(), ("c++",), ("perl",), ("python3",), ("python3", "c++", "perl")])
@pytest.mark.parametrize("tasks", [["all"], ["test"], ["-j2", "all", "synth", "lint"]], ids=" ".join)
def test_what_is_missing_is_named_with_its_package(tree, tmp_path, lacks, tasks):
    path = tmp_path / "bin"
    path.mkdir()
    for tool in {"bash", "sed", *PACKAGES} - set(lacks):
        run_by(f'exec "{sys.executable if tool == "python3" else shutil.which(tool)}" "$@"', path / tool)
    done = make(tree, *(tasks if lacks else ["tools"]), path=str(path))
    told = [line for line in done.stderr.splitlines() if line.startswith("hardwall needs")]
    assert [line.rsplit(" ", 1)[1] for line in told] == [PACKAGES[tool] for tool in lacks]
    assert done.returncode == (2 if lacks else 0)
    assert sorted(path.name for path in tree.iterdir()) == NEEDED


def test_a_path_with_a_space_is_refused(tree):
    spaced = tree.rename(tree.with_name("a tree"))
    done = make(spaced, "test")
    assert done.stderr.startswith("hardwall needs a path without spaces")
    assert done.returncode == 2
    assert make(spaced, "help").returncode == 0
    assert sorted(path.name for path in spaced.iterdir()) == NEEDED


@pytest.mark.parametrize(
    ("lack", "told"),
    [
        ("import sys; sys.version_info, sys.version = (3, 9), '3.9.2 (old)'", "python3 is 3.9.2: .* python3$"),
        ("import sys; sys.modules['ensurepip'] = None", "ensurepip: .* python3-venv$"),
        ("import ctypes; ctypes.CDLL = lambda name: open('')", r"libpython3\.\d+\w*\.so: .* libpython3-dev$"),
    ],
)
def test_what_python_lacks_is_named_with_its_package(tree, tmp_path, lack, told):
    run_by(f'exec "{sys.executable}" -c "{lack}; import sys; exec(sys.argv[1])" "$2"', tmp_path / "python3")
    done = make(tree, "test", path=f"{tmp_path}{os.pathsep}{os.environ['PATH']}")
    assert done.returncode == 2
    assert re.search(f"^hardwall needs .*{told}", done.stderr, re.M)
    assert sorted(path.name for path in tree.iterdir()) == NEEDED
