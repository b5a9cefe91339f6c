"""Tables of ports, as exact text; `test_export` holds the ports against the Verilog."""

from hardwall.hdl.axis.axis import Axis
from hardwall.hdl.ports import port_table
from stimuli.specs import spec


def test_a_row_of_every_kind_is_exact():
    lines = port_table(Axis(spec("mhz"))).splitlines()
    assert lines[0] == "| port | direction | width | format | one LSB | range | reset | what it is |"
    for line in (
        "| `clk` | in | 1 | bit |  |  |  | clock; everything is done at its rise |",
        "| `encoder_invert` | in | 1 | UQ(1, 0) |  | 0 to 1 | 0 | 1: count the other way |",
        "| `wall_stiffness` | in | 16 | UQ(8, 8) | 3.90625 N/m | 0 to 255996 N/m | 0 | spring of the wall |",
        "| `count` | out | 21 | SQ(21, 0) | 1e-06 m | -1.04858 to 1.04858 m |  | position, live |",
        "| `stamp` | out | 26 | UQ(26, 0) | 2e-08 s | 0 to 1.34218 s |  | number of this clock |",
    ):
        assert line in lines
