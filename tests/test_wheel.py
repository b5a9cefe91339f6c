"""The wheel: it has every package and file of the tree, and every module in it can be imported somewhere else."""

import zipfile
from pathlib import Path

import pytest
from test_layout import CONFIG, EXTRAS, MODULES, ROOT

from support import environments

FOLDERS = {name.partition(".")[2]: folder for name, folder in CONFIG["tool"]["setuptools"]["package-dir"].items()}
"""The folder in the tree of each package below hardwall."""
PROGRAM = """
import importlib, os, sys
for name in sys.argv[1:]:
    module = importlib.import_module(name)
    assert module.__file__.startswith(sys.prefix + os.sep), f"{name} is imported from {module.__file__}"
"""


@pytest.fixture
def wheel(distributions) -> Path:
    """Return the wheel, built from the sdist."""
    return distributions[1]


def in_tree() -> set[str]:
    """Return the paths in a wheel of all files of the packages."""
    found = set()
    for package, folder in FOLDERS.items():
        for path in (ROOT / folder).rglob("*"):
            if path.is_file() and "__pycache__" not in path.parts:
                found.add(f"hardwall/{package}/{path.relative_to(ROOT / folder).as_posix()}")
    return found


def test_packages_of_the_tree_are_those_that_are_listed():
    packages = {
        f"hardwall.{package}{''.join(f'.{part}' for part in path.parent.relative_to(ROOT / folder).parts)}"
        for package, folder in FOLDERS.items()
        for path in (ROOT / folder).rglob("*.py")
    }
    # The files of constraints are data without a module.
    assert set(CONFIG["tool"]["setuptools"]["packages"]) == packages | {"hardwall.constraints"}


def test_the_wheel_has_every_file_of_the_tree(wheel):
    with zipfile.ZipFile(wheel) as archive:
        inside = {name for name in archive.namelist() if ".dist-info/" not in name}
    assert inside == in_tree()
    assert len(inside) > len(MODULES)


def test_every_module_of_the_wheel_is_imported_in_an_environment_elsewhere(wheel):
    """The packages of all extras are there."""
    modules = sorted(name for name in MODULES if MODULES[name].stem != "__main__")
    with environments.environment(environments.Source(), wheel, "sim", "host", "panel", "testing") as environment:
        done = environment.run("python", "-c", PROGRAM, *modules)
        assert done.returncode == 0, done.stderr


def test_the_build_needs_what_the_tests_build_with():
    (needed,) = CONFIG["build-system"]["requires"]
    assert needed in EXTRAS["test"]
