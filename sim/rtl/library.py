"""The Verilated axis as a shared library: built once for every spec, cached by content, and opened for a run."""

import ctypes
import functools
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from amaranth.hdl import Shape
from amaranth.lib.wiring import In

from ...hdl.axis.axis import Axis
from ...hdl.export import to_netlist, to_verilog
from ...model.encoder import quadrature
from ...model.estimators.acceleration import Accelerated
from ...model.runtime.stages import logger
from ...model.spec import AxisSpec
from . import resting, shared_library
from .resting import Resting, RestsNotError
from .shared_library import FAST_TO_BUILD, FAST_TO_RUN, Recipe
from .verilated import Rtl, RtlState

SHIM = Path(__file__).with_name("library.cpp")


def shown_by(spec: AxisSpec) -> tuple[str, ...]:
    """Return the outputs of an axis that the compiled loop reads."""
    more = {"sampled_count": spec.coupling, "acceleration": isinstance(spec.design.estimator, Accelerated)}
    return ("drive", "velocity", "flags", *(name for name, has in more.items() if has))


def resting_of(spec: AxisSpec) -> Resting:
    """Return the counters that may run in an axis while the rest rests, and the test for this rest.

    Raises:
        RestsNotError: if none of its clocks may be skipped.
    """
    return resting.check(to_netlist(Axis(spec), "axis"), shown_by(spec))


def _header(spec: AxisSpec, rest: Resting | None) -> str:
    """Return the header that describes an axis to the shim: its ports, and how it rests, None if no clock is skipped.

    Of the names of a counter Verilator keeps one, which is none with a `$` or two underscores.
    """
    words = " ".join(f"WORD({index}, {word.name})" for index, word in enumerate(spec.design.words))
    members = [
        (f"harness__DOT__axis__DOT__{name.replace('.', '__DOT__')}, {(1 << counter.width) - 1}", counter.stops)
        for counter in (rest.counters if rest else ())
        for name in counter.names
        if "$" not in name and "__" not in name
    ]
    masks = {word.name: (1 << word.format.width) - 1 for word in spec.design.words}
    move, count, acceleration, estimator = "", "0", "0", spec.design.estimator
    if isinstance(estimator, Accelerated):
        acceleration = f"extend(context.axis.acceleration, {estimator.acceleration.width})"
    if spec.coupling:
        surface = {"wall_position": "position", "wall_velocity": "velocity"}
        move = " ".join(f"axis.{name} = {value} & {masks[name]};" for name, value in surface.items())
        count = f"extend(context.axis.sampled_count, {spec.count_width})"
    return (
        f"#define MOVE(axis, position, velocity) {move}\n"
        f"#define SAMPLED_COUNT {count}\n"
        f"#define ACCELERATION {acceleration}\n"
        f"#define DRIVE_WIDTH {spec.force.width}\n"
        f"#define VELOCITY_WIDTH {estimator.velocity.width}\n"
        f"#define AXIS_WORDS {words}\n"
        f"#define SKIPS {int(rest is not None)}\n"
        f"#define RESTED {rest.clocks if rest else 0}\n"
        f"#define SAMPLE_CLOCKS {spec.design.latency_to_drive + 1}\n"
        f"#define COUNTERS {' '.join(f'COUNTER({member})' for member, _ in members)}\n"
        f"#define STOPS {' '.join(f'STOP({member}, {stop})' for member, stops in members for stop in stops)}\n"
    )


def _harness(component: Axis) -> str:
    """Return Verilog around the axis in which nothing follows from an input before the next clock.

    So Verilator's function for the clock is all there is to evaluate, and it is the smaller for it. Inputs that do not
    change are constant; parameters are in registers, from the clock after `commit` on; A and B go to registers in the
    axis.
    """
    members = component.signature.members
    widths = {name: Shape.cast(member.shape).width for name, member in members.items()}
    words = [word.name for word in component.spec.design.words]
    ports = ["input clk", "input encoder_a", "input encoder_b", "input commit"]
    ports += [f"input [{widths[name] - 1}:0] {name}" for name in words]
    shown = shown_by(component.spec)
    ports += [f"output [{widths[name] - 1}:0] {name}" for name in shown]
    given = {"clk": "clk", "rst": "1'b0", "encoder_a": "encoder_a", "encoder_b": "encoder_b", "drive_enable": "1'b1"}
    given |= {"commit": "committed"} | {name: f"held_{name}" for name in words} | {name: name for name in shown}
    others = {name: f"{widths[name]}'b0" if member.flow == In else "" for name, member in members.items()}
    connected = ", ".join(f".{name}({value})" for name, value in (others | given).items())
    held = "".join(f"  reg [{widths[name] - 1}:0] held_{name} = 0;\n" for name in words)
    taken = "".join(f"      held_{name} <= {name};\n" for name in words)
    return f"""module harness({", ".join(ports)});
  // verilator lint_off PINCONNECTEMPTY
  reg committed = 0;
{held}  axis axis({connected});
  always @(posedge clk) begin
    committed <= commit;
    if (commit) begin
{taken}    end
  end
endmodule
"""


@dataclass(frozen=True)
class _Sources:
    """The parts of a library: its files, and the reason if none of its clocks can be skipped."""

    files: dict[str, str]
    why_not: str = ""


@functools.lru_cache(maxsize=1 << 6)
def _sources(spec: AxisSpec, traced: bool) -> _Sources:
    """Return the sources of a library; they take as long to make as a short hit to run."""
    component = Axis(spec)
    files = {"axis.v": to_verilog(component, "axis"), SHIM.name: SHIM.read_text(encoding="utf-8")}
    if traced:
        return _Sources(files | {"axis_ports.h": _header(spec, None)})
    files["harness.v"] = _harness(component)
    try:
        return _Sources(files | {"axis_ports.h": _header(spec, resting_of(spec))})
    except RestsNotError as error:
        return _Sources(files | {"axis_ports.h": _header(spec, None)}, str(error))


def build(spec: AxisSpec, traced: bool = False, short: bool = False) -> Path:
    """Return the shared library of the axis; build it first if it is missing.

    Where clocks cannot be skipped the log says why.

    Args:
        spec: the axis.
        traced: include the code that records waveforms of every clock; it is slower.
        short: build quickly, for a run so short that building takes most of the time.

    Raises:
        BuildError: if the build fails.
    """
    sources = _sources(spec, traced)
    if sources.why_not:
        logger.warning(f"the RTL runs every clock, for {sources.why_not}")
    options = ("--trace-vcd", "--top-module", "axis") if traced else ("--top-module", "harness")
    optimisation = FAST_TO_BUILD if short else FAST_TO_RUN
    return shared_library.build(Recipe(sources.files, SHIM.name, "Vaxis", options, optimisation))


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
        self._library.axis_evaluated.restype = ctypes.c_int64
        self._library.axis_open.argtypes = [ctypes.c_int64, ctypes.c_void_p, ctypes.c_int64]
        words = np.array([self.words[word.name] for word in self.spec.design.words], np.int64)
        decoder_clocks = quadrature.latency(self.words["encoder_glitch_clocks"])
        self._context = self._library.axis_open(self.level, words.ctypes.data, decoder_clocks)
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

    def skip_nothing(self) -> None:
        """Evaluate every clock from here on."""
        self._library.axis_skip_nothing(ctypes.c_void_p(self._context))

    @property
    def evaluated(self) -> int:
        """How many clocks were evaluated since the reset; the others were skipped."""
        return self._library.axis_evaluated(ctypes.c_void_p(self._context))

    @property
    def controller(self) -> Rtl:
        """The addresses by which the compiled loop calls the hardware."""

        def address(name: str) -> int:
            return ctypes.cast(getattr(self._library, name), ctypes.c_void_p).value

        latency = self.spec.design.latency_to_drive
        return Rtl(address("axis_advance"), address("axis_read"), address("axis_move"), self._context, latency)

    start = RtlState(0, 0, 0)
