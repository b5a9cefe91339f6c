"""Size and speed of several axes through one pipeline, on an ECP5-25F of speed grade 6: the table of `docs/axes.md`.

    python tests/axes_sizes.py levant 16 --seeds 1 2 3
    python tests/axes_sizes.py levant 16 --seeds 1 --supervised

The pipeline is placed and routed alone, without pins, and with or without supervisors: what a link and drive stages
take is not in it.
"""

import argparse
import shutil
import statistics
import sys
from functools import partial
from pathlib import Path

from amaranth.hdl import Module
from amaranth.lib import wiring

from hardwall.hdl.axes import Axes
from hardwall.hdl.export import to_verilog
from hardwall.hdl.lead_out import lead_out
from hardwall.hdl.supervised_axes import SupervisedAxes
from hardwall.model.axes import PIPELINES, AxesSpec
from hardwall.sim.boards.parts import PARTS
from hardwall.sim.commands.terminal import show
from hardwall.sim.jobs.result import Table
from hardwall.sim.jobs.whole_folder import whole_folder
from hardwall.sim.rtl import flow, tools
from hardwall.sim.rtl.timing import timing
from stimuli.specs import MHZ

DEVICE = "ecp5-25k"
CLOCK_HZ = 96_000_000
"""The clock that is asked for; the placer works as hard as it must for it."""
COLUMNS = "axes", "LUT4", "FF", "DSP", "EBR", "fmax (MHz)", "fewest clocks", "M samples/s an axis at fmax"


def spec_of(estimator: str, axes: int) -> AxesSpec:
    """Return axes that sample as fast as their rota allows at `CLOCK_HZ`."""
    roomy = AxesSpec(**MHZ, axes=axes, estimator=estimator)
    # A rate is a whole number of hertz.
    slots = next(slots for slots in range(roomy.slots, CLOCK_HZ) if CLOCK_HZ % slots == 0)
    rate = CLOCK_HZ // slots
    return AxesSpec(
        **{**MHZ, "clock_hz": CLOCK_HZ, "sample_hz": rate, "actuation_hz": rate}, axes=axes, estimator=estimator
    )


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


def placed(spec: AxesSpec, supervised: bool, seeds: list[int]) -> list[dict]:
    """Return nextpnr's report for every seed."""
    part, axes = PARTS[DEVICE], SupervisedAxes(spec) if supervised else Axes(spec)
    name = f"{'supervised-' * supervised}axes-{spec.estimator}-{spec.axes}"
    netlist = flow.netlist(name, part, {"top.v": to_verilog(Alone(axes), "top")}, spec.clock_hz)
    options = ["--freq", f"{spec.clock_hz / 1e6:g}", "--report", flow.REPORT, "--timing-allow-fail", "--out-of-context"]

    def place(work: Path, seed: int) -> None:
        # The placer may see the folder that it runs in, but not every other folder of this machine.
        given = Path(shutil.copy(netlist / flow.NETLIST, work))
        command = [*part.nextpnr, "--json", given.name, "--seed", str(seed), *options]
        tools.run(work, work / "nextpnr.log", command, f"place and route of {name} with seed {seed}")
        given.unlink()

    return [flow.report_of(whole_folder(netlist / f"alone-{seed}", partial(place, seed=seed))) for seed in seeds]


def main() -> None:
    """Print a row of the table for every number of axes."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("estimator", choices=sorted(PIPELINES))
    parser.add_argument("axes", type=int, nargs="+", help="numbers of axes, 1 to 32")
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2, 3])
    parser.add_argument("--supervised", action="store_true", help="with monitors and supervisors")
    asked = parser.parse_args()
    rows = []
    for axes in asked.axes:
        spec = spec_of(asked.estimator, axes)
        reports = placed(spec, asked.supervised, asked.seeds)
        speeds = [1e3 / timing(PARTS[DEVICE], report)[0] for report in reports]
        used = {kind: each["used"] for kind, each in reports[0]["utilization"].items()}
        fmax = statistics.median(speeds)
        spread = f"{fmax:.1f} ({min(speeds):.1f} to {max(speeds):.1f})"
        cells = [str(used[kind]) for kind in ("TRELLIS_COMB", "TRELLIS_FF", "MULT18X18D", "DP16KD")]
        rows.append([str(axes), *cells, spread, str(spec.slots), f"{fmax / spec.slots:.2f}"])
        print(rows[-1], file=sys.stderr, flush=True)
    show(Table(dict.fromkeys(COLUMNS, "right"), rows))


if __name__ == "__main__":
    main()
