"""The wheel: it has every package and file of the tree, and every module in it can be imported somewhere else."""

import os
import shutil
import subprocess
import sys
import sysconfig
import venv
import zipfile
from pathlib import Path

import pytest
from test_layout import CONFIG, EXTRAS, MODULES, ROOT

FOLDERS = {name.partition(".")[2]: folder for name, folder in CONFIG["tool"]["setuptools"]["package-dir"].items()}
"""The folder in the tree of each package below hardwall."""
PROGRAM = """
import importlib, os, sys
for name in sys.argv[1:]:
    module = importlib.import_module(name)
    assert module.__file__.startswith(sys.prefix + os.sep), f"{name} is imported from {module.__file__}"
"""


@pytest.fixture(scope="module")
def wheel(tmp_path_factory) -> Path:
    """Return the wheel, made of a copy of the tree, for a build leaves files in the tree."""
    copied = tmp_path_factory.mktemp("tree")
    for name in ("pyproject.toml", "README.md", "LICENSE", *FOLDERS.values()):
        if (ROOT / name).is_dir():
            shutil.copytree(ROOT / name, copied / name, ignore=shutil.ignore_patterns("__pycache__"))
        else:
            shutil.copy(ROOT / name, copied / name)
    program = "import sys; from setuptools.build_meta import build_wheel; build_wheel(sys.argv[1])"
    done = subprocess.run(
        [sys.executable, "-c", program, "dist"], cwd=copied, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return next((copied / "dist").glob("*.whl"))


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


def test_every_module_of_the_wheel_is_imported_in_an_empty_environment_elsewhere(wheel, tmp_path):
    """Its requirements are those of this environment, by a path: so nothing of this tree is found."""
    place = tmp_path / "environment"
    venv.create(place, with_pip=False, symlinks=True)
    paths = {"base": str(place), "platbase": str(place)}
    packages = Path(sysconfig.get_path("purelib", "venv", paths))
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(packages)
    here = [sysconfig.get_path("purelib"), sysconfig.get_path("platlib")]
    (packages / "requirements.pth").write_text("\n".join(dict.fromkeys(here)), encoding="utf-8")
    modules = sorted(name for name in MODULES if MODULES[name].stem != "__main__")
    python = Path(sysconfig.get_path("scripts", "venv", paths)) / "python"
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    done = subprocess.run(
        [python, "-c", PROGRAM, *modules], cwd=tmp_path, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr


def test_the_tests_build_with_the_versions_of_a_user():
    assert CONFIG["build-system"]["requires"] == [each for each in EXTRAS["test"] if each.startswith("setuptools==")]
