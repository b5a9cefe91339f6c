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
MOST_WORDS = 16
"""The most words that the help has for a task."""
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
    assert [line for line in done.stdout.splitlines() if len(line.split()) > 2 + MOST_WORDS] == []


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


@pytest.mark.parametrize("letter", [" ", "$", ":", "#", "%"])
def test_a_path_that_make_cannot_read_is_refused(tree, letter):
    spaced = tree.rename(tree.with_name(f"a{letter}tree"))
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


PYTHON = """
if [ "$2" = venv ]; then mkdir -p .venv/bin && cp "$0" .venv/bin/python
elif [ "$2" = pip ]; then case "$*" in
  *--require-hashes*) {uv_by_pip} ;;
  *) touch pip-was-called ;; esac
else exec "{python}" "$@"; fi
"""
"""A Python that makes no environment and installs nothing, but says that pip was to install the project."""
MISMATCH = "error: Failed to download `numpy==2.4.6`\n  cause: Hash mismatch for `numpy==2.4.6`"
UNBUILT = "error: Failed to build `hardwall @ file:///tree`\n  cause: No solution found when resolving: `setuptools`"
UNFOUND = "error: No solution found when resolving dependencies\n  cause: Because numba was not found"
UNREACHED = "error: Failed to fetch: http://index/simple/numba/\n  cause: tcp connect error"


def installing(tree: Path, tmp_path: Path, uv_by_pip: str) -> subprocess.CompletedProcess:
    """Install the model and the loop, where a shell command stands for what pip does with the package uv."""
    tools = tmp_path / "bin"
    tools.mkdir()
    run_by(PYTHON.format(python=sys.executable, uv_by_pip=uv_by_pip), tools / "python3")
    return make(tree, ".venv/.sim", path=f"{tools}{os.pathsep}{os.environ['PATH']}")


def by_uv(tree: Path, tmp_path: Path, body: str) -> subprocess.CompletedProcess:
    """Install the model and the loop, where a shell script stands for uv."""
    run_by(body, tmp_path / "uv")
    return installing(tree, tmp_path, f"cp {tmp_path / 'uv'} .venv/bin/uv")


@pytest.mark.parametrize("told", [MISMATCH, UNBUILT, "Killed"], ids=["hash", "build", "killed"])
def test_a_failure_of_uv_ends_the_task_and_pip_does_not_install_unchecked(tree, tmp_path, told):
    done = by_uv(tree, tmp_path, f"cat <<'END' >&2\nUsing Python\n{told}\nEND\nexit 1")
    assert done.returncode == 2
    assert f"{told}\nhardwall: uv failed (see above), and pip does not take its place, for it checks no" in done.stderr
    assert not (tree / "pip-was-called").exists()
    assert not (tree / ".venv/.sim").exists()


@pytest.mark.parametrize("told", [UNFOUND, UNREACHED], ids=["unfound", "unreached"])
def test_pip_takes_the_place_of_a_uv_that_finds_no_package(tree, tmp_path, told):
    done = by_uv(tree, tmp_path, f"cat <<'END' >&2\nUsing Python\n{told}\nEND\nexit 1")
    assert (done.returncode, done.stderr) == (0, "")
    assert f"{told.splitlines()[1]}\n  by pip, without uv:\n" in done.stdout
    assert (tree / "pip-was-called").exists()


def test_a_uv_that_installs_is_enough(tree, tmp_path):
    done = by_uv(tree, tmp_path, "echo Installed 4 packages")
    assert (done.returncode, done.stderr) == (0, "")
    assert not (tree / "pip-was-called").exists()
    assert (tree / ".venv/.sim").exists()


def test_without_uv_pip_installs(tree, tmp_path):
    done = installing(tree, tmp_path, "echo no wheel of uv >&2; exit 1")
    assert (done.returncode, done.stderr) == (0, "")
    assert "no wheel of uv\n  by pip, without uv:\n" in done.stdout
    assert (tree / "pip-was-called").exists()


def test_a_uv_with_another_hash_is_not_done_without(tree, tmp_path):
    told = "ERROR: THESE PACKAGES DO NOT MATCH THE HASHES FROM THE REQUIREMENTS FILE."
    done = installing(tree, tmp_path, f"echo '{told}' >&2; exit 1")
    assert done.returncode == 2
    assert done.stderr.startswith(f"{told}\n")
    assert not (tree / "pip-was-called").exists()
    assert not (tree / ".venv/.made").exists()


def test_the_makefile_knows_how_uv_says_that_it_finds_no_package(tmp_path):
    begins = re.search(r"^FOUND_NONE := (.*)$", (ROOT / "Makefile").read_text(), re.M)[1]
    command = ["uv", "pip", "install", "--offline", "--no-cache", "--no-config", "--no-index", "--target"]
    done = subprocess.run(
        [sys.executable, "-m", *command, str(tmp_path), "iniconfig"], capture_output=True, text=True, check=False
    )
    assert re.search(begins, done.stderr, re.M), done.stderr
    assert not re.search(begins, MISMATCH, re.M)
