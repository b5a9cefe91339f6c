"""What an estimator gives at every sample, in arrays: velocities, and accelerations where it has them.

An axis in hardware has no port for the acceleration: on the backend `rtl` there are velocities alone.
"""

import numpy as np

from ...model.estimators.acceleration import Accelerated, Motions, Velocities, acceleration_of
from ...model.runtime.compiled import by_type, compiled
from ...model.spec import AxisSpec
from ..loop.backends import number_of


def room_for(spec: AxisSpec, backend: str, samples: int) -> Velocities | Motions:
    """Return room for all outputs that the estimator of an axis has on a backend."""
    both = backend != "rtl" and isinstance(spec.design.estimator, Accelerated)
    kind = Motions if both else Velocities
    return kind(*(np.zeros(samples, number_of(backend)) for _ in kind._fields))


def part(made: Velocities | Motions, first: int, last: int) -> Velocities | Motions:
    """Return the room of some samples."""
    return type(made)(*(each[first:last] for each in made))


def scaled(made: Velocities | Motions, units: tuple[float, ...]) -> Velocities | Motions:
    """Return words in their units: see `hardwall.model.velocity_estimator.units_of`."""
    return type(made)(*(words * unit for words, unit in zip(made, units, strict=False)))


@by_type
def write(made, k, controller, state):
    """Write the outputs of sample k.

    Args:
        made: `Velocities` or `Motions`.
        k: number of the sample.
        controller, state: the controller and its state after the sample (`sim.loop.controllers`).
    """


@write.register(Velocities)
@compiled
def _write_velocity(made, k, controller, state):
    made.velocity[k] = state.velocity


@write.register(Motions)
@compiled
def _write_motion(made, k, controller, state):
    made.velocity[k] = state.velocity
    made.acceleration[k] = acceleration_of(controller.axis.estimator, state.axis.estimator)
