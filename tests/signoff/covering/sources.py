"""The sources that a test comes from: itself and all of the project that it imports, found without an import of them.

Some parts of the project are no such sources:

- **The hardware.** It is in the Verilog. But what it imports is: a test may ask a component for its design.
- **What runs the simulator**, `RUNNER`. It imports most of the project, of which nothing comes into a test.
- **What compiles kernels and keeps files**, `RUNTIME`. With it or without, a kernel computes the same.
- **Packages.** Of an `__init__.py` only what it imports counts: it passes names on.
- **Estimators that the test does not name.** Every axis's specification imports all of them by their registry. In its
  place come those whose names are texts in the test or in what it imports of the tests, and the specification's
  default. A test that imports the registry itself has them all.
"""

import ast
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

from hardwall.model.estimators import registry
from hardwall.model.runtime.provenance import imported

from .blocks import TESTS

TREE = TESTS.parent
HARDWARE, RUNNER, RUNTIME = Path("hdl"), Path("sim/rtl"), Path("model/runtime")
REGISTRIES = tuple(Path(room, "estimators/registry.py") for room in ("model", "hdl"))
CHOICE = Path("model/axis/designed.py")
"""Where all estimators are, and where an axis chooses one, with a default."""
ESTIMATORS = {
    name: module.__name__
    for name, design in registry.ESTIMATORS.items()
    for module in vars(registry).values()
    if isinstance(module, ModuleType) and any(own is design for own in vars(module).values())
}
"""The module of every estimator."""
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


def _estimators(content: bytes) -> Iterator[str]:
    """Yield the modules of the estimators whose names are texts in a source."""
    for node in ast.walk(ast.parse(content)):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and node.value in ESTIMATORS:
            yield ESTIMATORS[node.value]


def sources_of(test: Path, tree: Path = TREE) -> list[Path]:
    """Return the sources of a test, from the root of the project.

    Args:
        test: its file.
        tree: the project.
    """
    test = test.relative_to(tree)
    waiting, seen = [test, Path("tests/conftest.py")], set[Path]()
    while waiting:
        file = waiting.pop()
        if file in seen or file.is_relative_to(RUNNER):
            continue
        seen.add(file)
        content, is_test = (tree / file).read_bytes(), file.parts[0] == "tests"
        names = {*imported(content, _package(file))}
        if is_test or file == CHOICE:
            names |= {*_estimators(content)}
        found = (each for name in names for each in _files(tree, name, test.parent))
        waiting += [each for each in found if is_test or each not in REGISTRIES]
    return sorted(file for file in seen if file.name != "__init__.py" and not {HARDWARE, RUNTIME} & {*file.parents})


def code_of(source: bytes) -> str:
    """Return a source without what says nothing to the interpreter: comments, docstrings, and how its lines break."""
    tree = ast.parse(source)
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            node.body = [part for part in node.body if not _is_text(part)] or [ast.Pass()]
    return ast.unparse(tree)


def _is_text(statement: ast.stmt) -> bool:
    return (
        isinstance(statement, ast.Expr)
        and isinstance(statement.value, ast.Constant)
        and isinstance(statement.value.value, str)
    )


def means(*files: str | Path) -> list[str]:
    """Return what some files say to those that run them: the code of Python, and any other text as it is."""
    paths = [Path(file) for file in files]
    return [code_of(path.read_bytes()) if path.suffix == ".py" else path.read_text(encoding="utf-8") for path in paths]


def code_of_all(test: Path) -> dict[str, str]:
    """Return the code of all sources of a test, by their names."""
    return {str(file): code_of((TREE / file).read_bytes()) for file in sources_of(test)}
