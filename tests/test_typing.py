"""The model's public API under a type checker: correct use passes, wrong use is reported, and nothing is `Any`."""

import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from hardwall.model.build_folder import build_dir

ROOT = Path(__file__).absolute().parent.parent

RIGHT = """
import numpy as np

from hardwall.model import stamped
from hardwall.model.arithmetic.fixed import SQ
from hardwall.model.axis import Axis, Record, step
from hardwall.model.estimators import registry
from hardwall.model.estimators.levant import Gains
from hardwall.model.quadrature import Seen, seen_count
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
    r"tuple\[.*fallback=hardwall\.model\.design\.State\]",
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


@pytest.fixture(scope="module")
def said(tmp_path_factory) -> dict[str, list[tuple[int, str, str]]]:
    """Return the type checker's messages on every file: line, error or note, and text."""
    folder = tmp_path_factory.mktemp("typing")
    (folder / "hardwall").mkdir()
    (folder / "hardwall" / "model").symlink_to(ROOT / "model", target_is_directory=True)
    (folder / "right.py").write_text(RIGHT)
    (folder / "wrong.py").write_text(WRONG)
    command = [sys.executable, "-m", "mypy", "--no-error-summary", "--config-file=", "--explicit-package-bases"]
    command += ["--cache-dir", str(build_dir() / "mypy"), "right.py", "wrong.py", "hardwall/model"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert not done.stderr
    found: dict[str, list[tuple[int, str, str]]] = {}
    for line in done.stdout.splitlines():
        file, number, kind, rest = re.fullmatch(r"(.+?):(\d+): (error|note): (.*)", line).groups()
        found.setdefault(file, []).append((int(number), kind, rest))
    return found


def test_the_model_itself_passes(said):
    assert {file: lines for file, lines in said.items() if file.startswith("hardwall")} == {}


def test_what_is_right_passes_and_has_types(said):
    assert [line for line in said["right.py"] if line[1] == "error"] == []
    shown = [rest for _, _, rest in said["right.py"]]
    assert len(shown) == len(SHOWN)
    for rest, wanted in zip(shown, SHOWN, strict=True):
        assert re.fullmatch(rf'Revealed type is "{wanted}"', rest), rest


def test_what_is_wrong_is_told_where_it_is(said):
    wanted = [(n, line.split("# ")[1]) for n, line in enumerate(WRONG.splitlines(), 1) if "# " in line]
    errors = [(n, re.search(r"\[([a-z-]+)\]$", rest)[1]) for n, kind, rest in said["wrong.py"] if kind == "error"]
    assert errors == wanted


def test_whoever_installs_the_model_gets_its_types():
    data = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["setuptools"]["package-data"]
    assert data["hardwall.model"] == ["py.typed"]
    assert (ROOT / "model" / "py.typed").exists()
