"""The section of a motor in a scene, with a damping circuit across its terminals."""

from .quantities import Capacitance, Inductance, Radius, Resistance, TorqueConstant, Voltage
from .section import Section

DAMPING = {"damping_resistance_ohm", "damping_capacitance_f"}
"""The keys of the circuit."""


class MotorSection(Section):
    """A brushed DC motor. With an amplifier's bandwidth its current follows the force; else its voltage does.

    With `damping_resistance_ohm` a resistor is across its terminals, in series with a capacitor if there is one: see
    `hardwall.sim.world.device`.
    """

    resistance_ohm: Resistance
    inductance_h: Inductance
    torque_constant_n_m_per_a: TorqueConstant
    voltage_limit_v: Voltage
    pulley_radius_m: Radius
    damping_resistance_ohm: Resistance | None = None
    damping_capacitance_f: Capacitance | None = None

    def check(self, bandwidth_hz: float | None) -> None:
        """Raise ValueError for a circuit without a resistor, or beside an amplifier that it does nothing to."""
        if self.damping_resistance_ohm is None:
            if self.damping_capacitance_f is not None:
                raise ValueError(
                    "motor.damping_capacitance_f needs motor.damping_resistance_ohm: the two are in series"
                )
        elif bandwidth_hz is None:
            raise ValueError(
                "motor.damping_resistance_ohm needs amplifier.bandwidth_hz, a current loop: without it the amplifier "
                "sets the motor's voltage, and what else is across the terminals changes nothing"
            )
