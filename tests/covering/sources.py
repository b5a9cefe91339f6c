"""The sources that a test comes from: itself and all of the project that it imports, found without an import of them.

Two parts of the project are no such sources:

- **The hardware.** It is in the Verilog. But what it imports is: a test may ask a component for its design.
- **What runs the simulator**, `RUNNER`. It imports most of the project, of which nothing comes into a test.
"""

from collections.abc import Iterator
from pathlib import Path

from hardwall.model.provenance import imported

from .blocks import TESTS

TREE = TESTS.parent
HARDWARE, RUNNER = Path("hdl"), Path("sim/rtl")
PACKAGES = {"hardwall.testing": Path("tests/benches"), "hardwall": Path()}
"""The folder of a package; a module of no package is one of the tests."""


def _files(tree: Path, name: str, beside: Path) -> Iterator[Path]:
    """Yield the file of a module, if it is one of the project."""
    top = next((package for package in PACKAGES if f"{name}.".startswith(f"{package}.")), None)
    inside = name.removeprefix(top or "").strip(".").replace(".", "/")
    for place in [PACKAGES[top]] if top else dict.fromkeys((Path("tests"), beside)):
        for file in (place / f"{inside}.py", place / inside / "__init__.py"):
            if (tree / file).is_file():
                yield file


def _package(file: Path) -> str:
    """Return the package of a file, as its relative imports mean it."""
    for package, folder in PACKAGES.items():
        if file.is_relative_to(folder) and not (package == "hardwall" and file.parts[0] == "tests"):
            return ".".join([package, *file.parent.relative_to(folder).parts])
    return ".".join(file.parent.parts[1:])


def sources_of(test: Path, tree: Path = TREE) -> list[Path]:
    """Return the sources of a test, from the root of the project.

    Args:
        test: its file.
        tree: the project.
    """
    test = test.relative_to(tree)
    waiting, seen, names = [test, Path("tests/conftest.py")], set(), set()
    while waiting:
        file = waiting.pop()
        if file in seen or file.is_relative_to(RUNNER):
            continue
        seen.add(file)
        new = {*imported((tree / file).read_bytes(), _package(file))} - names
        names |= new
        waiting += [found for name in new for found in _files(tree, name, test.parent)]
    return sorted(file for file in seen if not file.is_relative_to(HARDWARE))
