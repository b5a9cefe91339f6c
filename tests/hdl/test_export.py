"""Verilog and the table of its ports: they list the same ports, and both are the same every time."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from hardwall.hdl.any_part import SYNCHRONISER
from hardwall.hdl.axis.axis import Axis
from hardwall.hdl.axis.board import Board
from hardwall.hdl.export import to_verilog, write
from hardwall.hdl.link.axi_link import AxiLink
from hardwall.hdl.ports import port_table
from hardwall.model import register_texts
from hardwall.model.axis.registers import RegisterMap
from hardwall.sim.rtl.verilator import LINT_OPTIONS, environment
from stimuli.lengths import LONG
from stimuli.specs import spec
from support.once import once
from support.tables import rows, verilog_ports

TOPS = {"axis": Axis, "board": Board, "axi": lambda axis: Board(axis, AxiLink(RegisterMap(axis)))}
WRITTEN = ("axis.v", "axi.v", "board.v", "ports.md", "registers.md", "registers.json", "beside.txt")
# Designs that instantiate the axis depend on these names; the words depend on its estimator.
AXIS_PORTS = """
clk rst encoder_a encoder_b encoder_z drive_enable clear_flags preload origin_shift preload_count slip index_arm
commit
encoder_glitch_clocks encoder_invert levant_lambda levant_alpha levant_output wall_stiffness wall_damping wall_position
wall_left wall_forbid_pull output_force_limit output_slew_limit drive sampled actuated count sampled_count velocity
wall_force flags stepped edge_kind edge_down indexed estimated saturated strobe_busy illegal overspeed wrapped
illegal_count index_count index_armed index_latched referenced stamp stamp_a_rise stamp_b_rise stamp_a_fall stamp_b_fall
commit_pending
"""
BOARD_PORTS = """
clk rst oscillator encoder_a encoder_b encoder_z encoder_a_n encoder_b_n drive_enable external_fault emergency_stop
uart_rx uart_tx drive_pdm drive_sign alive outputs_enable
"""
AXI_PORTS = """
clk rst oscillator encoder_a encoder_b encoder_z encoder_a_n encoder_b_n drive_enable external_fault emergency_stop
axi_awaddr axi_awprot axi_awvalid axi_awready axi_wdata axi_wstrb axi_wvalid axi_wready axi_bresp axi_bvalid axi_bready
axi_araddr axi_arprot axi_arvalid axi_arready axi_rdata axi_rresp axi_rvalid axi_rready drive_pdm drive_sign alive
outputs_enable
"""


@pytest.mark.parametrize(
    ("top", "name", "estimator"),
    [
        *(("axis", *axis) for axis in (("paper", "levant"), ("mhz", "fdm"), ("narrow", "levant"))),
        *(("board", "narrow", "levant"), ("axi", "mhz", "fdm")),
    ],
)
def test_table_and_verilog_have_the_same_ports(name, estimator, top):
    component = TOPS[top](spec(name, estimator))
    table = rows(port_table(component))
    seen = {row["port"].strip("`"): (row["direction"], int(row["width"])) for row in table}
    assert len(seen) == len(table)
    assert seen == verilog_ports(to_verilog(component, top), top)
    assert all(row["what it is"] for row in table)


@pytest.fixture(scope="module")
def kept(tmp_path_factory) -> Path:
    """Return a folder in which Yosys keeps what it compiles, where there is no home."""
    return tmp_path_factory.mktemp("kept")


@pytest.fixture(scope="module")
def narrow() -> tuple[Axis, str]:
    """Return an axis, and its Verilog as it is written where there is a home."""
    axis = Axis(spec("narrow", "fdm"))
    return axis, to_verilog(axis, "axis")


@pytest.mark.parametrize("home", ["absent", "relative", "", "/proc/x"])
def test_yosys_works_without_a_home(kept, narrow, tmp_path, monkeypatch, home):
    axis, text = narrow
    monkeypatch.setenv("HARDWALL_BUILD", str(kept))
    monkeypatch.setenv("HOME", str(tmp_path / home) if home == "absent" else home)
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    before = dict(os.environ)
    assert to_verilog(axis, "axis") == text
    assert dict(os.environ) == before
    assert any((kept / ".cache").iterdir())
    assert not (tmp_path / "absent").exists()


@pytest.mark.parametrize(("top", "names"), [("axis", AXIS_PORTS), ("board", BOARD_PORTS), ("axi", AXI_PORTS)])
def test_port_names_are_stable(top, names):
    component = TOPS[top](spec("mhz"))
    assert [row["port"].strip("`") for row in rows(port_table(component))] == names.split()


def test_rows_tell_the_words():
    axis = spec("mhz")
    table = {row["port"].strip("`"): row for row in rows(port_table(Axis(axis)))}
    for word in axis.design.words:
        row = table[word.name]
        assert (row["format"], row["reset"], row["what it is"]) == (str(word.format), str(word.reset), word.doc)
        assert row["range"] == f"{word.si_min:.6g} to {word.si_max:.6g} {word.unit}".strip()
    assert table["wall_position"]["one LSB"] == "1e-06 m"
    assert table["drive"]["one LSB"] == "0.001 N"
    assert table["stamp"]["one LSB"] == "2e-08 s"
    lsb, unit = table["velocity"]["one LSB"].split(" ")
    assert float(lsb) == pytest.approx(axis.design.estimator.velocity.lsb, rel=1e-5)
    assert unit == "m/s"
    for bit, flag in enumerate(axis.design.flags):
        assert f"bit {bit} {flag}" in table["flags"]["what it is"]


def test_other_components_are_refused():
    with pytest.raises(TypeError, match=r"^component must be an Axis, Axes or a board of these, not 3$"):
        port_table(3)


@pytest.fixture(scope="module")
def written(tmp_path_factory) -> Path:
    def write_it(outer: Path) -> None:
        folder = outer / "made"
        assert write(spec("mhz"), folder, {"beside.txt": "any text\n"}) == tuple(folder / name for name in WRITTEN)

    return once(tmp_path_factory, "verilog", write_it) / "made"


def test_a_disk_that_is_full_truncates_no_file(written, tmp_path):
    """A limit on the size of files stands for the full disk."""
    program = (
        "import resource, sys; from stimuli.specs import spec; from hardwall.hdl import export; "
        "export.to_verilog = lambda component, name: 'x' * 5000; "
        "resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000)); export.write(spec('mhz'), sys.argv[1], {})"
    )
    (tmp_path / "axis.v").write_text("an older axis")
    command = [sys.executable, "-c", program, str(tmp_path)]
    done = subprocess.run(command, cwd=Path(__file__).parents[1], capture_output=True, text=True, check=False)
    assert done.stderr.splitlines()[-1].endswith(f"Error: {tmp_path / 'axis.v'}: cannot be written (File too large)")
    assert [(path.name, path.read_text()) for path in tmp_path.iterdir()] == [("axis.v", "an older axis")]


@pytest.mark.parametrize("top", TOPS)
def test_written_verilog_passes_the_lint(written, top):
    command = ["verilator", "--lint-only", *LINT_OPTIONS, "--top-module", top, str(written / f"{top}.v")]
    done = subprocess.run(command, env=environment(), capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")


def test_every_waiver_of_the_lint_has_its_reason():
    (waivers,) = (Path(option) for option in LINT_OPTIONS if option.endswith(".vlt"))
    head, *paragraphs = waivers.read_text(encoding="ascii").split("\n\n")
    assert "lint_off" not in head
    for paragraph in paragraphs:
        *reason, waiver = paragraph.splitlines()
        assert reason
        assert all(line.startswith("// ") for line in reason)
        assert waiver.startswith(("lint_off -rule ", 'lint_off -file "added/'))


@pytest.mark.parametrize(("top", "synchronisers"), [("axis", 1), ("board", 12)])
def test_every_stage_of_a_synchroniser_is_marked(written, top, synchronisers):
    """The registers of a module whose name ends so are its stages, and no other register is marked."""
    text = (written / f"{top}.v").read_text()
    modules = re.findall(r"^module \\?(\S+) \(.*?\);\n(.*?)^endmodule", text, re.S | re.M)
    marks = "".join(f'  (* {name} = "{value}" *)\n' for name, value in SYNCHRONISER.items())
    register = re.compile(rf"^({re.escape(marks)})?(?:  output .*;\n)?  reg (?:\[\d+:0\] )?\S+ += \d+'h", re.M)
    found = {name: register.findall(body) for name, body in modules if name.endswith("synchroniser")}
    assert list(found.values()) == [[marks, marks]] * synchronisers
    others = [body for name, body in modules if name not in found]
    assert sum(len(register.findall(body)) for body in others) > 20
    assert "ASYNC_REG" not in "".join(others)


@pytest.mark.parametrize("top", TOPS)
def test_blocks_of_logic_run_once_at_the_start_in_every_version_of_the_language(written, top):
    """A value that is declared does not let a block run in SystemVerilog, and a blocking one may come too early."""
    text = (written / f"{top}.v").read_text()
    assert "verilog_backend" not in text
    blocks = re.findall(r"^  always @\*.*\n(.*)\n", text, re.M)
    assert blocks
    assert set(blocks) == {r"    if (\$start ) begin end"}
    for module in text.split("endmodule\n"):
        declared = module.count("  reg \\$start ;\n  initial \\$start <= 1'h0;\n")
        assert declared == ("always @*" in module)


@pytest.mark.parametrize("top", TOPS if LONG else ["axis"])
def test_written_verilog_says_what_it_is_of(written, top):
    text = (written / f"{top}.v").read_text()
    head = text.splitlines()[: text.splitlines().index("")]
    assert all(line.startswith("//") for line in head)
    for said in ("clock_hz = 50000000", "estimator = 'levant'", "gains = Gains(lambda_sqrt_m_per_s=15.8"):
        assert any(line.startswith(f"// {said}") for line in head)
    assert text.endswith(to_verilog(TOPS[top](spec("mhz")), top))


def test_written_tables_are_all_there(written):
    text = (written / "ports.md").read_text()
    axis, board = Axis(spec("mhz")), Board(spec("mhz"))
    for table in (port_table(axis), port_table(board), port_table(TOPS["axi"](spec("mhz")))):
        assert f"\n\n{table}" in text
    assert f"\nA sample every 50 clocks; the drive changes {axis.latency} clocks after it is taken. " in text
    assert "\nThe serial line has 921600 baud, 8 data bits, no parity and one stop bit. " in text


def test_written_registers_are_those_of_the_board(written):
    registers = Board(spec("mhz")).registers
    assert (written / "registers.md").read_text() == register_texts.markdown(registers)
    assert (written / "registers.json").read_text() == register_texts.as_json(registers)


def test_text_is_the_same_in_another_process(written, tmp_path):
    program = (
        "import sys; from stimuli.specs import spec; from hardwall.hdl.export import write; "
        "write(spec('mhz'), sys.argv[1], {'beside.txt': 'any text\\n'})"
    )
    command = [sys.executable, "-c", program, str(tmp_path)]
    subprocess.run(command, cwd=Path(__file__).parents[1], env=environment() | {"PYTHONHASHSEED": "7"}, check=True)
    for path in written.iterdir():
        assert (tmp_path / path.name).read_bytes() == path.read_bytes()
    assert len(list(tmp_path.iterdir())) == len(WRITTEN)
