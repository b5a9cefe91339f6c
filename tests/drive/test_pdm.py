"""Pulses and a sign: RTL against model at every clock, and what their density promises."""

import cocotb
import pytest

from hardwall.hdl.drive.pdm import Pdm
from hardwall.model.drive import pdm
from hardwall.model.drive.pdm import START, Design, Inputs
from hardwall.model.drive.stage import Amplifier
from hardwall.testing import SAMPLES, Recorded, check, parameters, play, simulate
from stimuli.lengths import some_of
from stimuli.stages import axis, drives

NAMES = ["pdm", "pdm narrow", "pdm scaled"]


def design(name: str) -> Design:
    return axis(name).drive


def make(name: str) -> Recorded:
    return Recorded(Pdm(design(name)))


@cocotb.test()
async def follows_model(dut):
    d, component = design(**parameters()), make(**parameters())
    columns = drives(d.magnitude.width, axis(**parameters()).force_limit_word, SAMPLES // 2, 300)
    inputs, outputs = await play(dut, component, columns)
    armed = inputs.column("armed") if d.scale else [0] * len(columns["reset"])
    # The pins are read before the next edge, with the permission of that clock.
    permitted = [*inputs.column("permitted")[1:], 0]
    state, rows = START, []
    seen = (inputs.column(name) for name in ("reset", "magnitude", "negative"))
    for reset, size, negative, lives, may in zip(*seen, armed, permitted, strict=True):
        state = START if reset else pdm.step(d.params, state, Inputs(size, negative, lives))
        rows.append(pdm.pins(d, state, may))
    expected = {name: [row[name] for row in rows] for name in Design.pins}
    check(inputs, outputs, expected)
    assert all(set(levels) == {0, 1} for levels in expected.values())


@pytest.mark.parametrize("name", some_of(NAMES, 2))
def test_rtl(name):
    simulate(__file__, make, name=name)


@pytest.mark.parametrize("name", NAMES)
def test_the_density_is_the_drive_and_it_comes_in_time(name):
    d, most = design(name), axis(name).force_limit_word
    clocks = 1 << d.magnitude.width
    for size in (0, 1, most // 3, most):
        state, pulses = START, []
        for _ in range(clocks + d.latency):
            state = pdm.step(d.params, state, Inputs(size, 1, 1))
            pulses.append(state.total >> d.params.bits)
        count = sum(pulses[d.latency :])
        # A remainder before makes one pulse more or less; without a scaling the density is exact.
        newtons, wanted = count / clocks * d.full_scale_n, size * axis(name).force_resolution_n
        assert abs(newtons - wanted) <= d.step_n * (1 if d.scale else 1e-9)
        assert state.sign == 1
    # The largest amount after nothing makes its first pulse two clocks after its sum begins.
    state, first = START, 0
    while not state.total >> d.params.bits:
        state, first = pdm.step(d.params, state, Inputs((1 << d.params.bits) - 1, 0, 1)), first + 1
    assert first in (d.latency + 1, d.latency + 2)


@pytest.mark.parametrize("name", NAMES)
def test_an_axis_that_is_not_armed_has_no_pulse_one_clock_later(name):
    d, state = design(name), START
    for _ in range(50):
        state = pdm.step(d.params, state, Inputs(d.magnitude.max, 0, 1))
    # The supervisor makes the drive zero with the state.
    for _ in range(20):
        state = pdm.step(d.params, state, Inputs(0, 0, 0))
        assert pdm.pins(d, state, 1)["drive_pdm"] == 0


def test_full_density_is_the_amplifiers_full_scale():
    assert design("pdm").full_scale_n == pytest.approx(65.536)
    assert design("pdm scaled").full_scale_n == pytest.approx(64.0)


def test_wrong_designs_are_refused():
    with pytest.raises(TypeError, match=r"not 3$"):
        Pdm(3)
    with pytest.raises(TypeError, match=r"^stage must be a pdm.Stage, not 3$"):
        Design(axis("pdm"), 3)
    with pytest.raises(ValueError, match=r"^stage.offset must be 0 with pulses, not 0.1$"):
        Design(axis("pdm"), pdm.Stage(amplifier=Amplifier(unit="V", newtons_per_unit=9.0, full_scale=9.0, offset=0.1)))
    with pytest.raises(
        ValueError, match=r"^force_max_n must be at most 9 N, all that the drive stage gives, not 40.0$"
    ):
        Design(axis("pdm"), pdm.Stage(amplifier=Amplifier(unit="V", newtons_per_unit=1.0, full_scale=9.0)))
