"""The backends by name, and the only code that opens them, sample by sample or for whole records.

`float` and `fixed` are the model of decoder and axis, in float64 or in the hardware's integers; `rtl` is the Verilated
hardware. Any code that runs samples through an axis opens it here, in the form that `controllers` takes.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ...model import stamped
from ...model.axis.axis import Axis
from ...model.encoder import scale_map
from ...model.spec import AxisSpec
from ..rtl.verilated import Rtl, RtlState

if TYPE_CHECKING:
    from ..rtl.library import Hardware

BACKENDS = ("float", "fixed", "rtl")


class Opened(NamedTuple):
    """An axis after reset, ready for its first sample."""

    controller: stamped.Controller | Rtl
    state: stamped.State | RtlState
    hardware: "Hardware | None"  # None on other backends than `rtl`


def is_exact(backend: str) -> bool:
    """Return whether a backend computes in the hardware's words rather than in float64."""
    return backend != "float"


def number_of(backend: str) -> type:
    """Return the type of a backend's drives and velocities."""
    return np.int64 if is_exact(backend) else np.float64


def whole(spec: AxisSpec, backend: str, parameters: dict[str, float]) -> Axis:
    """Return the model of an axis on `float` or `fixed`, for a whole record of counts at once.

    Args:
        spec: the axis.
        backend: `float` or `fixed`.
        parameters: run-time parameters in SI units, by word: see `Axis`.
    """
    return Axis(spec, not is_exact(backend), **parameters)


@contextmanager
def opened(
    spec: AxisSpec,
    backend: str,
    parameters: dict[str, float],
    level: int,
    traced: bool = False,
    short: bool = False,
    scale: scale_map.Params | None = None,
) -> Iterator[Opened]:
    """Open an axis on a backend, and free its resources at the end.

    Args:
        spec: the axis.
        backend: one of `BACKENDS`.
        parameters: run-time parameters in SI units, by word: see `Axis`.
        level: level of the encoder's pins at reset, a | b << 1.
        traced, short: options of `rtl`: built for waveforms; built quickly rather than for speed.
        scale: the map of the encoder's scale that the estimator has, on `float` or `fixed`; None for none.

    Raises:
        RuntimeError: if the RTL could not be built.
    """
    axis = whole(spec, backend, parameters)
    if scale is not None:
        axis.params = axis.params._replace(estimator=axis.params.estimator._replace(scale=scale))
    if backend != "rtl":
        yield Opened(*stamped.controller(axis, level), None)
        return
    from ..rtl.library import Hardware  # noqa: PLC0415  (the other backends need neither Amaranth nor a C++ compiler)

    with Hardware(spec, axis.words, level, traced, short) as hardware:
        yield Opened(hardware.controller, hardware.start, hardware)
