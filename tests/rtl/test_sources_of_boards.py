"""The files of `hardwall verilog`: whole for a board, with waivers, never beside the top of another clock or drive."""

import json
import subprocess
from pathlib import Path

import pytest

from hardwall.model.axes.axis import AxesSpec
from hardwall.model.axis.registers import RegisterMap
from hardwall.model.checks import FieldError
from hardwall.sim.boards.description import BOARDS
from hardwall.sim.boards.pll import ClockError
from hardwall.sim.boards.top import Made, made_for, top_of_axes, top_verilog
from hardwall.sim.rtl import sources
from hardwall.sim.rtl.sources import OtherTopError, files_around, write_verilog
from hardwall.sim.rtl.verilator import environment
from hardwall.sim.scene.load import load
from support.command_line import call

AROUND = {"top.v", "WIRING.md", "wiring.svg", "hardwall.core"}
USUAL = {"board.v", "registers.h", "lint.vlt"}
PINS = {"icebreaker": "icebreaker.pcf", "tangnano9k": "tangnano9k.cst", "ulx3s-25f": "ulx3s.lpf"}
MHZ = load("mhz").spec


@pytest.fixture
def quick(monkeypatch):
    """Write no Verilog of the axis: a stand-in has its clock."""

    def write(spec, folder, beside):
        for name, text in {"board.v": f"// {spec.clock_hz} Hz\n", **beside}.items():
            (folder / name).write_text(text)
        return tuple(folder / name for name in ("board.v", *beside))

    monkeypatch.setattr(sources.export, "write", write)


@pytest.mark.parametrize("name", PINS)
def test_one_command_writes_all_of_a_board_for_one_clock(quick, name, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    code, out, err = call(monkeypatch, capsys, "verilog", "--board", name, "-o", "out")
    assert code == 0, err
    assert {line.rpartition("/")[2] for line in out.splitlines()} == {*USUAL, PINS[name], *AROUND}
    clock_hz = load(BOARDS[name].scene, BOARDS[name].changes).spec.clock_hz
    assert (Path("out") / "board.v").read_text() == f"// {clock_hz} Hz\n"
    assert made_for((Path("out") / "top.v").read_text()) == Made(BOARDS[name].title, clock_hz, "pdm")
    assert f"the clock of the axis is {clock_hz} Hz" in (Path("out") / "hardwall.core").read_text()


def test_a_board_has_the_estimator_and_the_values_that_are_asked_for(quick, tmp_path, monkeypatch, capsys):
    board, changes = BOARDS["icebreaker"], {"controller.estimator": "fdm", "controller.force_max_n": 9.0}
    words = ("--estimator", "fdm", "--set", "controller.force_max_n=9.0")
    # A short path, for what is printed is held to the width of a terminal.
    monkeypatch.chdir(tmp_path)
    for scene, its in ((board.scene, board.changes), ("seed-2011", {"controller.clock_hz": 24_000_000})):
        named = () if its is board.changes else (scene, "--set", "controller.clock_hz=24e6")
        code, _, err = call(monkeypatch, capsys, "verilog", *named, "--board", board.name, *words, "-o", ".")
        assert code == 0, err
        spec = load(scene, its | changes).spec
        assert f'#define HARDWALL_IDENTITY "{RegisterMap(spec).identity}"\n' in (tmp_path / "registers.h").read_text()


def test_a_clock_that_a_board_cannot_make_writes_nothing(quick, tmp_path, monkeypatch, capsys):
    code, _, err = call(monkeypatch, capsys, "verilog", "mhz", "--board", "icebreaker", "-o", str(tmp_path / "out"))
    assert (code, err.count("\n")) == (2, 1)
    assert err.endswith("nearest 45750000, 46500000, 47250000, 48000000, not 50000000\n")
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(ClockError):
        files_around(MHZ, BOARDS["icebreaker"])


def test_a_top_for_another_clock_is_not_left_beside_the_board(quick, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    out = Path("out")
    call(monkeypatch, capsys, "verilog", "--board", "icebreaker", "-o", "out")
    before = {path.name: path.read_bytes() for path in out.iterdir()}
    code, _, err = call(monkeypatch, capsys, "verilog", "mhz", "-o", "out")
    assert (code, err) == (
        2,
        "hardwall: error: out/top.v is the top of iCEBreaker v1.0e for a clock of 24000000 Hz and the drive pdm, "
        "and the scene has 50000000 Hz and pdm: write each board into a folder of its own, with --board\n",
    )
    assert {path.name: path.read_bytes() for path in out.iterdir()} == before
    # The same clock may be written again, and another board replaces the top.
    write_verilog(load("mhz", BOARDS["icebreaker"].changes).spec, out, {})
    write_verilog(MHZ, out, files_around(MHZ, BOARDS["ulx3s-25f"]))
    assert made_for((out / "top.v").read_text()).clock_hz == MHZ.clock_hz


def test_the_folder_of_constraints_takes_no_axis_of_another_clock(quick, tmp_path):
    (tmp_path / "tangnano9k.v").write_text(top_verilog(BOARDS["tangnano9k"], 27_000_000))
    (tmp_path / "folder.v").mkdir()
    with pytest.raises(OtherTopError, match=r"tangnano9k\.v is the top of Tang Nano 9K for a clock of 27000000 Hz"):
        write_verilog(MHZ, tmp_path, {})


BRIDGE = {"stage": "pwm", "newtons_per_volt": 2.0, "full_scale_v": 24.0, "pwm_hz": 100e3, "dead_time_s": 200e-9}
PWM = load("mhz", {"drive": BRIDGE}).spec
ULX3S, CLOCK_HZ = BOARDS["ulx3s-25f"], MHZ.clock_hz
TOPS = {
    "pdm": (top_verilog(ULX3S, CLOCK_HZ), MHZ),
    "pwm": (top_verilog(ULX3S, CLOCK_HZ, "pwm"), PWM),
    "pdm of axis 0 to 0": (top_of_axes(ULX3S, CLOCK_HZ, 1), AxesSpec(axes=1, **load("mhz").requirements)),
    "pdm of axis 0 to 2": (top_of_axes(ULX3S, CLOCK_HZ, 3), AxesSpec(axes=3, **load("mhz").requirements)),
}
"""By its drive, a top and the axis or axes that it is for, all of one board and one clock."""


@pytest.mark.parametrize("drive", TOPS)
def test_a_top_for_another_drive_is_not_left_beside_the_board(quick, tmp_path, drive):
    (tmp_path / "old.v").write_text(TOPS[drive][0])
    assert made_for(TOPS[drive][0]) == Made(ULX3S.title, CLOCK_HZ, drive)
    for its, (_, spec) in TOPS.items():
        if its == drive:
            write_verilog(spec, tmp_path, {})
        else:
            told = rf"the drive {drive}, and the scene has {CLOCK_HZ} Hz and {its}: write each"
            with pytest.raises(OtherTopError, match=told):
                write_verilog(spec, tmp_path, {})


@pytest.mark.parametrize("name", ["old.v", "old.sv", "old.V", "OLD.SV", "TOP.V"])
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig"])
def test_a_top_is_known_by_its_text_and_by_any_name_of_verilog(quick, tmp_path, name, encoding):
    (tmp_path / name).write_text(top_verilog(BOARDS["tangnano9k"], 27_000_000), encoding=encoding)
    with pytest.raises(OtherTopError, match=name):
        write_verilog(MHZ, tmp_path, {})
    (tmp_path / name).rename(tmp_path / "note.txt")
    write_verilog(MHZ, tmp_path, {})


def test_of_a_long_line_only_the_beginning_is_read(quick, tmp_path):
    """A file of one line, a memory's contents perhaps, may be larger than the memory."""
    head = top_verilog(BOARDS["tangnano9k"], 27_000_000)
    (tmp_path / "long.v").write_text(head.replace("// ", f"// {'x' * sources.LONGEST}", 1))
    write_verilog(MHZ, tmp_path, {})


def test_an_unknown_board_and_too_many_axes_are_one_line(quick, tmp_path, monkeypatch, capsys):
    code, _, err = call(monkeypatch, capsys, "verilog", "--board", "nix", "-o", str(tmp_path))
    assert (code, err) == (2, f"hardwall: error: --board must be one of {', '.join(BOARDS)}, not 'nix'\n")
    axes = AxesSpec(axes=2, **load("mhz").requirements)
    with pytest.raises(
        FieldError, match=r"^axes must be absent on icebreaker \(its pins are those of a single axis\), not 2$"
    ):
        files_around(axes, BOARDS["icebreaker"])
    assert "alive_1" in files_around(axes, BOARDS["ulx3s-25f"])["top.v"]


def test_the_waivers_beside_the_verilog_are_enough(tmp_path):
    """Every warning of Verilator is on, and the folder is all that there is."""
    spec = load(BOARDS["icebreaker"].scene, BOARDS["icebreaker"].changes).spec
    paths = write_verilog(spec, tmp_path, files_around(spec, BOARDS["icebreaker"]))
    assert {path.name for path in paths} == {path.name for path in tmp_path.iterdir()}
    identity = json.loads((tmp_path / "registers.json").read_text())["identity"]
    assert f'#define HARDWALL_IDENTITY "{identity}"\n' in (tmp_path / "registers.h").read_text()
    for top in ("axis", "axi", "board"):
        lint = ["verilator", "--lint-only", "-Wall", "lint.vlt", "--top-module", top, f"{top}.v"]
        done = subprocess.run(lint, cwd=tmp_path, env=environment(), capture_output=True, text=True, check=False)
        assert (done.returncode, done.stderr) == (0, "")


def test_the_header_of_several_axes_is_that_of_their_registers(tmp_path):
    paths = write_verilog(AxesSpec(axes=2, **load("mhz").requirements), tmp_path, {})
    assert {path.name for path in paths} == {path.name for path in tmp_path.iterdir()}
    identity = json.loads((tmp_path / "registers.json").read_text())["identity"]
    header = (tmp_path / "registers.h").read_text()
    assert f'#define HARDWALL_IDENTITY "{identity}"\n' in header
    assert "#define HARDWALL_BANKS 2\n" in header
