"""The world of a scene in the form that the loop takes; parts that the scene lacks are left out."""

import math

from ...model.axis.design import overlap_of
from ...model.encoder import quadrature
from ...model.stamped import Controller, room_for
from ..loop.backends import is_exact
from ..loop.coupled import Tool
from ..loop.values import EDGE_CAPACITY, Plant, Progress, Sweep, World
from ..world import device
from ..world.advance import Interval, Moment, advance
from ..world.bristles import Bent, Bristled
from ..world.converter import AS_IT_IS, Converter, Pulse, converted, width_of
from ..world.encoder import Cell, Encoder, locate
from ..world.euler import Stepped, stepped
from ..world.linear import State, at_rest
from ..world.presliding import bristled, fastest_per_s
from ..world.rigid import Coulomb, Handle, Motion, Rigid, Span, span
from .motor_section import DAMPING
from .schema import Scene

MARGIN_COUNTS = 1e-6
"""The least distance of a counted position from an edge: far more than rounding moves the time of an edge."""
EVERYWHERE = Cell(0, -math.inf, math.inf)
"""A cell without an edge."""


def device_of(scene: Scene) -> device.Device | None:
    """Return the scene's device; None for a rigid handle under the drive's force itself, for `rigid`."""
    amplifier, motor, cable, hand = scene.amplifier, scene.motor, scene.transmission, scene.hand
    pulse = _pulse(scene)
    bandwidth_hz = amplifier and amplifier.bandwidth_hz
    if not (bandwidth_hz or motor or cable or hand or pulse.period or scene.solver):
        return None
    parts = scene.handle.model_dump() | {"bandwidth_hz": bandwidth_hz, "pulse": pulse}
    parts["coulomb_n"] = scene.handle.coulomb_n or None
    if motor:
        parts["motor"] = device.Motor(**motor.model_dump(exclude=DAMPING))
        if motor.damping_resistance_ohm:
            parts["shunt"] = device.Shunt(motor.damping_resistance_ohm, motor.damping_capacitance_f)
        if amplifier and amplifier.current_limit_a:
            parts["force_limit_n"] = amplifier.current_limit_a * parts["motor"].newtons_per_ampere
    if cable:
        parts["transmission"] = device.Transmission(**cable.model_dump(exclude={"encoder_at"}))
        parts["encoder_at_motor"] = cable.encoder_at == "motor"
    if hand:
        parts["hand"] = device.Hand(**hand.parts)
    return device.Device(**parts)


def bristled_of(scene: Scene) -> Bristled:
    """Return the handle of a scene with a section `presliding`."""
    handle, bristles = Handle(scene.handle.mass_kg, scene.handle.viscous_n_s_per_m), scene.presliding
    return bristled(
        handle,
        scene.handle.coulomb_n,
        bristles.stiffness_n_per_m,
        bristles.damping_n_s_per_m or 0.0,
        scene.sticking_n,
        bristles.stribeck_m_per_s or math.inf,
    )


def _pulse(scene: Scene) -> Pulse:
    output = scene.output
    if output is None or output.pwm_carrier_hz is None:
        return AS_IT_IS
    period = scene.spec.clock_hz // output.pwm_carrier_hz
    return Pulse(output.full_scale_n, period, period // output.pwm_steps)


def _converter(scene: Scene) -> Converter | None:
    output = scene.output
    if scene.drive is not None:
        drive = scene.spec.drive
        # The mean force of pulses has steps, too.
        return Converter(drive.step_n, -drive.most, drive.highest)
    if output is None or output.dac_bits is None:
        return None
    codes = 1 << output.dac_bits
    return Converter(2 * output.full_scale_n / codes, -codes // 2, codes // 2 - 1)


def output_step_n(scene: Scene) -> float:
    """Return the change of a command (N) that surely changes the output; 0 without steps in the output."""
    output = scene.output
    if scene.drive is not None:
        return scene.spec.drive.step_n
    if output is None:
        return 0.0
    return 2 * output.full_scale_n / (output.pwm_steps or 1 << output.dac_bits)


def work_of(world: World) -> int:
    """Return about how many steps of the solver a sample takes."""
    plant = world.plant
    if isinstance(plant, Rigid):
        return 1
    if isinstance(plant, Bristled):
        return 2 + int(world.timing.clocks_per_sample / world.encoder.clock_hz * fastest_per_s(plant))
    step_s = plant.step_s if isinstance(plant, Stepped) else plant.leg_s
    pulses = world.timing.clocks_per_sample // plant.pulse.period if plant.pulse.period else 0
    return 1 + int(world.timing.clocks_per_sample / world.encoder.clock_hz / step_s) + 2 * pulses


def world_of(scene: Scene) -> World:
    """Return the loop's constants for a scene."""
    spec, timing = scene.spec, scene.timing
    after = timing.latency - overlap_of(timing) * timing.clocks_per_sample
    after_s = after / spec.clock_hz
    before_s = (timing.clocks_per_sample - after) / spec.clock_hz
    parts = device_of(scene)
    if scene.presliding:
        plant = bristled_of(scene)
        before, after = span(plant.handle, before_s), span(plant.handle, after_s)
    elif parts is None:
        handle = Handle(scene.handle.mass_kg, scene.handle.viscous_n_s_per_m)
        coulomb = Coulomb(scene.handle.coulomb_n) if scene.handle.coulomb_n else None
        plant, before, after = Rigid(handle, coulomb), span(handle, before_s), span(handle, after_s)
    else:
        plant, before, after = device.train(parts, max(before_s, after_s)), before_s, after_s
        if scene.solver:
            plant = stepped(plant, parts, scene.solver.step_s)
    return World(
        plant=plant,
        encoder=Encoder(spec.count_m, float(spec.clock_hz), *scene.encoder.errors),
        converter=_converter(scene),
        push_n=scene.protocol.push_n,
        force_lsb_n=spec.force_resolution_n,
        timing=timing,
        before=before,
        after=after,
    )


def tool_of(scene: Scene, backend: str) -> Tool:
    """Return the tool of a scene with a section `coupling`, for a controller on a backend."""
    spec, coupling, words = scene.spec, scene.coupling, {word.name: word for word in scene.spec.design.words}
    position, surface = words["wall_position"], words["wall_velocity"]
    exact = is_exact(backend)
    estimate = spec.design.estimator.velocity.lsb if exact else 1.0
    # The tool feels the same values as the handle: the words' values, if the axis has words.
    gains = {"wall_stiffness": coupling.stiffness_n_per_m, "wall_damping": coupling.damping_n_s_per_m}
    if exact:
        gains = {name: words[name].to_si(scene.words[name]) for name in gains}
    return Tool(
        period=coupling.period(spec.sample_hz),
        latency=coupling.latency(spec.sample_hz),
        period_s=1 / coupling.sample_hz,
        ahead_s=coupling.ahead_s,
        mass_kg=coupling.mass_kg,
        stiffness_n_per_m=gains["wall_stiffness"],
        damping_n_s_per_m=gains["wall_damping"],
        wall_stiffness_n_per_m=scene.wall.stiffness_n_per_m,
        wall_damping_n_s_per_m=scene.wall.damping_n_s_per_m,
        forbid_pull=scene.wall.forbid_pull,
        start_m=scene.protocol.start_m,
        count_m=spec.count_m,
        velocity_m_per_s=estimate * spec.velocity_unit_m_per_s,
        surface_m_per_s=surface.to_si(1),
        position_max=position.format.max,
        velocity_max=surface.format.max,
    )


def sweep_of(scene: Scene, world: World, controller: object) -> Sweep | None:
    """Return what the loop needs to sweep over samples; None if it cannot: see `sim.loop.sweep`.

    Four conditions hold: only a model can be given a count; only a rigid handle has a motion of one sign; the estimator
    must not use stamps; and the pins must follow the handle's place. The edges before a changed drive must be counted
    at the strobe after the next.
    """
    spec, timing = scene.spec, world.timing
    if not isinstance(controller, Controller) or not isinstance(world.plant, Rigid):
        return None
    if spec.design.estimator.uses_stamps() or scene.encoder.depends_on_the_way:
        return None
    latency = quadrature.latency(controller.glitch_clocks)
    clocks = timing.clocks_per_sample - timing.latency - latency
    closest_m = scene.encoder.closest_counts * spec.count_m
    # If each edge is decoded before the next one is seen, only one edge is under way. Edge by edge, a sample would not
    # have so many that some are lost.
    apart_s = max((latency + 1) / spec.clock_hz, 4 / EDGE_CAPACITY / spec.sample_hz)
    least, most = spec.count_m * spec.sample_hz, closest_m / apart_s
    if clocks < 1 or least >= most:
        return None
    return Sweep(span(world.plant.handle, clocks / spec.clock_hz), least, most, MARGIN_COUNTS * spec.count_m)


def start_of(scene: Scene, world: World) -> Progress:
    """Return the start of a run, under the push alone. If samples overlap, as many more are taken there.

    The handle is at rest at the place of the start. With a phase, it has been pushed from rest for that part of a
    period of the force and is then at this place.
    """
    protocol = scene.protocol
    cell, position_m = locate(world.encoder, protocol.start_m), protocol.start_m
    if protocol.start_counts is not None:
        place_m = cell.lower_m + protocol.start_counts * (cell.upper_m - cell.lower_m)
        position_m = min(place_m, math.nextafter(cell.upper_m, cell.lower_m))
    push_n = converted(world.converter, world.push_n)
    motion = _rest_at(position_m, world.plant, push_n)
    clocks = round(protocol.start_periods * scene.spec.clock_hz / scene.spec.actuation_hz)
    if clocks:
        # Where a start does not matter to the motion, one that lies by the travel farther back ends at the place.
        travel_m = _pushed(world, motion, push_n, clocks).position_m - position_m
        motion = _pushed(world, _rest_at(position_m - travel_m, world.plant, push_n), push_n, clocks)
    taken = (motion,) * max(overlap_of(world.timing), 1)
    return Progress(0, Moment(motion, cell, 0), push_n, taken)


def _rest_at(position_m: float, plant: Plant, push_n: float) -> Motion | Bent | State:
    """Return a plant at rest at a place, its bristles straight."""
    if isinstance(plant, Rigid):
        return Motion(position_m, 0.0)
    if isinstance(plant, Bristled):
        return Bent(position_m, 0.0, 0.0)
    width = width_of(plant.pulse, push_n) if plant.pulse.period else 0
    return at_rest(plant.tables, position_m, width)


def _pushed(world: World, motion: Motion | Bent | State, push_n: float, clocks: int) -> Motion | Bent | State:
    """Return the motion after clocks of the push, which end at clock 0; nobody looks at the encoder meanwhile."""
    seconds = clocks / world.encoder.clock_hz
    length = span(world.plant.handle, seconds) if isinstance(world.before, Span) else seconds
    moment, interval = Moment(motion, EVERYWHERE, 0), Interval(length, -clocks, clocks)
    return advance(world.plant, world.encoder, moment, push_n, interval, room_for(1)).motion
