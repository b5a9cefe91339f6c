"""Size and speed of the board top on real parts: `flow.py` places and routes it, `timing.py` reads what came of it."""

import statistics
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple

from ...hdl.estimators.registry import block_of
from ...hdl.export import to_verilog
from ...model.axes.axis import AxesSpec
from ...model.encoder import quadrature
from ...model.spec import AxisSpec
from ..boards.description import board_of
from ..boards.parts import PARTS
from ..boards.top import MODULE
from . import flow
from .flow import Design
from .timing import size, timing, untimed
from .tools import SynthesisError

PROCESSES = 2


def estimator_cells(spec: AxisSpec, device: str) -> dict[str, int]:
    """Return the cells that the estimator of an axis uses, synthesised alone and not placed: lut4, ff, dsp, bram.

    Raises:
        SynthesisError: if a tool is missing or fails.
    """
    part = PARTS[device]
    verilog = to_verilog(block_of(spec.design.estimator), MODULE)
    folder = flow.netlist(f"estimator-{device}", part, {f"{MODULE}.v": verilog}, spec.clock_hz)
    types = [cell["type"] for cell in flow.cells_of(folder).values()]
    counted = {name: sum(weights.get(kind, 0) for kind in types) for name, weights in part.cells.items()}
    return counted | {"ff": sum(kind.startswith(part.flip_flops) for kind in types)}


class Placed(NamedTuple):
    """A netlist, placed and routed with a seed.

    Attributes:
        seed: the placer's seed.
        folder: the folder of what nextpnr wrote.
        report: nextpnr's report.
        longest: the longest delay between registers, ns.
        path: the two ends of its path.
    """

    seed: int
    folder: Path
    report: dict
    longest: float
    path: str

    @property
    def fmax_mhz(self) -> float:
        """The highest clock."""
        return 1e3 / self.longest


def placed(design: Design, seed: int) -> Placed:
    """Return the netlist of a board, placed and routed with a seed.

    Raises:
        DoesNotFitError: if the part has too few cells.
        SynthesisError: if a tool is missing or fails, or the part's timing is not known.
    """
    part = design.board.part
    if part.multiplier_ns is not None and untimed(design.cells):
        raise SynthesisError(f"a multiplier for {design.board.device} has registers where its delay is not known")
    folder = flow.place_and_route(design, seed)
    report = flow.report_of(folder)
    return Placed(seed, folder, report, *timing(part, report, design.cells))


def _every(design: Design, seeds: Sequence[int]) -> list[Placed]:
    """Return a netlist placed and routed with every seed; `PROCESSES` runs go at a time."""
    # The first seed runs alone: if the tool is still to be compiled for this machine, once is enough.
    runs = [placed(design, seeds[0])]
    with ThreadPoolExecutor(PROCESSES) as pool:
        runs += pool.map(lambda seed: placed(design, seed), seeds[1:])
    return runs


def synthesise(
    spec: AxisSpec | AxesSpec, device: str, seeds: Sequence[int] = (1, 2, 3), glitch_clocks: int = 0
) -> dict:
    """Return size and speed of an axis, or several, as the top of the part's board.

    Args:
        spec: the axis or the axes, and their clock.
        device: one of `PARTS`.
        seeds: the placer's seeds, one run for each; `PROCESSES` runs go at a time.
        glitch_clocks: the decoder's glitch filter, which is part of the latency.

    Returns:
        The result of `summary`; `folder` has the netlist, logs and reports.

    Raises:
        ValueError: if there is no such part, or no seed, or the part's board has no pins for so many axes.
        ClockError: if the board cannot make the axis's clock.
        DoesNotFitError: if the part has too few cells.
        SynthesisError: if a tool is missing or fails.
    """
    if device not in PARTS:
        raise ValueError(f"device must be one of {', '.join(PARTS)}, not {device!r}")
    if not seeds:
        raise ValueError(f"seeds must be one or more, not {seeds!r}")
    design = flow.synthesised(board_of(device), spec)
    return summary(design, _every(design, seeds), glitch_clocks) | {"folder": str(design.folder)}


def summary(design: Design, runs: Sequence[Placed], glitch_clocks: int) -> dict:
    """Return size and speed of a board, from runs with one seed or several.

    Returns:
        estimator, device: names of the estimator and the part.
        seeds, fmax_mhz_seeds: the highest clock with each seed; fmax_mhz: their median.
        clock_mhz, slack_ns: the axis's clock, and its period less the period of fmax_mhz; ok: whether the slack is at
            least 0.
        lut4, ff, dsp, bram: cells in use; available: cells of the part (flip-flops: at most one a LUT4).
        untimed: types of cells in use whose delays are not known; the paths of these are not in fmax.
        clocks_per_sample, interval_clocks: the fewest clocks from a sample to the next; max_sample_hz: the sample rate
            that follows at fmax_mhz, of each axis if there are several.
        latency_clocks: clock edges from the first that sees a changed pin to the change of the supervisor's drive, both
            included; the sample is taken as soon as the decoder has counted the edge; pin_to_force_ns: the longest time
            that follows at fmax_mhz, because the pin may change just after an edge.
        critical_path: the longest path with the slowest seed.
        axes: how many axes there are, of several.
    """
    spec, part = design.top.spec, design.board.part
    fmax = statistics.median(run.fmax_mhz for run in runs)
    slack = 1e9 / spec.clock_hz - 1e3 / fmax
    several = {"axes": spec.axes} if isinstance(spec, AxesSpec) else {}
    interval = spec.slots if isinstance(spec, AxesSpec) else spec.design.interval
    latency = quadrature.latency(glitch_clocks) + design.top.drive_latency
    slowest = max(runs, key=lambda run: (run.longest, run.path))
    return {
        "estimator": spec.estimator,
        "device": design.board.device,
        "fmax_mhz": round(fmax, 2),
        "fmax_mhz_seeds": [round(run.fmax_mhz, 2) for run in runs],
        "seeds": [run.seed for run in runs],
        "clock_mhz": spec.clock_hz / 1e6,
        "slack_ns": round(slack, 3),
        "ok": slack >= 0,
        **size(part, runs[0].report["utilization"], [cell["type"] for cell in design.cells.values()]),
        "clocks_per_sample": interval,
        "interval_clocks": interval,
        "max_sample_hz": round(fmax * 1e6 / interval),
        "latency_clocks": latency,
        "pin_to_force_ns": round(latency * 1e3 / fmax, 1),
        "critical_path": f"{slowest.path}, {slowest.longest:.1f} ns",
        **several,
    }
