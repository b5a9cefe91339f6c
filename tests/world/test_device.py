"""Motors, amplifiers and hands against closed forms."""

import math

import numpy as np
import pytest

from hardwall.sim.world.device import Device, Hand, Motor, Transmission, fastest_per_s
from hardwall.sim.world.linear import State
from stimuli.device_motion import moved

MOTOR = Motor(2.0, 1e-3, 0.04, 24.0, 0.01)  # kf = 4 N/A, stall 48 N, L/R = 0.5 ms, shorted 8 N s/m
REST = State(0.0, 0.0, (0.0, 0.0, 0.0), 0)


def test_a_motor_s_figures_follow_from_its_data_sheet():
    assert MOTOR.newtons_per_ampere == pytest.approx(4.0)
    assert MOTOR.stall_n == pytest.approx(48.0)
    assert MOTOR.electrical_per_s == pytest.approx(2000.0)
    assert MOTOR.damping_n_s_per_m == pytest.approx(8.0)


def test_a_current_loop_follows_the_command_at_its_bandwidth_whatever_the_motor_does():
    for motor in (None, MOTOR):
        device = Device(1e3, bandwidth_hz=100.0, motor=motor)
        end = moved(device, State(0.0, 0.1, (1.0, 0.0, 0.0), 0), 3.0, 2e-3)
        assert end.others[0] == pytest.approx(3.0 - 2.0 * math.exp(-2 * math.pi * 100 * 2e-3), rel=1e-12)


def test_a_held_motor_s_voltage_drive_rises_with_l_over_r():
    end = moved(Device(1e9, motor=MOTOR), REST, 5.0, 1e-3)
    assert end.others[0] == pytest.approx(5.0 * (1 - math.exp(-2.0)), rel=1e-9)


def test_a_voltage_drive_is_damped_by_its_motor():
    """The commanded force is reached at standstill, and the no-load speed is the voltage over kf."""
    end = moved(Device(0.01, motor=MOTOR), REST, 1e6, 0.5)  # far beyond the voltage's limit
    assert end.velocity_m_per_s == pytest.approx(24.0 / 4.0, rel=1e-9)
    assert end.others[0] == pytest.approx(0.0, abs=1e-9)
    slowed = moved(Device(0.4, motor=MOTOR), State(0.0, 1.0, (-8.0, 0.0, 0.0), 0), 0.0, 0.05)
    assert slowed.velocity_m_per_s == pytest.approx(math.exp(-1.0), rel=0.02)  # 8 N s/m on 0.4 kg, L/R late


def test_a_current_loop_gets_no_more_than_its_voltage():
    """For a held motor at its voltage limit, the force rises towards the stall force, not at the loop's rate."""
    device = Device(1e9, bandwidth_hz=5000.0, motor=MOTOR)
    end = moved(device, REST, 40.0, 2e-4)
    assert end.others[0] == pytest.approx(48.0 * (1 - math.exp(-2000 * 2e-4)), rel=1e-9)
    # Near the command, where w (u - f) L/R + f = 48 N, the loop takes over, and the force rises at the loop's rate.
    w = 2 * math.pi * 5000
    over = (w * 40.0 / 2000 - 48.0) / (w / 2000 - 1)
    since = 1e-3 + math.log(1 - over / 48.0) / 2000
    end = moved(device, REST, 40.0, 1e-3)
    assert end.others[0] == pytest.approx(40.0 - (40.0 - over) * math.exp(-w * since), rel=1e-9)


def test_a_current_s_limit_limits_the_force():
    device = Device(1e9, bandwidth_hz=1e3, motor=MOTOR, force_limit_n=2.5 * MOTOR.newtons_per_ampere)
    for command in (40.0, -40.0):
        assert moved(device, REST, command, 0.1).others[0] == pytest.approx(math.copysign(10.0, command), rel=1e-12)


def test_a_hand_is_a_mass_on_a_damped_spring():
    hand = Hand(0.3, 2.0, 500.0, 0.02)
    device, seconds = Device(0.2, 1.0, hand=hand), 0.03
    decay, omega = 3.0 / (2 * 0.5), math.sqrt(500.0 / 0.5)
    beat, goal = math.sqrt(omega**2 - decay**2), 0.02 + 1.5 / 500.0
    fade = math.exp(-decay * seconds)
    at = goal - goal * fade * (math.cos(beat * seconds) + decay / beat * math.sin(beat * seconds))
    assert moved(device, REST, 1.5, seconds).position_m == pytest.approx(at, rel=1e-12)


def test_a_cable_stretches_by_the_force_it_carries():
    """Under a steady push against holding friction, the motor's side moves by u / k, and damping settles it there."""
    device = Device(0.3, 1.0, 1.0, transmission=Transmission(2e4, 20.0, 0.05, 0.0))
    end = moved(device, REST, 0.5, 0.2)
    assert end[:2] == (0.0, 0.0)
    assert end.others[0] == pytest.approx(0.5 / 2e4, rel=1e-12)


def test_the_fastest_rate_bounds_every_eigenvalue_and_overflow_is_infinite():
    device = Device(0.3, 1.0, bandwidth_hz=1e3, transmission=Transmission(1e5, 5.0, 0.05, 0.0))
    slowest_bound = max(2 * math.pi * 1e3, math.sqrt(1e5 / 0.05))
    assert slowest_bound < fastest_per_s(device) < 10 * slowest_bound
    assert fastest_per_s(Device(1e-300, transmission=Transmission(1e300, 0.0, 1e-300, 0.0))) == math.inf
    assert np.isfinite(fastest_per_s(Device(1.0, hand=Hand(0.0, 0.0, 0.0, 0.0))))
