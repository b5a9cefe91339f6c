"""The three controllers that can close the loop, from pins and a sample strobe to the drive.

`float` and `fixed` are the models of decoder and axis (`hardwall.model.stamped`), in float64 or in the hardware's
integers; `rtl` is the Verilated hardware behind function pointers; `backends` opens them. All take the same
clock-stamped edges, sample at the same clock, and change the drive the same number of clocks later. Their states share
the fields `drive`, `velocity` and `flags`.
"""

from ...model import stamped
from ...model.estimators.acceleration import acceleration_of
from ...model.runtime.compiled import by_type, compiled
from ..rtl.c_function import call
from ..rtl.verilated import Rtl, RtlState


@by_type
def sample(controller, state, edges, n_edges, strobe):
    """Take one sample; return (state, taken), where `taken` is the number of edges used up.

    Args:
        controller: `stamped.Controller` or `Rtl`.
        state: `stamped.State` or `RtlState`.
        edges: `stamped.Edges` of int64.
        n_edges: number of edges in them: the edges that the last call did not take, and the new ones.
        strobe: number of the clock at which the count is sampled.
    """


@by_type
def sample_quietly(controller, state, strobe):
    """Take one sample with no edges; return the state. The call passes no array, which makes it much cheaper."""


@by_type
def acceleration(controller, state):
    """Return the acceleration that belongs to the velocity of a state, of a controller whose estimator has one."""


@compiled
def taken_off(edges, n_edges, taken):
    """Move the edges after the first `taken` to the front; return their number."""
    remaining = n_edges - taken
    for i in range(remaining):
        edges.clocks[i] = edges.clocks[taken + i]
        edges.levels[i] = edges.levels[taken + i]
    return remaining


sample.register(stamped.Controller)(stamped.sample)
sample_quietly.register(stamped.Controller)(stamped.sample_quietly)


@acceleration.register(stamped.Controller)
@compiled
def _acceleration(controller, state):
    return acceleration_of(controller.axis.estimator, state.axis.estimator)


@acceleration.register(Rtl)
@compiled
def _rtl_acceleration(controller, state):
    return call(controller.read, controller.context, READ_ACCELERATION, 0, 0, 0)


# The values that `read` of sim/rtl/library.cpp returns, by number.
READ_DRIVE, READ_VELOCITY, READ_FLAGS, READ_COUNT, READ_ACCELERATION = 0, 1, 2, 3, 4


@compiled
def _read(controller):
    return RtlState(
        call(controller.read, controller.context, READ_DRIVE, 0, 0, 0),
        call(controller.read, controller.context, READ_VELOCITY, 0, 0, 0),
        call(controller.read, controller.context, READ_FLAGS, 0, 0, 0),
    )


# The hardware runs until its drive has changed; later edges are for the next sample.


@sample_quietly.register(Rtl)
@compiled
def _rtl_sample_quietly(controller, state, strobe):
    call(controller.advance, controller.context, 0, 0, 0, strobe + controller.latency)
    return _read(controller)


@sample.register(Rtl)
@compiled
def _rtl_sample(controller, state, edges, n_edges, strobe):
    clocks, levels, until = edges.clocks.ctypes.data, edges.levels.ctypes.data, strobe + controller.latency
    taken = call(controller.advance, controller.context, clocks, levels, n_edges, until)
    return _read(controller), taken
