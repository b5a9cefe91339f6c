"""Tables of ports, as exact text; `test_export` holds the ports against the Verilog."""

from dataclasses import replace

import pytest

from hardwall.hdl.axis.axis import Axis
from hardwall.hdl.ports import port_table
from hardwall.model.estimators.acceleration import Accelerated
from hardwall.model.estimators.registry import ESTIMATORS
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


@pytest.mark.parametrize("estimator", ESTIMATORS)
def test_every_port_of_every_estimator_has_a_row(estimator):
    axis = spec("mhz", estimator)
    accelerated = issubclass(ESTIMATORS[estimator], Accelerated)
    component = Axis(replace(axis, virtual_mass_max_kg=0.1) if accelerated else axis)
    table = port_table(component)
    assert all(f"| `{name}` |" in table for name in component.signature.members)
    assert ("| `acceleration` | out |" in table) == ("| `free_mass` | in |" in table) == accelerated
