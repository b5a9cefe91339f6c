"""A virtual coupling in the loop: a tool that a host simulates, and an axis that couples the handle to it.

Every `period` samples the host takes a sample's count and velocity, and advances the tool by that time. `latency`
samples later, the tool's position and velocity become the surface of the axis's wall. The wall's spring and damper act
at every sample: they are the coupling. The surface stands still until it is moved again; so that it is not behind on
the average, the host may put it where the tool will be `ahead_s` later. The tool has a mass, and a wall of its own at
position 0:

    mass (v' - v) = T (coupling (handle - x') + damping (handle velocity - v') - push),     x' = x + T v'
    push = K x' + B v'      if without it x' were greater than 0, else 0; with `forbid_pull`, not below 0

The steps are backward Euler's, in float64: of themselves they diverge at no stiffness and no mass, not even without
one. Source: Colgate, Stanley and Brown, Issues in the haptic display of tool use, IROS 1995.
"""

import math
from typing import NamedTuple

from ...model import stamped
from ...model.axis import design, wall
from ...model.runtime.compiled import by_type, compiled, inlined
from ..rtl.c_function import call
from ..rtl.verilated import Rtl, RtlState
from .backends import Opened
from .controllers import READ_COUNT, sample, sample_quietly


class Tool(NamedTuple):
    """The constants of a tool and of its coupling."""

    period: int  # samples
    latency: int  # samples, 1 to `period`
    period_s: float
    ahead_s: float  # by which the surface is put ahead of the tool, at the tool's velocity
    mass_kg: float
    stiffness_n_per_m: float  # of the coupling, as the next
    damping_n_s_per_m: float
    wall_stiffness_n_per_m: float
    wall_damping_n_s_per_m: float
    forbid_pull: bool
    start_m: float  # where the count is 0
    count_m: float
    velocity_m_per_s: float  # of a unit of the controller's velocity
    surface_m_per_s: float  # of a unit of the word `wall_velocity`
    position_max: int  # of the word `wall_position`, as the next
    velocity_max: int


class ToolState(NamedTuple):
    """A tool, and the words of its surface, now and next."""

    phase: int  # samples since the host has taken one
    position_m: float
    velocity_m_per_s: float
    position: int
    velocity: int
    next_position: int
    next_velocity: int


class Coupled(NamedTuple):
    """A controller whose surface is a tool."""

    controller: stamped.Controller | Rtl
    tool: Tool


class CoupledState(NamedTuple):
    """The state of a controller with its outputs, and the state of the tool."""

    drive: float
    velocity: float
    flags: int
    controller: stamped.State | RtlState
    tool: ToolState


def coupled(axis: Opened, tool: Tool) -> Opened:
    """Return an axis after reset with a tool at rest where the count is 0."""
    controller, state, hardware = axis
    at_rest = ToolState(0, tool.start_m, 0.0, 0, 0, 0, 0)
    coupled_state = CoupledState(state.drive, state.velocity, state.flags, state, at_rest)
    return Opened(Coupled(controller, tool), coupled_state, hardware)


@compiled
def _word(value, most):
    return math.floor(min(max(value, -float(most)), float(most)) + 0.5)


@compiled
def advanced(tool, state, count, velocity):
    """Return the state of a tool after a period, under a handle at a count with a velocity."""
    seconds, mass = tool.period_s, tool.mass_kg
    handle_m = tool.start_m + count * tool.count_m
    inertia = mass + seconds * (tool.damping_n_s_per_m + seconds * tool.stiffness_n_per_m)
    impulse = mass * state.velocity_m_per_s + seconds * (
        tool.stiffness_n_per_m * (handle_m - state.position_m)
        + tool.damping_n_s_per_m * velocity * tool.velocity_m_per_s
    )
    speed = impulse / inertia
    if state.position_m + seconds * speed > 0.0:
        stiffness, damping = tool.wall_stiffness_n_per_m, tool.wall_damping_n_s_per_m
        slowed = impulse - seconds * stiffness * state.position_m
        slowed /= inertia + seconds * (damping + seconds * stiffness)
        push_n = stiffness * (state.position_m + seconds * slowed) + damping * slowed
        if push_n > 0.0 or not tool.forbid_pull:
            speed = slowed
    position_m = state.position_m + seconds * speed
    surface_m = position_m + speed * tool.ahead_s
    position = _word((surface_m - tool.start_m) / tool.count_m, tool.position_max)
    surface = _word(speed / tool.surface_m_per_s, tool.velocity_max)
    return ToolState(state.phase, position_m, speed, state.position, state.velocity, position, surface)


@by_type
def moved(controller, tool):
    """Return a controller whose surface is at the words of a `ToolState`, from the next sample on."""


@by_type
def write(controller, tool):
    """Let the surface be at the words of a `ToolState` from the next sample on, where that is not the model's to do."""


@by_type
def counted(controller, state):
    """Return the count of the last sample."""


@moved.register(stamped.Controller)
@inlined
def _moved_model(controller, tool):
    axis = controller.axis
    surface = wall.moved(axis.wall, tool.position, tool.velocity)
    blocks = design.Params(
        axis.estimator,
        surface,
        axis.mass,
        axis.passivity,
        axis.output,
        axis.estimator_bit,
        axis.output_bit,
        axis.passivity_bit,
    )
    return stamped.Controller(controller.decoder, controller.glitch_clocks, controller.invert, blocks)


@write.register(stamped.Controller)
@inlined
def _write_model(controller, tool):
    return 0


@counted.register(stamped.Controller)
@inlined
def _counted_model(controller, state):
    return state.decoder.count


@moved.register(Rtl)
@inlined
def _moved_hardware(controller, tool):
    return controller


@write.register(Rtl)
@compiled
def _write_hardware(controller, tool):
    return call(controller.move, controller.context, tool.position, tool.velocity, 0, 0)


@counted.register(Rtl)
@compiled
def _counted_hardware(controller, state):
    return call(controller.read, controller.context, READ_COUNT, 0, 0, 0)


@inlined
def _after(coupled, state, tool):
    """Return the state after a sample of the controller and the host's part of it."""
    if tool.phase == 0:
        tool = advanced(coupled.tool, tool, counted(coupled.controller, state), state.velocity)
    phase, position, velocity = tool.phase + 1, tool.position, tool.velocity
    due = phase == coupled.tool.latency
    if due:
        position, velocity = tool.next_position, tool.next_velocity
    tool = ToolState(
        phase % coupled.tool.period,
        tool.position_m,
        tool.velocity_m_per_s,
        position,
        velocity,
        tool.next_position,
        tool.next_velocity,
    )
    if due:
        write(coupled.controller, tool)
    return CoupledState(state.drive, state.velocity, state.flags, state, tool)


@sample.register(Coupled)
@compiled
def _sample(coupled, state, edges, n_edges, strobe):
    after, taken = sample(moved(coupled.controller, state.tool), state.controller, edges, n_edges, strobe)
    return _after(coupled, after, state.tool), taken


@sample_quietly.register(Coupled)
@inlined
def _sample_quietly(coupled, state, strobe):
    after = sample_quietly(moved(coupled.controller, state.tool), state.controller, strobe)
    return _after(coupled, after, state.tool)
