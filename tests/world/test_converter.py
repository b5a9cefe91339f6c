"""The steps and pulses into which a converter turns the command."""

import numpy as np
import pytest

from hardwall.sim.world.converter import Converter, Pulse, converted, width_of
from hardwall.sim.world.device import Device, equations, train
from hardwall.sim.world.linear import State
from oracles.device import exponential
from stimuli.device_motion import COARSE, after


def test_a_converter_takes_the_nearest_code_and_saturates():
    four_bits = Converter(0.5, -8, 7)
    for command, given in ((0.0, 0.0), (0.24, 0.0), (0.25, 0.5), (-0.25, 0.0), (-0.26, -0.5), (1e9, 3.5), (-1e9, -4.0)):
        assert converted(four_bits, command) == given
    assert converted(None, 0.123) == 0.123


def test_a_pulse_is_as_wide_as_the_command():
    pulse = Pulse(10.0, 1000, 10)
    for command, width in ((0.0, 500), (10.0, 1000), (-10.0, 0), (99.0, 1000), (-99.0, 0), (5.0, 750), (0.09, 500)):
        assert width_of(pulse, command) == width
    assert width_of(pulse, 0.11) == 510


@pytest.mark.parametrize("period", [40, 64])
def test_pulses_move_the_device_as_the_forces_that_they_are(period):
    """Intervals have a length that the period does not divide, and the command changes in mid-pulse."""
    encoder, rng = COARSE._replace(clock_hz=1e6), np.random.default_rng(5)
    pulse = Pulse(10.0, period, 4)
    device = Device(0.3, 2.0, bandwidth_hz=2e3, pulse=pulse)
    matrix = np.zeros((5, 5))
    matrix[:3] = equations(device).rates
    system = train(device, 1e-4)
    state, expected, width = State(0.0, 0.1, (0.0, 0.0, 0.0), period // 2), [0.0, 0.1, 0.0], period // 2
    widths = set()
    for clock in range(0, 300, 30):
        command = float(rng.normal(0, 6))
        state = after(system, state, command, 30e-6, clock, 30, encoder)
        for now in range(clock, clock + 30):
            if now % period == 0:
                width = width_of(pulse, command)
                widths.add(width)
            level = 10.0 if now % period < width else -10.0
            expected = [float(value) for value in exponential(matrix, 1e-6, [*expected, 1.0, level])[:3]]
        assert [*state[:2], state.others[0]] == pytest.approx(expected, rel=1e-12, abs=1e-15)
    assert len(widths) > 3
