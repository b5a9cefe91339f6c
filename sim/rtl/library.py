"""The Verilated axis as a shared library: built once for every spec, cached by content, and opened for a run."""

import ctypes
import functools
import hashlib
import os
import shutil
from dataclasses import dataclass
from functools import partial
from importlib.metadata import version
from pathlib import Path

import numpy as np
from amaranth.hdl import Shape
from amaranth.lib.wiring import In

from ...hdl.axis import Axis
from ...hdl.export import to_verilog
from ...model.build_folder import build_dir, shown_path
from ...model.spec import AxisSpec
from ..jobs import children
from ..jobs.stages import stage
from ..jobs.whole_folder import keep_log, whole_folder
from .verilated import Rtl, RtlState
from .verilator import LINT_OPTIONS, BuildError, check_paths, environment

LIBRARY = "libaxis.so"
SHIM, RULES = (Path(__file__).with_name(f"library.{suffix}") for suffix in ("cpp", "mk"))
OPTIONS = [
    *LINT_OPTIONS,
    *("--prefix", "Vaxis", "-O3", "--x-assign", "fast", "--x-initial", "fast", "--noassert"),
    # All clocks of one call are iterations of a single evaluation.
    *("--converge-limit", str(1 << 30)),
    # However large the axis, it is one piece of C++.
    *("--output-split", "0"),
]


# A closed loop runs long enough to be worth the best optimisation; the playback of a recording does not.
FAST_TO_RUN, FAST_TO_BUILD = "-O3", "-O1"


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
    files |= {path.name: path.read_text() for path in (SHIM, RULES)}
    return files if traced else files | {"harness.v": _harness(component)}


def build(spec: AxisSpec, traced: bool = False, short: bool = False) -> Path:
    """Return the shared library of the axis; build it first if it is missing.

    It is found by the content of the Verilog, the shim and the tools' versions, and checked before it is used.

    Args:
        spec: the axis.
        traced: include the code that records waveforms, which is slower.
        short: build quickly, for a run so short that building takes most of the time.

    Raises:
        BuildError: if the build fails.
    """
    files = _sources(spec, traced)
    options = [*OPTIONS, *(["--trace-vcd", "--top-module", "axis"] if traced else ["--top-module", "harness"])]
    optimisation = FAST_TO_BUILD if short else FAST_TO_RUN
    content = "\0".join([*files.values(), version("verilator"), *options, optimisation])
    folder = build_dir() / "rtl" / hashlib.sha256(content.encode()).hexdigest()[:16]
    return whole_folder(folder, partial(_verilate, files, options, optimisation)) / LIBRARY


def _verilate(files: dict[str, str], options: list[str], optimisation: str, work: Path) -> None:
    """Write sources, by file name, into the folder `work`, and build the library beside them.

    Args:
        files: the sources.
        options: options of Verilator.
        optimisation: option of the C++ compiler.
        work: the folder.

    Raises:
        BuildError: if the build fails.
    """
    check_paths(build_dir())
    for name, text in files.items():
        (work / name).write_text(text)
    verilog = [name for name in files if name.endswith(".v")]
    jobs, wanted = str(os.cpu_count() or 1), f"OPTIMISATION={optimisation}"
    commands = [
        ["verilator", "--cc", *options, "--Mdir", "obj", *verilog],
        ["make", "-C", "obj", "-j", jobs, "-f", f"../{RULES.name}", LIBRARY, wanted],
    ]
    with stage("building the hardware with Verilator, once"):
        for command in commands:
            try:
                done = children.run(command, cwd=work, env=environment(), capture_output=True, text=True)
            except OSError as error:
                raise BuildError(f"{command[0]} cannot be run: {error.strerror or error}") from None
            if done.returncode:
                text = " ".join(command) + "\n" + done.stdout + done.stderr
                log = keep_log(build_dir() / "rtl" / "failed.log", text)
                raise BuildError(f"the Verilated library could not be built: see {shown_path(log)}")
    shutil.move(work / "obj" / LIBRARY, work / LIBRARY)
    shutil.rmtree(work / "obj")


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
