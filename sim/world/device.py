"""The device of a scene with more than a rigid handle: its parts as matrices, for `taylor` to advance.

The parts follow in order from the command u (N), which the controller and the steady push give, to the handle. All
quantities refer to the handle's straight line: with the pulley's radius r, the motor's torque constant gives
kf = Kt / r.

- Amplifier: |u| <= kf I. With a bandwidth w (1/s), df/dt = w (u - f). With neither a bandwidth nor a motor, f = u.
- Motor: its resistance is R, its inductance L, its voltage limit V and its force f. A voltage is given as the force
  that it would hold at standstill, e = kf V / R; with the motor's speed vm, L/R df/dt = e - f - (kf^2 / R) vm. An
  amplifier with a bandwidth is a current loop. It asks for the e that makes df/dt = w (u - f), and gets no more than
  its limit. An amplifier without a bandwidth asks for e = u at any current: a voltage drive, damped by the motor.
- Shunt: a resistor Rd, alone or in series with a capacitor C, across the terminals of a motor with a current loop. The
  motor's own voltage drives a current through it, and that damps. With h its current (as a force of the motor) and q
  the capacitor's voltage (as a force at standstill; 0 without one), e = q + (Rd / R) h and dq/dt = h / (R C). The loop
  makes f + h = g r, dr/dt = w (u - r), where g = 1 + R / Rd without a capacitor, else 1: u is the force at standstill,
  and |u| <= kf I / g. Where that takes more than the voltage's limit, e is at the limit, and h is what e makes it.
  Within the limit the motor's side meets the damping kf^2 / Z, whatever u is, with Z = R + Rd + s L + 1 / (s C). f is
  then g (Rd + 1 / (s C)) / Z times r. With a capacitor there is hardly any damping below the corner 1 / ((R + Rd) C).
- Transmission: a cable of stiffness k and damping d. The motor's side is a separate mass: with s its position less the
  handle's, and w = ds/dt, mm d(v + w)/dt = f - c - bm (v + w), c = k s + d w. Without a transmission c = f.
- Hand: a mass that moves with the handle, held by a spring and a damper, with the force kh (rest - x) - bh v.
- Handle: m dv/dt = c + hand - b v - Fc sign(v); it rests for as long as v = 0 and the force on it is within Fc.

A converter or pulses act on the command before all of these parts; pulses reach the parts unsmoothed.

The state is x, v; s, w with a transmission; f with a lag or a motor; r with a shunt, q with its capacitor: a part that
is absent has no row.
"""

import math
from dataclasses import dataclass

import numpy as np
import scipy

from .converter import AS_IT_IS, Pulse
from .linear import COLUMNS, COMMAND, EXTRA, GRIP, ONE, PHASES, QUANTITIES, SEEN, STATES, VOLTAGE, phase_number
from .polynomials import FIRST
from .taylor import Train

LEG_RATE = 1.0
"""The longest leg that one Taylor polynomial serves: its length times the fastest rate."""
LEGS_MAX = 25_000
"""The most legs in a sample that the solver accepts: 1 g on a damper of 1e4 N s/m for 1 ms, and a little more."""
BEYOND = 1e100
"""A rate of change, in 1/s, N/s or any other unit, that is too large for balancing a matrix."""
TRUNCATION = 2.0**-54


@dataclass(frozen=True)
class Motor:
    """A brushed DC motor and its pulley; the attributes are named as on a data sheet."""

    resistance_ohm: float
    inductance_h: float
    torque_constant_n_m_per_a: float
    voltage_limit_v: float
    pulley_radius_m: float

    @property
    def newtons_per_ampere(self) -> float:
        """Force at the handle per ampere."""
        return self.torque_constant_n_m_per_a / self.pulley_radius_m

    @property
    def stall_n(self) -> float:
        """Force at standstill at the voltage limit."""
        return self.newtons_per_ampere * self.voltage_limit_v / self.resistance_ohm

    @property
    def electrical_per_s(self) -> float:
        """Rate at which the current settles, R / L."""
        return self.resistance_ohm / self.inductance_h

    @property
    def damping_n_s_per_m(self) -> float:
        """Damping by the motor's own voltage as it moves with the winding shorted."""
        return self.newtons_per_ampere**2 / self.resistance_ohm


@dataclass(frozen=True)
class Shunt:
    """A circuit across the terminals of a motor that a current loop feeds: a resistor, or a resistor and a capacitor in
    series."""

    resistance_ohm: float
    capacitance_f: float | None = None

    @property
    def states(self) -> int:
        """Number of states that it adds: the command reached by the loop, and the capacitor's voltage."""
        return 2 if self.capacitance_f else 1

    def amplified(self, motor: Motor) -> float:
        """Return the amplifier's current relative to the current of a motor at standstill."""
        return 1.0 if self.capacitance_f else 1.0 + motor.resistance_ohm / self.resistance_ohm


@dataclass(frozen=True)
class Transmission:
    """A cable between motor and handle."""

    stiffness_n_per_m: float
    damping_n_s_per_m: float
    motor_mass_kg: float  # rotor and pulley, as felt at the handle
    motor_viscous_n_s_per_m: float


@dataclass(frozen=True)
class Hand:
    """A hand that holds the handle."""

    mass_kg: float
    damping_n_s_per_m: float
    stiffness_n_per_m: float
    rest_m: float


@dataclass(frozen=True)
class Device:
    """The parts of a device; a part that is absent is None.

    Attributes:
        mass_kg, viscous_n_s_per_m, coulomb_n: the handle's mass and friction; `coulomb_n` is None without dry friction.
        bandwidth_hz, force_limit_n: the amplifier's bandwidth, and the force of its largest current.
        motor, transmission, hand: see their classes.
        shunt: see its class; only beside a motor and a bandwidth.
        encoder_at_motor: whether the encoder is on the motor's side of the transmission.
        pulse: the pulses that a pulse-width output makes of the command.
    """

    mass_kg: float
    viscous_n_s_per_m: float = 0.0
    coulomb_n: float | None = None
    bandwidth_hz: float | None = None
    force_limit_n: float = math.inf
    motor: Motor | None = None
    transmission: Transmission | None = None
    hand: Hand | None = None
    encoder_at_motor: bool = False
    pulse: Pulse = AS_IT_IS
    shunt: Shunt | None = None

    @property
    def command_limit_n(self) -> float:
        """The largest command that is passed on: the limit of the amplifier's current, or a voltage drive's voltage."""
        if self.motor is not None and self.bandwidth_hz is None:
            return self.motor.stall_n
        return self.force_limit_n / (1.0 if self.shunt is None else self.shunt.amplified(self.motor))


@dataclass(frozen=True)
class Equations:
    """A device in one phase; every quantity is a row of the coefficients of the state, of 1, and of the command.

    Attributes:
        rates: the state's rates of change.
        on_handle: the force on the handle, N, without Coulomb friction.
        voltage: the voltage that the current loop asks for, N at standstill; None without a current loop and its limit.
        seen: the encoder's position, m.
    """

    rates: np.ndarray
    on_handle: np.ndarray
    voltage: np.ndarray | None
    seen: np.ndarray


def equations(device: Device, along: int | None = None, limited: int = 0) -> Equations:
    """Return the device's equations, as the beginning of this file gives them.

    Args:
        device: its parts.
        along: direction of the handle's motion, -1 or 1, or 0 where friction holds it; None for no Coulomb friction.
        limited: -1 or 1 where a current loop's voltage is at that limit, else 0.
    """
    cable, hand, motor = device.transmission, device.hand, device.motor
    lagging = device.bandwidth_hz is not None or motor is not None
    mechanical = 2 + 2 * (cable is not None)
    n = mechanical + lagging + (0 if device.shunt is None else device.shunt.states)
    unit = np.eye(n + 2)
    nothing, position, one, command = np.zeros(n + 2), unit[0], unit[n], unit[n + 1]
    velocity = nothing if along == 0 else unit[1]
    force = unit[mechanical] if lagging else command
    stretch, stretching = (unit[2], unit[3]) if cable else (nothing, nothing)

    pull = cable.stiffness_n_per_m * stretch + cable.damping_n_s_per_m * stretching if cable else force
    on_handle, mass = pull - device.viscous_n_s_per_m * velocity, device.mass_kg
    if hand:
        on_handle = on_handle + hand.stiffness_n_per_m * (hand.rest_m * one - position)
        on_handle = on_handle - hand.damping_n_s_per_m * velocity
        mass += hand.mass_kg
    friction = (along or 0) * (device.coulomb_n or 0.0) * one
    acceleration = nothing if along == 0 else (on_handle - friction) / mass
    rates, motor_velocity = [velocity, acceleration], velocity + stretching
    if cable:
        on_motor = force - pull - cable.motor_viscous_n_s_per_m * motor_velocity
        rates += [stretching, on_motor / cable.motor_mass_kg - acceleration]

    voltage = None
    if lagging:
        electrical, voltage = _electrical(device, unit, mechanical, motor_velocity, limited)
        rates += electrical
    return Equations(np.array(rates), on_handle, voltage, position + stretch * device.encoder_at_motor)


def _electrical(
    device: Device, unit: np.ndarray, first: int, motor_velocity: np.ndarray, limited: int
) -> tuple[list[np.ndarray], np.ndarray | None]:
    """Return the rates of amplifier, motor and shunt, whose states begin at `first`, and the voltage asked for.

    `unit` has the rows of the state, of 1, and of the command; the rest is as in `equations`.
    """
    motor, shunt = device.motor, device.shunt
    force, one, command = unit[first], unit[-2], unit[-1]
    followed = force if shunt is None else unit[first + 1]
    asked = None if device.bandwidth_hz is None else 2 * math.pi * device.bandwidth_hz * (command - followed)
    if motor is None:
        return [asked], None
    settled, limit = force + motor.damping_n_s_per_m * motor_velocity, limited * motor.stall_n * one
    if shunt is None:
        voltage = None if asked is None else settled + asked / motor.electrical_per_s
        if asked is None or limited:
            asked = motor.electrical_per_s * ((command if asked is None else limit) - settled)
        return [asked], voltage
    charge = unit[first + 2] if shunt.capacitance_f else np.zeros(len(unit))
    ratio = shunt.resistance_ohm / motor.resistance_ohm
    voltage = charge + ratio * (shunt.amplified(motor) * followed - force)
    given = limit if limited else voltage
    rates = [motor.electrical_per_s * (given - settled), asked]
    if shunt.capacitance_f:
        rates.append((given - charge) / (shunt.resistance_ohm * shunt.capacitance_f))
    return rates, voltage


def fastest_per_s(device: Device) -> float:
    """Return a bound on the device's rates of change, 1/s: the largest 1-norm of its balanced matrices.

    The bound is infinite where the rates are too large for balancing.
    """
    norms = []
    for along in (0, 1):
        for limited in (0, 1):
            with np.errstate(over="ignore", invalid="ignore"):
                rates = equations(device, along, limited).rates
            if not (np.abs(rates) < BEYOND).all():
                return math.inf
            balanced = scipy.linalg.matrix_balance(rates[:, : len(rates)], permute=False)[0]
            norms.append(np.abs(balanced).sum(axis=0).max())
    return float(max(norms))


def train(device: Device, longest_s: float) -> Train:
    """Return the device in the form that `taylor` advances.

    Args:
        device: its parts.
        longest_s: the longest interval of constant command.

    The polynomial of a leg ends where the rest of its series is under 2^-54 of the change over the leg.
    """
    fastest = fastest_per_s(device)
    leg_s = min(longest_s, LEG_RATE / fastest) if fastest else longest_s
    reach, order, rest = fastest * leg_s, 1, math.inf
    while rest > TRUNCATION or order < 2:
        order += 1
        rest = reach**order / math.factorial(order + 1) / (1 - LEG_RATE / 2)
    free = equations(device)
    n = len(free.rates)
    # The tables have room inside for states that it lacks, and room at the end for more states.
    extra = EXTRA if n > STATES else 0
    rows, places = ([*range(STATES), *range(first, first + EXTRA)][:n] for first in (QUANTITIES, COLUMNS))
    columns = [*places, ONE, COMMAND]
    tables = np.zeros((PHASES, QUANTITIES + extra, COLUMNS + extra))
    for along in (-1, 0, 1):
        for limited in (-1, 0, 1):
            table, here = tables[phase_number(along, limited)], equations(device, along, limited)
            table[np.ix_(rows, columns)] = here.rates
            table[SEEN, columns] = here.seen
            table[GRIP, columns] = np.eye(n + 2)[1] if along else here.on_handle
            table[VOLTAGE, columns] = 0.0 if here.voltage is None else here.voltage
    return Train(
        tables=tables,
        series=np.zeros((FIRST + order + 1, QUANTITIES + extra)),
        coulomb_n=-1.0 if device.coulomb_n is None else device.coulomb_n,
        voltage_limit_n=math.inf if free.voltage is None else device.motor.stall_n,
        command_limit_n=device.command_limit_n,
        pulse=device.pulse,
        leg_s=leg_s,
    )
