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

from hardwall.model import build_folder, kernel_cache, provenance

ROOT = Path(__file__).absolute().parent.parent
KERNEL = """
from hardwall.model.compiled import compiled
from constants_of_a_study import FACTOR

@compiled
def scaled(number):
    return FACTOR * number
"""
LAW = """
from typing import NamedTuple
from hardwall.model.compiled import compiled
from hardwall.model.wall import render

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

    def fresh(factor: int, text: str = KERNEL) -> ModuleType:
        monkeypatch.setattr(provenance, "_seen", {})
        monkeypatch.setattr(provenance, "_changed", set())
        constants = tmp_path / "constants_of_a_study.py"
        constants.write_text(f"FACTOR = {factor}  # {os.urandom(8).hex()[: 8 - len(str(factor))]}")
        imported(constants)
        (tmp_path / "kernels_of_a_study.py").write_text(text)
        return imported(tmp_path / "kernels_of_a_study.py")

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
