"""Readable Verilog, and the table of its ports, from a component."""

import os

# The Yosys that ships with Amaranth as a wheel: the same version, and so the same text, on every machine.
os.environ.setdefault("AMARANTH_USE_YOSYS", "builtin")

from amaranth.back import verilog
from amaranth.lib import wiring


def to_verilog(component: wiring.Component, name: str) -> str:
    """Return Verilog of `component` as module `name`, with ports `clk` and `rst` beside its members.

    Source attributes are left out, so that the text depends on the design alone and can be cached by its content.
    """
    return verilog.convert(component, name=name, emit_src=False, strip_internal_attrs=True)
