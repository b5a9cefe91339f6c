"""Size and speed of several axes through one pipeline, placed and routed alone, without pins.

A link and drive stages are left out, so that there may be more axes than a board has pins for.
"""

import shutil
import statistics
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

from amaranth.hdl import Module
from amaranth.lib import wiring

from ...hdl.axes.axis import Axes
from ...hdl.axes.supervised import SupervisedAxes
from ...hdl.board.lead_out import lead_out
from ...hdl.export import to_verilog
from ...model.axes.axis import AxesSpec
from ..boards.parts import PARTS
from ..boards.top import MODULE
from ..jobs.whole_folder import whole_folder
from . import flow, tools
from .timing import size, timing


class Alone(wiring.Component):
    """Axes, bare or supervised, as a part of a top that has nothing else."""

    def __init__(self, axes: Axes | SupervisedAxes):
        self._axes = axes
        super().__init__(dict(self._axes.signature.members))

    def elaborate(self, platform) -> Module:
        m = Module()
        m.submodules.axes = axes = self._axes
        m.d.comb += lead_out(axes, self, axes.signature.members)
        return m


def synthesise_axes(spec: AxesSpec, device: str, supervised: bool, seeds: Sequence[int]) -> dict[str, Any]:
    """Return size and speed of axes on an ECP5, asked for the clock that they have.

    Args:
        spec: the axes, and their clock.
        device: one of `PARTS`.
        supervised: whether each of them has a supervisor and monitors.
        seeds: the placer's seeds.

    Returns:
        lut4, ff, dsp, bram: cells in use; available: cells of the part; untimed: see `synthesis.summary`.
        latency_clocks: clocks from the strobe of an axis to its changed drive.
        fmax_mhz_seeds: the highest clock with each of `seeds`; fmax_mhz: their median.

    Raises:
        SynthesisError: if a tool is missing or fails.
    """
    part = PARTS[device]
    name = f"{'supervised-' * supervised}axes-{spec.estimator}-{spec.axes}"
    axes = SupervisedAxes(spec) if supervised else Axes(spec)
    netlist = flow.netlist(name, part, {f"{MODULE}.v": to_verilog(Alone(axes), MODULE)}, spec.clock_hz)
    # A clock that is too fast is a result, not a failure.
    options = ["--freq", f"{spec.clock_hz / 1e6:g}", "--report", flow.REPORT, "--timing-allow-fail", "--out-of-context"]

    def place(work: Path, seed: int) -> None:
        # The placer may see the folder that it runs in, but not every other folder of this machine.
        given = Path(shutil.copy(netlist / flow.NETLIST, work))
        command = [*part.nextpnr, "--json", given.name, "--seed", str(seed), *options]
        tools.run(work, work / "nextpnr.log", command, f"place and route of {name} with seed {seed}")
        given.unlink()

    reports = [flow.report_of(whole_folder(netlist / f"alone-{seed}", partial(place, seed=seed))) for seed in seeds]
    cells = flow.cells_of(netlist)
    speeds = [1e3 / timing(part, report, cells)[0] for report in reports]
    return {
        **size(part, reports[0]["utilization"], [cell["type"] for cell in cells.values()]),
        "latency_clocks": axes.latency,
        "seeds": list(seeds),
        "fmax_mhz_seeds": [round(speed, 2) for speed in speeds],
        "fmax_mhz": round(statistics.median(speeds), 2),
    }
