"""The package as others get it: built from a copy of the tree, and installed outside of it.

The environments are hostile. Their site-packages cannot be written. There is no home folder. Their path has a letter
beyond ASCII. Where root runs the tests, another user runs the environments.
"""

import importlib.metadata
import os
import shutil
import stat
import subprocess
import sys
import tarfile
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from .archives import ROOT, commit_time_s, normalise

STRANGER = 54321
"""A user of whom the system knows nothing: without a name, a home or a file."""
BUILD = "import sys; from setuptools import build_meta; build_meta.build_{kind}(sys.argv[1])"
OLDEST, NEWEST = "lowest-direct", "highest"
"""The oldest and the newest packages of the ranges, as uv calls them."""
WRITE = stat.S_IWUSR | stat.S_IWGRP | stat.S_IWOTH


@dataclass(frozen=True)
class Source:
    """Where the packages of an environment come from.

    Attributes:
        interpreter: the Python; None for one of the running version. A stranger can start it, if there is such a one.
        resolution: `OLDEST` or `NEWEST` packages of the index; None for those of the running environment. Their files
            are linked, which is quick and needs no index.
    """

    interpreter: str | None = None
    resolution: str | None = None

    def __str__(self) -> str:
        return f"{self.interpreter or 'python'}-{self.resolution or 'linked'}"


@dataclass(frozen=True)
class Environment:
    """A virtual environment with the wheel and the packages of some extras, and no others.

    Attributes:
        folder: its folder; `work` in it is the one place that what runs in it can write.
        user: the number of the user who runs it; None for the user of the tests.
    """

    folder: Path
    user: int | None

    @property
    def work(self) -> Path:
        """The current folder of what runs."""
        return self.folder / "work"

    @property
    def packages(self) -> Path:
        """The folder of the packages."""
        return next((self.folder / "lib").glob("python3.*/site-packages"))

    def run(self, *command: object, path: object = "", **environ: object) -> subprocess.CompletedProcess:
        """Run a command of the environment. It sees the variables that are given, and no others.

        Args:
            command: its words, with the name of a program of the environment as the first one.
            path: what follows the programs of the environment on PATH.
            environ: more variables. A stranger has no HOME, and the user of the tests one that is not there.
        """
        first, *rest = map(str, command)
        settings = {name: str(value) for name, value in environ.items()}
        settings["PATH"] = f"{self.folder / 'bin'}{os.pathsep}{path}"
        if self.user is None:
            identity, settings = {}, {"HOME": str(self.folder / "home")} | settings
        else:
            identity = {"user": self.user, "group": self.user, "extra_groups": []}
        words = [str(self.folder / "bin" / first), *rest]
        return subprocess.run(
            words, cwd=self.work, env=settings, capture_output=True, text=True, check=False, **identity
        )


def built(folder: Path) -> tuple[Path, Path]:
    """Return the sdist, and the wheel that is built from it; both are made in a folder, of a copy of the tree.

    They are the same bytes whenever they are made of the same commit.
    """
    tree = folder / "tree"
    shutil.copytree(ROOT, tree, ignore=_of_no_package)
    sdist = _made("sdist", tree, folder / "dist", "*.tar.gz")
    normalise(sdist)
    with tarfile.open(sdist) as archive:
        archive.extractall(folder, filter="data")
    return sdist, _made("wheel", folder / sdist.name.removesuffix(".tar.gz"), folder / "dist", "*.whl")


def _of_no_package(folder: str, names: list[str]) -> set[str]:
    """Return what of the tree is in no package; a file that setuptools leaves out by itself is not."""
    outside = {name for name in names if name.startswith(".") or name.endswith(".egg-info")}
    return outside | ({"build", "docs"} if Path(folder) == ROOT else set()) | {"__pycache__"} & set(names)


def _made(kind: str, tree: Path, place: Path, pattern: str) -> Path:
    command = [sys.executable, "-c", BUILD.format(kind=kind), str(place)]
    settings = os.environ | {"SOURCE_DATE_EPOCH": str(commit_time_s())}
    done = subprocess.run(command, cwd=tree, env=settings, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return next(place.glob(pattern))


def sources(interpreters: Iterable[str]) -> list[Source]:
    """Return the oldest and the newest packages of each Python that is there and starts."""
    found = [path for path in map(shutil.which, interpreters) if path and _starts(path, None)]
    return [Source(each, resolution) for each in found for resolution in (OLDEST, NEWEST)]


@contextmanager
def environment(source: Source, wheel: Path, *extras: str) -> Iterator[Environment]:
    """Make an environment; remove it at the end."""
    # The temporary folders of pytest are closed to other users.
    place = Path(tempfile.mkdtemp(prefix="hardwåll-"))
    place.chmod(0o755)
    user = STRANGER if os.geteuid() == 0 else None
    interpreter = source.interpreter or _interpreter(user)
    if not _starts(interpreter, user):
        user = None
    made = Environment(place / "environment", user)
    try:
        _checked([interpreter, "-m", "venv", "--without-pip", str(made.folder)])
        made.work.mkdir()
        made.work.chmod(0o777)
        if source.resolution:
            _install(source.resolution, made, wheel, extras)
        else:
            python = str(made.folder / "bin/python")
            _checked(
                [sys.executable, "-m", "pip", "--python", python, "install", "--no-deps", "--no-index", str(wheel)]
            )
            for name in needed(*extras):
                _link(name, made.packages)
        _set_writable(made, False)
        yield made
    finally:
        _set_writable(made, True)
        shutil.rmtree(place)


def _install(resolution: str, made: Environment, wheel: Path, extras: Iterable[str]) -> None:
    """Install the wheel with what it needs from the index, by uv.

    The versions are resolved before: of what a wheel needs, uv always takes the newest. The oldest ones are those that
    have a wheel for the Python: from its release on, Python 3.13 builds no Numba 0.60 and no NumPy 1.26.
    """
    uv, python = [sys.executable, "-m", "uv", "pip"], str(made.folder / "bin/python")
    options = ["--quiet", "--python", python, "--resolution", resolution]
    options += ["--only-binary", ":all:"] if resolution == OLDEST else []
    chosen, versions = [f"--extra={extra}" for extra in extras], str(made.folder / "versions.txt")
    _checked([*uv, "compile", *options, *chosen, "--output-file", versions, str(ROOT / "pyproject.toml")])
    what = f"{wheel}[{','.join(extras)}]"
    _checked([*uv, "install", *options, "--constraint", versions, "--compile-bytecode", what])


def _interpreter(user: int | None) -> str:
    """Return the Python of this version: one that the user can start, if there is one."""
    version = f"python3.{sys.version_info.minor}"
    found = sys._base_executable, shutil.which(version, path="/usr/local/bin:/usr/bin")
    return next((each for each in found if each and _starts(each, user)), sys._base_executable)


def _starts(interpreter: str, user: int | None) -> bool:
    """Return whether a user can start a Python."""
    try:
        return subprocess.run([interpreter, "-c", ""], user=user, cwd="/", check=False).returncode == 0
    except OSError:
        return False


def _checked(command: list[str]) -> None:
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def needed(*extras: str) -> list[str]:
    """Return the names of the packages that the wheel with some extras installs, from the running environment."""
    found: set[str] = set()
    waiting = [("hardwall", frozenset(extras))]
    seen = set(waiting)
    while waiting:
        name, its_extras = waiting.pop()
        for line in importlib.metadata.requires(name) or []:
            wanted = Requirement(line)
            if wanted.marker and not any(wanted.marker.evaluate({"extra": each}) for each in {"", *its_extras}):
                continue
            package = canonicalize_name(wanted.name), frozenset(wanted.extras)
            if package not in seen:
                seen.add(package)
                waiting.append(package)
            found.add(package[0])
    return sorted(found - {"hardwall"})


def _link(name: str, packages: Path) -> None:
    """Link all files of a package of the running environment, with what Python has compiled of them."""
    for file in importlib.metadata.files(name) or []:
        top, *below = file.parts
        if top == ".." and file.parts[-2] == "bin":
            _linked(file.locate(), packages.parents[2] / "bin" / file.name)
        elif top not in ("..", "__pycache__") and not (packages / top).exists():
            origin = Path(file.locate()).parents[len(below) - 1] if below else Path(file.locate())
            if below:
                shutil.copytree(origin, packages / top, copy_function=_linked)
            else:
                _linked(origin, packages / top)


def _linked(origin: object, target: object) -> None:
    """Link a file, or copy it from another file system."""
    try:
        os.link(str(origin), str(target))
    except OSError:
        shutil.copy2(str(origin), str(target))


def _set_writable(made: Environment, writable: bool) -> None:
    """Let nobody write to the environment's folders, but to `work`; or let its owner write to them again."""
    for folder, _, _ in os.walk(made.folder):
        if not Path(folder).is_relative_to(made.work):
            mode = stat.S_IMODE(os.stat(folder).st_mode)
            os.chmod(folder, mode | stat.S_IWUSR if writable else mode & ~WRITE)
