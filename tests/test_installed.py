"""The wheel works outside its checkout, with the packages of one extra and no others.

Site-packages cannot be written, there is no home folder, and where the tests run as root, a user whom the system does
not know runs it; nothing is on PATH but what a command is said to need. `make test` links the packages of the running
environment, which needs no index and takes seconds. `make matrix` installs them: the oldest and the newest ones of
their ranges, for every Python on the machine.
"""

import importlib.metadata
import json
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from packaging.version import Version

from hardwall.cli.group import COMMANDS
from stimuli.lengths import LONG
from support import environments, virtual_boards
from support.archives import ROOT
from support.command_line import call
from support.environments import Environment, Source
from support.pages import Block, blocks

MATRIX = environments.sources(os.environ.get("HARDWALL_MATRIX", "").split())
"""What is installed from the index, for the interpreters that the variable names."""
SHORT = "--set", "protocol.settle_s=0.5", "--set", "protocol.measure_s=0.2"
# A loop with this estimator is compiled soonest.
HIT = "hardwall", "hit", "seed-2011", "--estimator", "fdm", *SHORT, "--json"
WHOLE = bool(MATRIX) or LONG
"""Whether an environment hits by every backend, and optimises its C++; else its one hit is by the hardware."""
MORE_BACKENDS = ("float",) if WHOLE else ()
"""Backends besides the default one and the RTL: each is compiled for seconds, and differs in no package."""
NO_HOME = "there is no home folder: what this run makes is not kept; HARDWALL_BUILD names a folder"
NEEDED = dict.fromkeys(COMMANDS, ("sim",)) | {
    **dict.fromkeys(("arm", "capture", "config", "connect", "disarm", "home", "set", "share", "watch"), ("host",)),
    "panel": ("host", "panel"),
    "bench": ("sim", "testing"),
}
"""The extras that each command needs, in the order in which it names one that is absent."""
LOOK = """
import importlib, json, sys
from hardwall.model.runtime import extras
lacking = {}
for name in sys.argv[1:]:
    try:
        importlib.import_module(f"hardwall.cli.{name}")
    except ImportError as error:
        lacking[name] = extras.lacking(error)
print(json.dumps(lacking))
"""
"""Prints what each command says that it lacks."""


@pytest.fixture(params=MATRIX or [Source()], ids=str)
def place(request, distributions):
    """Return a context with an environment of an extra."""

    @contextmanager
    def made(*extras: str) -> Iterator[Environment]:
        with environments.environment(request.param, distributions[1], *extras) as environment:
            assert is_closed(environment)
            assert request.param.resolution != environments.OLDEST or has_an_older_numba(environment)
            yield environment

    return made


def is_closed(environment: Environment) -> bool:
    """Return whether what runs cannot write to the packages, and finds none but the environment's."""
    packages = environment.packages
    done = environment.run("python", "-c", f"print(*__import__('sys').path); open({str(packages / 'new')!r}, 'w')")
    assert not {str(ROOT), str(ROOT.parent)} & set(done.stdout.split())
    # Root writes everywhere; without another user whom Python is open to, that is not asked.
    return "PermissionError" in done.stderr or (os.geteuid() == 0 and environment.user is None)


def has_an_older_numba(environment: Environment) -> bool:
    """Return whether its Numba, which the model needs, is older than that of the tests."""
    done = environment.run("python", "-c", "print(__import__('importlib.metadata').metadata.version('numba'))")
    return Version(done.stdout.strip()) < Version(importlib.metadata.version("numba"))


def page(name: str) -> Block:
    """Return the first block of Python of a page."""
    return next(block for block in blocks(name) if block.language == "python")


def told(done, extra: str) -> None:
    """Check that a command has failed with one line, which names an extra."""
    assert (done.returncode, done.stdout, done.stderr.count("\n")) == (1, "", 1), done.stderr
    assert f" is not installed: it comes with pip install '.[{extra}]' in the checkout of hardwall" in done.stderr


def report(done) -> dict:
    """Return what a command has printed as JSON."""
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def every_command_says_what_it_lacks(environment: Environment, extra: str) -> None:
    """Check that with one extra, each command that needs another one names it, and no other command lacks any."""
    lacking = report(environment.run("python", "-c", LOOK, *COMMANDS))
    absent = {name: [each for each in needs if each != extra] for name, needs in NEEDED.items()}
    assert set(lacking) == {name for name, each in absent.items() if each}
    for name, line in lacking.items():
        assert f"pip install '.[{absent[name][0]}]'" in line, name


def test_without_an_extra_the_first_example_of_the_guide_runs(place):
    block = page("docs/guide/python.md")
    with place() as environment:
        done = environment.run("python", "-c", block.text)
        assert (done.returncode, done.stdout) == (0, block.printed), done.stderr
        if environment.user is not None:
            assert done.stderr.splitlines() == [NO_HOME]
        told(environment.run("hardwall", "--help"), "sim")


@pytest.fixture
def own(monkeypatch, capsys) -> dict:
    """Return the report of a hit in the environment of the tests."""
    code, out, err = call(monkeypatch, capsys, *HIT[1:])
    assert code == 0, err
    return json.loads(out)


def test_the_extra_sim_hits_and_replays(place, own):
    with place("sim") as environment:
        # A home that is not there, and stays so.
        home = environment.folder / "absent"
        keeping = {"HARDWALL_BUILD": environment.work / "mäde", "HOME": home}
        fixed = report(environment.run(*HIT, **keeping)) if WHOLE else own
        others = [report(environment.run(*HIT, "--backend", backend)) for backend in MORE_BACKENDS]
        assert [each["max_force_n"] for each in (fixed, *others)] == [pytest.approx(12.56, abs=0.01)] * (
            1 + len(others)
        )
        rtl = (*HIT, "--backend", "rtl")
        done = environment.run(*rtl, path=without_a_compiler(environment), **keeping)
        assert (done.returncode, done.stdout) == (1, "")
        assert done.stderr == (
            "hardwall: error: the hardware cannot be built without c++: install the Debian or Ubuntu package g++\n"
        )
        built = environment.run(*rtl, path=tools(environment), **keeping)
        assert report(built)["force_sha256"] == fixed["force_sha256"]
        assert report(built)["max_force_n"] == fixed["max_force_n"]
        written = environment.run("hardwall", "verilog", "--board", "icebreaker", "-o", "files", **keeping)
        assert (written.returncode, written.stderr) == (0, "")
        assert not home.exists()
        # An older Typer has other words for this, and other names for some options.
        refused = environment.run("hardwall", "hit", "--stiffness", "x", **keeping)
        assert (refused.returncode, refused.stderr) == (2, "hardwall: error: --stiffness must be a number, not 'x'\n")
        assert environment.run("python", "-c", page("docs/guide/start.md").text, **keeping).returncode == 0
        replay = "hardwall", "replay", "recording.csv", "--column", "counts", "--plot", "replay.png", "--json"
        # Without a home, what is compiled is not kept.
        assert report(environment.run(*replay))["samples"] == 2000
        assert (environment.work / "replay.png").stat().st_size > 10_000
        told(environment.run("hardwall", "connect", "nowhere"), "host")
        every_command_says_what_it_lacks(environment, "sim")


def tools(environment: Environment) -> str:
    """Return what follows on PATH, for a build: the system's tools, with a C++ compiler that need not optimise."""
    path = os.environ["PATH"]
    if WHOLE:
        return path
    folder = environment.work / "plain"
    folder.mkdir()
    for name in ("c++", "g++"):
        (folder / name).write_text(f'#!/bin/sh\nexec {shutil.which(name)} "$@" -O0\n')
        (folder / name).chmod(0o755)
    return f"{folder}{os.pathsep}{path}"


def without_a_compiler(environment: Environment) -> Path:
    """Return a folder with what Verilator needs of the system, but for the compiler."""
    folder = environment.work / "tools"
    folder.mkdir()
    for tool in ("make", "perl"):
        (folder / tool).symlink_to(shutil.which(tool))
    return folder


def test_the_extra_host_speaks_to_a_board(place):
    with place("host") as environment, virtual_boards.running(virtual_boards.SCENE, "--tcp", "0") as board:
        found = report(environment.run("hardwall", "connect", board.tcp, "--json"))
        assert found["state"] == "DISARMED"
        told(environment.run(*HIT), "sim")
        every_command_says_what_it_lacks(environment, "host")


def test_the_extra_testing_tests_a_block(place):
    with place("testing") as environment:
        for name in ("moving_average.py", "test_moving_average.py"):
            shutil.copy(ROOT / "docs/examples" / name, environment.work)
        test = "python", "-m", "pytest", "-q", "-p", "no:cacheprovider", "test_moving_average.py"
        done = environment.run(*test, path=tools(environment), HARDWALL_SAMPLES=1000)
        assert done.stdout.splitlines()[-1].startswith("1 passed"), done.stdout
