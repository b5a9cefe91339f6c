"""The three controllers that can close the loop: pins and a sample strobe in, drive out.

`float` and `fixed` are the models of decoder and axis (`hardwall.model.stamped`), in float64 or in the hardware's
integers; `rtl` is the
Verilated hardware behind function pointers. All take the same clock-stamped edges, sample at the same clock, and
change the drive the same number of clocks later. Their states share the fields `drive`, `velocity` and `flags`.
"""

from ...model import stamped
from ...model.compiled import by_type, compiled
from ..rtl.c_function import call
from ..rtl.verilated import Rtl, RtlState


@by_type
def sample(controller, state, edge_clocks, edge_levels, n_edges, strobe, until):
    """Take one sample: return (state, taken), `taken` being the number of edges used up.

    Args:
        controller: `stamped.Controller` or `Rtl`.
        state: `stamped.State` or `RtlState`.
        edge_clocks, edge_levels: int64 arrays; from which clock on the pins show which level, a | b << 1.
        n_edges: edges in them: those that the last call did not take, and those since.
        strobe: number of the clock at which the count is sampled.
        until: number of the clock at which the drive has changed; edges from it on are for the next call.
    """


@by_type
def sample_quietly(controller, state, strobe, until):
    """Take one sample with no edges: return the state. Passing no array makes it much the cheaper call."""


@sample_quietly.register(stamped.Controller)
@compiled
def _model_sample_quietly(controller, state, strobe, until):
    return stamped.sample_quietly(controller, state, strobe)


@sample.register(stamped.Controller)
@compiled
def _model_sample(controller, state, edge_clocks, edge_levels, n_edges, strobe, until):
    return stamped.sample(controller, state, edge_clocks, edge_levels, 0, n_edges, strobe)


# What `read` of sim/rtl/library.cpp answers.
READ_DRIVE, READ_VELOCITY, READ_FLAGS = 0, 1, 2


@compiled
def _read(controller):
    return RtlState(
        call(controller.read, controller.context, READ_DRIVE, 0, 0, 0),
        call(controller.read, controller.context, READ_VELOCITY, 0, 0, 0),
        call(controller.read, controller.context, READ_FLAGS, 0, 0, 0),
    )


@sample_quietly.register(Rtl)
@compiled
def _rtl_sample_quietly(controller, state, strobe, until):
    call(controller.advance, controller.context, 0, 0, 0, until)
    return _read(controller)


@sample.register(Rtl)
@compiled
def _rtl_sample(controller, state, edge_clocks, edge_levels, n_edges, strobe, until):
    edges = edge_clocks.ctypes.data, edge_levels.ctypes.data
    taken = call(controller.advance, controller.context, edges[0], edges[1], n_edges, until)
    return _read(controller), taken
