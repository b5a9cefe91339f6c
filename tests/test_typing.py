"""The public API of model and test bench under a type checker: correct use passes, wrong use is reported."""

import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from hardwall.model.runtime.build_folder import build_dir

ROOT = Path(__file__).absolute().parent.parent

RIGHT = """
import numpy as np

from hardwall.model import stamped
from hardwall.model.arithmetic.fixed import SQ
from hardwall.model.axis import Axis, step
from hardwall.model.axis.axis import Record
from hardwall.model.estimators import registry
from hardwall.model.estimators.levant import Gains
from hardwall.model.encoder.quadrature import Seen, seen_count
from hardwall.model.spec import AxisSpec
from hardwall.model.words import Word

spec = AxisSpec(
    clock_hz=12_000_000, sample_hz=10_000, actuation_hz=1_000, count_m=1e-6, travel_m=0.15, speed_max_m_per_s=2.0,
    acceleration_max_m_per_s2=12.0, force_max_n=40.0, force_resolution_n=1e-3, stiffness_max_n_per_m=200e3,
    damping_max_n_s_per_m=400.0, estimator="levant", gains=Gains(3.5, 13.2),
)
axis = Axis(spec, wall_stiffness=20e3, wall_damping=30.0)
record: Record = axis.run(np.arange(10))
stamped.run(axis, [10, 20], [1, 3], samples=5)
seen: Seen = seen_count(3)
state, velocity, force = step(axis.params, spec.design.start(), seen, 0, 0, 1)
word: Word = spec.design.words[0]
reveal_type(record.velocity_m_per_s)
reveal_type(record.drive_n)
reveal_type(state)
reveal_type(velocity)
reveal_type(spec.design.estimator)
reveal_type(spec.count_width)
reveal_type(registry.design_of("levant").outputs)
reveal_type(word.from_si(1.0))
reveal_type(SQ(3, 2).max)
"""
SHOWN = [
    r"numpy\.ndarray\[.*\]",
    r"numpy\.ndarray\[.*\]",
    r"tuple\[.*fallback=hardwall\.model\.axis\.design\.State\]",
    r"float",
    r"hardwall\.model\.estimators\.estimate\.EstimatorDesign",
    r"int",
    r"tuple\[str, \.\.\.\]",
    r"int",
    r"int",
]
WRONG = """
from hardwall.model import stamped
from hardwall.model.axis import Axis, step
from hardwall.model.estimators import registry
from hardwall.model.spec import AxisSpec

def client(spec: AxisSpec, axis: Axis) -> None:
    Axis(3)  # arg-type
    Axis(spec, wall_stiffness="stiff")  # arg-type
    axis.run()  # call-arg
    axis.run(spec)  # arg-type
    axis.run([1, 2]).speed  # attr-defined
    stamped.run(axis, [1], [1], samples=2.5)  # arg-type
    registry.design_of(3)  # arg-type
    step(axis.params, spec.design.start(), 3, 0, 0, 1)  # arg-type
    spec.clock_hz = 3  # misc
"""
BENCH_RIGHT = """
import cocotb
import numpy as np
from amaranth.lib import wiring
from cocotb.handle import HierarchyObject

from hardwall.testing import CAMPAIGN, SAMPLES, SEED, Bench, check, parameters, rng, simulate

def make(width: int) -> wiring.Component:
    raise NotImplementedError

@cocotb.test(**CAMPAIGN)
async def follows_its_model(dut: HierarchyObject) -> None:
    component = make(**parameters())
    bench = Bench(dut, component)
    await bench.reset()
    bench.drive(limit=-3)
    monitor = bench.monitor("valid", "sum")
    await bench.transact("strobe", "valid", sample=SEED)
    rows = [(sample,) for sample in rng().integers(0, 9, SAMPLES).tolist()]
    taken, given = await bench.campaign("strobe", "valid", ("sample",), ("sum",), rows, latency=1)
    check(taken, given, {"sum": np.cumsum(taken.column("sample"))}, component.latency)
    reveal_type(taken.column("sample"))
    reveal_type(given.rows)
    reveal_type(monitor.clocks)
    reveal_type(bench.clock_number())
    reveal_type(bench.reader("sum")())
    reveal_type(rng())
    reveal_type(follows_its_model)

def test_block() -> None:
    simulate(__file__, make, width=16)
"""
BENCH_SHOWN = [
    r"numpy\.ndarray\[.*\]",
    r"list\[tuple\[int, \.\.\.\]\]",
    r"list\[int\]",
    r"int",
    r"int",
    r"numpy\.random\._generator\.Generator",
    r"cocotb\._decorators\.TestGenerator",
]
BENCH_WRONG = """
from amaranth.lib import wiring
from cocotb.handle import HierarchyObject

from hardwall.testing import Bench, check, simulate

async def client(dut: HierarchyObject, component: wiring.Component) -> None:
    Bench(dut)  # call-arg
    Bench("dut", component)  # arg-type
    bench = Bench(dut, component)
    bench.drive(limit="3")  # arg-type
    await bench.campaign("strobe", "valid", ("sample",), ("sum",), [3])  # list-item
    taken, given = await bench.campaign("strobe", "valid", ("sample",), ("sum",), [(3,)])
    taken.words  # attr-defined
    check(taken, given)  # call-arg
    check(taken, given, {"sum": 3})  # dict-item
    simulate(__file__, 3)  # arg-type
"""
HOST_RIGHT = """
import numpy as np

from hardwall.host import Axis, State, Status, Trip, connect

def run(axis: Axis) -> None:
    axis.set(wall_stiffness=10e3)
    axis.wall.stiffness = 10e3
    stiffness: float = axis.wall.stiffness
    axis.arm()
    for status in axis.watch(seconds=1.0):
        assert status.state is State.ARMED
    trip: Trip | None = axis.trip
    if trip:
        axis.acknowledge(trip)
    axis.capture.start(["contact"], before=3)
    reveal_type(axis.capture.read().force_n)
    reveal_type(axis.status)
    reveal_type(axis.supervisor.force_limit)

with connect("/dev/ttyUSB0", identity=None) as found:
    run(found)
"""
HOST_SHOWN = [r"numpy\.ndarray\[.*\]", r"hardwall\.host\.status\.Status", r"float"]
HOST_WRONG = """
from hardwall.host import Axis, connect

def client(axis: Axis) -> None:
    connect(3)  # arg-type
    axis.set(wall_stiffness="stiff")  # arg-type
    axis.wall.stiffness = "stiff"  # assignment
    axis.wall.hardness  # attr-defined
    axis.acknowledge(3)  # arg-type
    axis.status.force  # attr-defined
    axis.capture.start(before="3")  # arg-type
"""
# Whoever installs hardwall has amaranth, pyserial and rooms of ours without types. Functions of the bench have them.
SETTINGS = """
[mypy]
[mypy-amaranth.*,hardwall.hdl.*,hardwall.sim.*,serial.*]
ignore_missing_imports = true
[mypy-hardwall.testing.*]
disallow_untyped_defs = true
"""
SNIPPETS = {
    "right": RIGHT,
    "wrong": WRONG,
    "bench_right": BENCH_RIGHT,
    "bench_wrong": BENCH_WRONG,
    "host_right": HOST_RIGHT,
    "host_wrong": HOST_WRONG,
}


@pytest.fixture(scope="module")
def said(tmp_path_factory) -> dict[str, list[tuple[int, str, str]]]:
    """Return the type checker's messages on every file: line, error or note, and text."""
    folder = tmp_path_factory.mktemp("typing")
    (folder / "hardwall").mkdir()
    (folder / "hardwall" / "model").symlink_to(ROOT / "model", target_is_directory=True)
    (folder / "hardwall" / "host").symlink_to(ROOT / "host", target_is_directory=True)
    (folder / "hardwall" / "testing").symlink_to(ROOT / "tests" / "benches", target_is_directory=True)
    (folder / "settings.ini").write_text(SETTINGS)
    for name, text in SNIPPETS.items():
        (folder / f"{name}.py").write_text(text)
    command = [sys.executable, "-m", "mypy", "--no-error-summary", "--config-file=settings.ini"]
    command += ["--explicit-package-bases", "--cache-dir", str(build_dir() / "mypy")]
    command += [*(f"{name}.py" for name in SNIPPETS), "hardwall/host", "hardwall/model", "hardwall/testing"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert not done.stderr
    found: dict[str, list[tuple[int, str, str]]] = {}
    for line in done.stdout.splitlines():
        file, number, kind, rest = re.fullmatch(r"(.+?):(\d+): (error|note): (.*)", line).groups()
        found.setdefault(file, []).append((int(number), kind, rest))
    return found


def test_the_typed_packages_themselves_pass(said):
    assert {file: lines for file, lines in said.items() if file.startswith("hardwall")} == {}


@pytest.mark.parametrize(
    ("name", "types"), [("right", SHOWN), ("bench_right", BENCH_SHOWN), ("host_right", HOST_SHOWN)]
)
def test_what_is_right_passes_and_has_types(said, name, types):
    assert [line for line in said[f"{name}.py"] if line[1] == "error"] == []
    shown = [rest for _, _, rest in said[f"{name}.py"]]
    assert len(shown) == len(types)
    for rest, wanted in zip(shown, types, strict=True):
        assert re.fullmatch(rf'Revealed type is "{wanted}"', rest), rest


@pytest.mark.parametrize("name", ["wrong", "bench_wrong", "host_wrong"])
def test_what_is_wrong_is_told_where_it_is(said, name):
    wanted = [(n, line.split("# ")[1]) for n, line in enumerate(SNIPPETS[name].splitlines(), 1) if "# " in line]
    errors = [(n, re.search(r"\[([a-z-]+)\]$", rest)[1]) for n, kind, rest in said[f"{name}.py"] if kind == "error"]
    assert errors == wanted


@pytest.mark.parametrize(("name", "folder"), [("host", "host"), ("model", "model"), ("testing", "tests/benches")])
def test_whoever_installs_a_typed_package_gets_its_types(name, folder):
    data = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["setuptools"]["package-data"]
    assert "py.typed" in data[f"hardwall.{name}"]
    assert (ROOT / folder / "py.typed").exists()
