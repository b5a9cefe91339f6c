"""The cache of built axes: checked before use, built again when damaged; and one line where make cannot build."""

import subprocess
from pathlib import Path

import pytest

from hardwall.sim.rtl import library
from hardwall.sim.rtl.verilator import BuildError
from stimuli.specs import spec

CODE = b"machine code" * 1000


@pytest.fixture
def builds(tmp_path, monkeypatch) -> list[Path]:
    """Set up a stand-in for Verilator and an empty build folder; return the list of its calls."""
    calls = []

    def verilate(files: dict[str, str], options: list[str], work: Path) -> None:
        calls.append(work)
        for name, text in files.items():
            (work / name).write_text(text)
        (work / library.LIBRARY).write_bytes(CODE)

    monkeypatch.setattr(library, "_verilate", verilate)
    monkeypatch.setenv("HARDWALL_BUILD", str(tmp_path / "build"))
    return calls


def test_an_axis_is_built_once_for_every_way_to_build_it(builds):
    ways = [{}, {"short": True}, {"traced": True}]
    paths = {library.build(spec("mhz"), **way) for way in ways for _ in range(2)}
    assert len(paths) == len(builds) == len(ways)


@pytest.mark.parametrize("content", [CODE[: len(CODE) // 2], b"", b"garbage"], ids=["half", "empty", "garbage"])
def test_a_damaged_library_is_built_again(builds, content):
    path = library.build(spec("mhz"))
    path.write_bytes(content)
    assert library.build(spec("mhz")) == path
    assert path.read_bytes() == CODE
    assert len(builds) == 2


def test_a_path_with_a_space_is_one_line_before_anything_runs(tmp_path, monkeypatch):
    monkeypatch.setattr(subprocess, "run", None)
    for name in ("a b", "a\nb"):
        monkeypatch.setenv("HARDWALL_BUILD", str(tmp_path / name))
        with pytest.raises(BuildError) as caught:
            library.build(spec("mhz"))
        message = str(caught.value)
        assert message.startswith(
            "the path of the build folder ($HARDWALL_BUILD) must be without a space for make to build there, not "
        )
        assert message.isprintable()
