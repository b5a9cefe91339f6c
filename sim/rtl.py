"""The Verilated axis as a shared library: generated and built once a spec, cached by content, and opened for a run."""

import ctypes
import hashlib
import os
import shutil
import subprocess
import tempfile
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

import numpy as np

from ..hdl.axis import Axis
from ..hdl.export import to_verilog
from ..model.compiled import build_dir
from ..model.spec import AxisSpec
from .controllers import Rtl, RtlState
from .verilator import LINT_OPTIONS, environment

SHIM = Path(__file__).with_name("rtl.cpp")
OPTIMISE = [
    "-O3",
    "--x-assign",
    "fast",
    "--x-initial",
    "fast",
    "--noassert",
    "-CFLAGS",
    "-O3",
    "-MAKEFLAGS",
    "OPT_FAST=-O3",
]


class BuildError(RuntimeError):
    """Verilator or the C++ compiler failed; the message names the log."""


def _ports(spec: AxisSpec) -> str:
    """Return the header that tells the shim this axis's ports."""
    words = " ".join(f"WORD({index}, {word.name})" for index, word in enumerate(spec.design.words))
    return (
        f"#define DRIVE_WIDTH {spec.force.width}\n"
        f"#define VELOCITY_WIDTH {spec.design.estimator.velocity.width}\n"
        f"#define AXIS_WORDS {words}\n"
    )


def build(spec: AxisSpec, traced: bool = False) -> Path:
    """Return the shared library of the axis, building it if it is not there.

    It is found by the content of the Verilog, the shim and the tools' versions. It is built in a folder of its own and
    moved into place when whole, so that an interrupted build, or two at once, leave nothing broken behind.

    Args:
        spec: the axis.
        traced: with the code that records waveforms; slower.

    Raises:
        BuildError: if the build fails.
    """
    verilog, ports, shim = to_verilog(Axis(spec), "axis"), _ports(spec), SHIM.read_text()
    options = [*LINT_OPTIONS, *OPTIMISE, *(["--trace-vcd"] if traced else [])]
    content = "\0".join([verilog, ports, shim, version("verilator"), *options])
    folder = build_dir() / "rtl" / hashlib.sha256(content.encode()).hexdigest()[:16]
    library = folder / "libaxis.so"
    if library.exists():
        return library
    folder.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder.parent, prefix="building-") as name:
        work = Path(name)
        for file, text in (("axis.v", verilog), ("axis_ports.h", ports), ("rtl.cpp", shim)):
            (work / file).write_text(text)
        command = ["verilator", "--cc", "--build", "-j", str(os.cpu_count() or 1), "--top-module", "axis", *options]
        command += [
            "-CFLAGS",
            f"-fPIC -I{work}",
            "--lib-create",
            "axis",
            "--Mdir",
            str(work / "obj"),
            "axis.v",
            "rtl.cpp",
        ]
        done = subprocess.run(command, cwd=work, env=environment(), capture_output=True, text=True, check=False)
        if done.returncode:
            log = folder.parent / "failed.log"
            log.write_text(" ".join(command) + "\n" + done.stdout + done.stderr)
            raise BuildError(f"the Verilated library could not be built: see {log}")
        ready = work / "ready"
        ready.mkdir()
        for file in ("axis.v", "axis_ports.h"):
            shutil.move(work / file, ready / file)
        shutil.move(work / "obj" / "libaxis.so", ready / library.name)
        try:
            ready.rename(folder)
        except OSError:
            # Another process was first, with the same content.
            if not library.exists():
                raise
    return library


@dataclass
class Hardware:
    """A reset axis, simulated clock by clock; a context manager that frees it.

    Args:
        spec: the axis.
        words: run-time parameters, by port name.
        level: of the encoder's pins at reset, a | b << 1.
        traced: build it such that `trace` works.
    """

    spec: AxisSpec
    words: dict[str, int]
    level: int = 0
    traced: bool = False

    def __enter__(self) -> "Hardware":
        self._library = ctypes.CDLL(str(build(self.spec, self.traced)))
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
        """The addresses by which the compiled loop calls it."""

        def address(name: str) -> int:
            return ctypes.cast(getattr(self._library, name), ctypes.c_void_p).value

        return Rtl(address("axis_advance"), address("axis_read"), self._context)

    start = RtlState(0, 0, 0)
