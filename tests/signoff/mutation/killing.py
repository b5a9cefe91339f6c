"""A block's own tests on its mutants, under Verilator: which of them fail."""

import json
from collections.abc import Iterable
from pathlib import Path

from hardwall.model.runtime.build_folder import build_dir
from hardwall.sim.jobs.scratch import scratch
from hardwall.sim.rtl import cocotb_runner
from hardwall.testing import SEED
from hardwall.testing.harness import SEQUENCER, Harness
from signoff.covering.sizes import Size

from .netlist import Netlist
from .stand_in import StandIn

HERE = Path(__file__).parent
OPTIONS = (
    # A mutant parts one bit from a word. Verilator then takes words for circles that are none, bit by bit.
    "-Wno-UNOPTFLAT",
)


def killed(size: Size, netlist: Netlist, numbers: Iterable[int], samples: int | None = None) -> dict[int, str | None]:
    """Return which test killed each of some mutants, and how; None for those that survived.

    The number 0 is the component without a mutant, whose tests are run first. If these fail, nothing else is run.

    Args:
        size: the component and its tests.
        netlist: the component with its mutants.
        numbers: the mutants.
        samples: the length of a campaign; None for that of the ordinary tests.

    Raises:
        RuntimeError: if the simulation cannot be built, or fails.
    """
    folder, stand_in = build_dir() / "mutate", StandIn(netlist)
    with scratch(folder) as own:
        report = own / "report"
        given = {"test": str(size.test), "numbers": list(numbers), "report": str(report)}
        environ = {"HARDWALL_PARAMETERS": json.dumps(size.parameters), "HARDWALL_MUTATION": json.dumps(given)}
        if samples is not None:
            environ["HARDWALL_SAMPLES"] = str(samples)
        job = cocotb_runner.Job(
            module="in_simulator",
            folder=HERE,
            environ=environ,
            seed=SEED,
            log=own / "log",
            more=SEQUENCER.read_text(encoding="ascii") + stand_in.verilog,
            options=OPTIONS,
        )
        try:
            cocotb_runner.simulate(Harness(stand_in), "mutated", job)
        except RuntimeError:
            log = own / "log"
            (folder / "failed.log").write_text(log.read_text() if log.exists() else "", encoding="utf-8")
            raise
        return {int(number): by for number, by in json.loads(report.read_text(encoding="utf-8")).items()}
