"""What an estimator gives at every sample, in arrays: velocities, and accelerations where it has them."""

from ...model.estimators.acceleration import Motions, Velocities
from ...model.runtime.compiled import by_type, compiled
from ..loop.controllers import acceleration


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
    made.acceleration[k] = acceleration(controller, state)
