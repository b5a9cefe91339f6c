"""The test bench: Amaranth components under cocotb on Verilator, compared with a model word for word.

A test file has two halves and is read twice. Under pytest, `simulate` builds the hardware and starts the simulator.
There, cocotb runs the tests of the same file: `Bench` clocks, resets and drives the component, its `campaign` puts rows
of inputs through it, and `check` compares the outputs with the model's by `==`.

`HARDWALL_SEED` (default 1) is the seed of everything random; `HARDWALL_SAMPLES` (default 100000) is the length of the
random campaigns.
"""

from hardwall.model.runtime.extras import need

need("testing")

from .bench import Bench
from .recorded import Recorded, play
from .simulator import CAMPAIGN, SAMPLES, SEED, parameters, rng, simulate
from .verdict import check

__all__ = ["CAMPAIGN", "SAMPLES", "SEED", "Bench", "Recorded", "check", "parameters", "play", "rng", "simulate"]
