"""What a block's mutants come from, found without an import: all that is really imported, and nothing else."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from signoff.covering.blocks import BLOCKS, TESTS
from signoff.covering.sources import HARDWARE, REGISTRIES, RUNNER, RUNTIME, TREE, sources_of

IMPORTING = """
import json, sys
from importlib import import_module
from importlib.machinery import ModuleSpec
from pathlib import Path
from types import ModuleType

class Empty(ModuleType):
    def __getattr__(self, name):
        if name.startswith("__"):
            raise AttributeError(name)
        return type(name, (), {})

class Runner:
    def find_spec(self, name, path, target=None):
        return ModuleSpec(name, self, is_package=True) if name.startswith("hardwall.sim.rtl") else None
    def create_module(self, spec):
        return Empty(spec.name)
    def exec_module(self, module):
        pass

tree, beside, stem = Path(sys.argv[1]), *sys.argv[2:]
sys.path[:0] = [beside, str(tree / "tests")]
sys.meta_path.insert(0, Runner())
import_module("conftest")
import_module(stem)
files = [getattr(module, "__file__", None) for module in [*sys.modules.values()]]
files = [Path(file).resolve() for file in files if isinstance(file, str)]
files = [file.relative_to(tree) for file in files if file.is_relative_to(tree)]
# The virtual environment is a folder of the project, too.
print(json.dumps([str(file) for file in files if not file.parts[0].startswith(".")]))
"""
"""Imports a test as the simulator does, without what runs that, and prints all of the project that came with it."""
SOURCES = {
    "tests/conftest.py": "import os",
    "tests/part/test_part.py": "from oracles import one\nimport part_world\nfrom hardwall.testing import Bench",
    "tests/part/part_world.py": "def later():\n    from hardwall.hdl.part import Part",
    "tests/part/other_world.py": "",
    "tests/part_world.py": "import part.part_world",
    "tests/oracles/one.py": "from .two import TWO\nimport numpy",
    "tests/oracles/two.py": "import oracles.one",
    "tests/oracles/three.py": "",
    "tests/benches/__init__.py": "from .bench import Bench",
    "tests/benches/bench.py": "from hardwall.sim.rtl import runner\nimport hardwall.sim.signals",
    "tests/benches/more.py": "",
    "hdl/part.py": "from hardwall.model import part\nfrom .inside import Inside",
    "hdl/inside.py": "import hardwall.model.inside.least",
    "sim/rtl/runner.py": "import hardwall.model.other",
    "sim/signals.py": "",
    "model/__init__.py": "",
    "model/part.py": "",
    "model/inside/__init__.py": "",
    "model/inside/least.py": "from ..runtime import kept",
    "model/inside/most.py": "",
    "model/other.py": "",
    "model/runtime/kept.py": "",
}
REGISTRY = REGISTRIES[0]
OTHERS = {
    *("tests/part/other_world.py", "tests/oracles/three.py", "tests/benches/more.py"),
    *("hdl/part.py", "hdl/inside.py", "sim/rtl/runner.py", "model/inside/most.py", "model/other.py"),
    *("tests/benches/__init__.py", "model/__init__.py", "model/inside/__init__.py", "model/runtime/kept.py"),
}
"""What the test does not import, the hardware, packages, what runs the simulator and what compiles kernels."""


def test_sources_are_what_is_imported_directly_or_not(tmp_path):
    for name, text in SOURCES.items():
        file = tmp_path / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text, encoding="utf-8")
    found = sources_of(tmp_path / "tests/part/test_part.py", tmp_path)
    assert {*map(str, found)} == set(SOURCES) - OTHERS


# One with a whole axis, one with a world beside its tests and most of the models.
@pytest.mark.parametrize("name", ["axis/axis", "axes/register_file"])
def test_nothing_is_imported_that_is_no_source(name):
    test = next(block.test for block in BLOCKS if block.name == name)
    command = [sys.executable, "-c", IMPORTING, TREE.resolve(), test.parent, test.stem]
    done = subprocess.run(command, check=False, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    imported = {Path(file) for file in json.loads(done.stdout)}
    assert test.relative_to(TREE) in imported
    others = {
        file
        for file in imported - {*sources_of(test)}
        if not {HARDWARE, RUNTIME} & {*file.parents} and file.name != "__init__.py"
    }
    # All estimators come with an axis's specification, whether the test has to do with them or not.
    assert REGISTRY in others
    assert others <= {*sources_of(TREE / REGISTRY)}


def test_estimators_are_sources_of_the_tests_that_name_them():
    axis, small = (
        {*sources_of(TESTS / f"{name}.py")} for name in ("axis/test_axis", "estimators/test_finite_difference")
    )
    edge, plain, other = (REGISTRY.with_name(f"{name}.py") for name in ("levant_edge", "levant", "mt"))
    assert {edge, plain} <= axis
    # The specification's own choice is one of any axis.
    assert plain in small
    assert not {edge, other} & small
    assert other not in axis
    # A test that has all estimators to do with has them all.
    assert {edge, plain, other, REGISTRY} <= {*sources_of(TESTS / "estimators/test_levants.py")}


def test_a_small_block_does_not_come_from_the_models_of_large_ones():
    small, large = ({*sources_of(TESTS / f"{name}.py")} for name in ("arithmetic/test_sqrt", "axis/test_board"))
    assert Path("model/arithmetic/sqrt.py") in small
    assert Path("model/axis/supervisor.py") in large - small
    assert not any(file.is_relative_to(place) for file in small | large for place in (HARDWARE, RUNNER))
