"""The packages that this project needs: the extra that installs each, and the range of its versions.

Names and ranges come from the project's metadata, from `pyproject.toml`. A room calls `need` where it is first
imported. So a package that is absent, or of another version, gives one line instead of a fault somewhere inside.
Without metadata, which a copied folder does not have, nothing is checked.
"""

import re
from collections.abc import Iterator
from functools import cache
from importlib.metadata import PackageNotFoundError, requires, version

PROJECT = "hardwall"
REQUIREMENT = re.compile(r"""(?P<name>[\w.-]+)(?P<range>[^;\[]*)(;.*extra == ['"](?P<extra>\w+)['"])?""")
NAMED_OTHERWISE = {"PIL": "pillow", "cocotb_tools": "cocotb", "serial": "pyserial"}
"""Packages by the modules that they install under another name."""
HOLDS = {
    ">=": lambda version, bound: version >= bound,
    "<": lambda version, bound: version < bound,
    "==": lambda version, bound: version == bound,
}


class RequirementError(ImportError):
    """A package is absent, or its version is outside the range: one line with the needed range."""


def version_of_project() -> str | None:
    """Return the version of this project; None without metadata."""
    try:
        return version(PROJECT)
    except PackageNotFoundError:
        return None


def absent(package: str, extra: str | None) -> str:
    """Return the message for a package that is not installed.

    The project is on no package index: what can be installed is a checkout or a wheel.
    """
    of_extra = f"[{extra}]" if extra else ""
    return (
        f"{package} is not installed: it comes with pip install '.{of_extra}' in the checkout of hardwall. "
        f"With the wheel: pip install 'WHEEL{of_extra}'"
    )


def lacking(error: ImportError) -> str | None:
    """Return the message for a failed import; None unless an extra installs the missing package."""
    if isinstance(error, RequirementError):
        return str(error)
    top = (error.name or "").partition(".")[0]
    name = _plain(NAMED_OTHERWISE.get(top, top))
    extra = next((extra for extra, package, _ in _requirements() if extra and _plain(package) == name), None)
    return absent(error.name or "", extra) if extra and isinstance(error, ModuleNotFoundError) else None


@cache
def need(extra: str | None, *packages: str) -> None:
    """Check that packages are installed in the versions of the project's ranges.

    Args:
        extra: the extra that installs them; None for the packages that the project always needs.
        packages: their names; by default all packages of the extra.

    Raises:
        RequirementError: for the first one that is absent, or is outside the range.
    """
    wanted = {_plain(package) for package in packages}
    for its_extra, package, span in _requirements():
        if its_extra == extra and (not wanted or _plain(package) in wanted):
            try:
                installed = version(package)
            except PackageNotFoundError:
                raise RequirementError(absent(package, extra)) from None
            if not _within(installed, span):
                raise RequirementError(f"{PROJECT} needs {package} {' and '.join(span)}, and {installed} is installed")


@cache
def _requirements() -> tuple[tuple[str | None, str, tuple[str, ...]], ...]:
    """Return the extra, the package and the bounds of every requirement of the project."""
    return tuple(_parsed())


def _parsed() -> Iterator[tuple[str | None, str, tuple[str, ...]]]:
    try:
        lines = requires(PROJECT) or []
    except PackageNotFoundError:
        lines = []
    for line in lines:
        match = REQUIREMENT.match(line)
        if match and match["name"] != PROJECT:
            bounds = sorted(filter(None, match["range"].replace(" ", "").split(",")), reverse=True)
            yield match["extra"], match["name"], tuple(bounds)


def _within(installed: str, bounds: tuple[str, ...]) -> bool:
    """Return whether a version lies within bounds such as `>=1.26`; a pre-release counts as its release."""
    for bound in bounds:
        operator, limit = re.fullmatch(r"([<>=]+)(.*)", bound).groups()  # type: ignore[union-attr]
        here, there = _release(installed), _release(limit)
        length = max(len(here), len(there))
        if not HOLDS[operator](here + (0,) * (length - len(here)), there + (0,) * (length - len(there))):
            return False
    return True


def _release(text: str) -> tuple[int, ...]:
    """Return the numbers of a version: 0.50.0 of `0.50.0.post130`."""
    return tuple(map(int, re.match(r"\d+(\.\d+)*", text)[0].split(".")))  # type: ignore[index]


def _plain(name: str) -> str:
    """Return a name in the form that package indexes compare."""
    return re.sub(r"[-_.]+", "-", name).lower()
