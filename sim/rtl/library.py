"""The Verilated axis as a shared library: built once for every spec, cached by content, and opened for a run."""

import ctypes
import functools
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from amaranth.hdl import Shape
from amaranth.lib.wiring import In

from ...hdl.axis import Axis
from ...hdl.export import to_verilog
from ...model.spec import AxisSpec
from . import shared_library
from .shared_library import FAST_TO_BUILD, FAST_TO_RUN, Recipe
from .verilated import Rtl, RtlState

SHIM = Path(__file__).with_name("library.cpp")


def _ports(spec: AxisSpec) -> str:
    """Return the header that describes the ports of this axis to the shim."""
    words = " ".join(f"WORD({index}, {word.name})" for index, word in enumerate(spec.design.words))
    return (
        f"#define DRIVE_WIDTH {spec.force.width}\n"
        f"#define VELOCITY_WIDTH {spec.design.estimator.velocity.width}\n"
        f"#define AXIS_WORDS {words}\n"
    )


def _harness(component: Axis) -> str:
    """Return Verilog that gives the axis any number of clocks for one change of `go`.

    At every call Verilator evaluates the logic that depends on the inputs. With a synchronous reset among them that is
    the whole next-state logic. With its clock generated inside, the axis pays for it once a call, not twice a clock.
    """
    members = component.signature.members
    ports = [("input", 1, "rst")]
    ports += [
        ("input" if member.flow == In else "output", Shape.cast(member.shape).width, name)
        for name, member in members.items()
    ]
    declared = "".join(f",\n  {way} [{width - 1}:0] {name}" for way, width, name in ports)
    connected = "".join(f", .{name}({name})" for _, _, name in ports)
    return f"""module harness(input go, input [31:0] clocks{declared});
  reg clk = 0, gone = 0;
  reg [31:0] left = 0;
  axis axis(.clk(clk){connected});
  always @(go or posedge clk or negedge clk)
    if (clk) clk <= 0;
    else if (go != gone) begin
      gone <= go;
      left <= clocks - 1;
      clk <= 1;
    end else if (left != 0) begin
      left <= left - 1;
      clk <= 1;
    end
endmodule
"""


@functools.lru_cache(maxsize=1 << 6)
def _sources(spec: AxisSpec, traced: bool) -> dict[str, str]:
    """Return the sources of a library by file name; they take as long to make as a short hit to run."""
    component = Axis(spec)
    files = {"axis.v": to_verilog(component, "axis"), "axis_ports.h": _ports(spec)}
    files[SHIM.name] = SHIM.read_text(encoding="utf-8")
    return files if traced else files | {"harness.v": _harness(component)}


def build(spec: AxisSpec, traced: bool = False, short: bool = False) -> Path:
    """Return the shared library of the axis; build it first if it is missing.

    Args:
        spec: the axis.
        traced: include the code that records waveforms, which is slower.
        short: build quickly, for a run so short that building takes most of the time.

    Raises:
        BuildError: if the build fails.
    """
    options = ("--trace-vcd", "--top-module", "axis") if traced else ("--top-module", "harness")
    optimisation = FAST_TO_BUILD if short else FAST_TO_RUN
    return shared_library.build(Recipe(_sources(spec, traced), SHIM.name, "Vaxis", options, optimisation))


@dataclass
class Hardware:
    """A reset axis, simulated clock by clock; a context manager that frees it.

    Args:
        spec: the axis.
        words: run-time parameters, by port name.
        level: level of the encoder's pins at reset, a | b << 1.
        traced: build the code that `trace` needs.
        short: build it quickly rather than for speed.
    """

    spec: AxisSpec
    words: dict[str, int]
    level: int = 0
    traced: bool = False
    short: bool = False

    def __enter__(self) -> "Hardware":
        self._library = ctypes.CDLL(str(build(self.spec, self.traced, self.short)))
        self._library.axis_open.restype = ctypes.c_void_p
        self._library.axis_open.argtypes = [ctypes.c_int64, ctypes.c_void_p]
        words = np.array([self.words[word.name] for word in self.spec.design.words], np.int64)
        self._context = self._library.axis_open(self.level, words.ctypes.data)
        return self

    def __exit__(self, *_) -> None:
        self._library.axis_close(ctypes.c_void_p(self._context))

    def trace(self, path: Path) -> None:
        """Record a VCD waveform of every signal from here until `end_trace`."""
        self._library.axis_trace(
            ctypes.c_void_p(self._context), str(path).encode(), ctypes.c_double(self.spec.clock_hz)
        )

    def end_trace(self) -> None:
        """Close the waveform."""
        self._library.axis_end_trace(ctypes.c_void_p(self._context))

    @property
    def controller(self) -> Rtl:
        """The addresses by which the compiled loop calls the hardware."""

        def address(name: str) -> int:
            return ctypes.cast(getattr(self._library, name), ctypes.c_void_p).value

        latency = self.spec.design.latency_to_drive
        return Rtl(address("axis_advance"), address("axis_read"), self._context, latency)

    start = RtlState(0, 0, 0)
