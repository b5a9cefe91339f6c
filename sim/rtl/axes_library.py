"""Several Verilated axes as a shared library: built once for every spec, cached by content, and opened for a run."""

import ctypes
import functools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...hdl.axes.axis import Axes
from ...hdl.export import to_verilog
from ...model.axes.axis import FRONT_LATENCY, AxesSpec
from . import shared_library
from .shared_library import Recipe
from .verilated import RtlAxis

SHIM = Path(__file__).with_name("axes_library.cpp")


def _header(spec: AxesSpec) -> str:
    """Return the header that describes the axes to the shim."""
    design = spec.design
    numbers = {
        "AXES": spec.axes,
        "WORDS": len(design.words),
        "ROTA": spec.clocks_per_sample,
        "LATENCY": spec.latency,
        "ESTIMATED": FRONT_LATENCY + spec.pipeline.latency,
        "DRIVE_WIDTH": spec.force.width,
        "VELOCITY_WIDTH": design.estimator.velocity.width,
        "FLAGS_WIDTH": len(design.flags),
        "VALUE_WIDTH": max(word.format.width for word in design.words),
    }
    return "".join(f"#define {name} {number}\n" for name, number in numbers.items())


@functools.lru_cache(maxsize=1 << 4)
def _files(spec: AxesSpec) -> dict[str, str]:
    """Return the sources of a library by their names; they take as long to make as a short hit to run."""
    shim = SHIM.read_text(encoding="utf-8")
    return {"axes.v": to_verilog(Axes(spec), "axes"), "axes_ports.h": _header(spec), SHIM.name: shim}


def build(spec: AxesSpec) -> Path:
    """Return the shared library of the axes; build it first if it is missing.

    Raises:
        BuildError: if the build fails.
    """
    return shared_library.build(Recipe(_files(spec), SHIM.name, "Vaxes", ("--top-module", "axes")))


@dataclass
class HardwareOfAxes:
    """Reset axes with their words in use, simulated clock by clock; a context manager that frees them.

    Args:
        spec: the axes.
        words: the run-time words of every axis, by name.
        levels: the level of every encoder's pins at reset, a | b << 1.
    """

    spec: AxesSpec
    words: Sequence[Mapping[str, int]]
    levels: Sequence[int]

    def __enter__(self) -> "HardwareOfAxes":
        self._library = ctypes.CDLL(str(build(self.spec)))
        self._library.axes_open.restype = ctypes.c_void_p
        self._library.axes_open.argtypes = [ctypes.c_void_p, ctypes.c_void_p]
        names = [word.name for word in self.spec.design.words]
        words = np.array([[own[name] for name in names] for own in self.words], np.int64)
        levels = np.array(self.levels, np.int64)
        self._context = self._library.axes_open(levels.ctypes.data, words.ctypes.data)
        return self

    def __exit__(self, *_) -> None:
        self._library.axes_close(ctypes.c_void_p(self._context))

    @property
    def controllers(self) -> tuple[RtlAxis, ...]:
        """The addresses by which the compiled loop of every axis calls the hardware."""

        def address(name: str) -> int:
            return ctypes.cast(getattr(self._library, name), ctypes.c_void_p).value

        functions = address("axes_give"), address("axes_drive"), address("axes_read")
        return tuple(RtlAxis(*functions, self._context, number) for number in range(self.spec.axes))
