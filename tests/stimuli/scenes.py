"""Scenes, and changes of scenes that several tests share: the parts of a device, and short protocols."""

from hardwall.sim.scene.load import AXIS, content_of_scene, names, read

OF_ONE_AXIS = [name for name in names() if AXIS not in content_of_scene(name, read(name))]
"""The scenes that come with the project, without those of several axes."""

AMPLIFIER = {"amplifier.bandwidth_hz": 400.0}
CABLE = {
    "transmission.stiffness_n_per_m": 2e5, "transmission.damping_n_s_per_m": 10.0, "transmission.motor_mass_kg": 0.05,
}  # fmt: skip
HAND = {"hand.mass_kg": 0.2, "hand.damping_n_s_per_m": 3.0, "hand.stiffness_n_per_m": 10.0, "hand.rest_m": 1e-3}
DRIVE = {
    "motor.resistance_ohm": 2.0, "motor.inductance_h": 1e-3, "motor.torque_constant_n_m_per_a": 0.04,
    "motor.voltage_limit_v": 24.0, "motor.pulley_radius_m": 0.01,
}  # fmt: skip
SHUNT = {"motor.damping_resistance_ohm": 3.0, "motor.damping_capacitance_f": 2e-3}
"""A damping circuit, for a scene with the keys of `DRIVE` and `AMPLIFIER`."""
PULSES = {"output.full_scale_n": 50.0, "output.pwm_carrier_hz": 20_000, "output.pwm_steps": 300}
ONE_SECOND = {
    "protocol.settle_s": 0.7, "protocol.mean_s": 0.1, "protocol.measure_s": 0.3, "protocol.longest_s": 1.0,
}  # fmt: skip
TWO_SECONDS = {
    "protocol.settle_s": 1.5, "protocol.mean_s": 0.2, "protocol.measure_s": 0.5, "protocol.longest_s": 2.0,
}  # fmt: skip
COUPLING = {
    "coupling.stiffness_n_per_m": 20e3, "coupling.damping_n_s_per_m": 10.0, "coupling.mass_kg": 0.05,
    "coupling.sample_hz": 1_000,
}  # fmt: skip
"""A tool of 50 g that a host simulates a thousand times a second."""
NARROW = {
    "controller.clock_hz": 1_000_000, "controller.speed_max_m_per_s": 0.02, "controller.glitch_clocks": 1,
}  # fmt: skip
"""An axis of `seed-2011` with few clocks a sample, which several tests build."""
ODD = {"controller.sample_hz": 11_000, "controller.clock_hz": 9_900_000}
SHORT_OF_AXES = {
    "protocol.settle_s": 0.02,
    "protocol.mean_s": 0.005,
    "protocol.measure_s": 0.01,
    "protocol.longest_s": 0.03,
    "protocol.start_m": -2e-5,
}
