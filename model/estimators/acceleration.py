"""The acceleration: a second output of the estimators whose state has one.

`Accelerated` is what their designs have beside the contract in `estimate`, and `acceleration_of` reads the state. An
acceleration belongs to the moment of its sample, as the velocity of the sample does.
"""

from typing import NamedTuple

import numpy as np

from ..arithmetic.fixed import SQ
from ..runtime.compiled import by_type, compiled
from .estimate import EstimatorDesign

WIDTH = 32
"""The most bits of an acceleration, so that a register of a host holds it."""


class Accelerated(EstimatorDesign):
    """The design of an estimator that has an acceleration as its second output.

    Attributes:
        acceleration: format of the acceleration, counts a sample^2.
    """

    acceleration: SQ


@by_type
def acceleration_of(params, state):
    """Return the acceleration that belongs to the velocity of the last sample.

    Args:
        params: what an `Accelerated` design's `params` or `float_params` returns.
        state: what `estimate` has returned; or what `start` has, with an acceleration of 0.

    Returns:
        A word of the design's `acceleration` format; with float parameters, counts a sample^2.
    """


class Velocities(NamedTuple):
    """Room for the velocities of a record."""

    velocity: np.ndarray


class Motions(NamedTuple):
    """Room for the velocities and the accelerations of a record."""

    velocity: np.ndarray
    acceleration: np.ndarray


def room_of(estimator: EstimatorDesign, shape: tuple[int, ...], number: type) -> Velocities | Motions:
    """Return room for all that an estimator gives, of one shape: words (np.int64), or float64."""
    kind = Motions if isinstance(estimator, Accelerated) else Velocities
    return kind(*(np.zeros(shape, number) for _ in kind._fields))


def part(made: Velocities | Motions, which: int | slice) -> Velocities | Motions:
    """Return the room of some samples, or of a lane."""
    return type(made)(*(each[which] for each in made))


@by_type
def keep(made, k, velocity, params, state):
    """Write the outputs of sample k into `made`.

    Args:
        made: `Velocities` or `Motions`.
        k: number of the sample.
        velocity: what `estimate` has returned for it.
        params, state: as of `acceleration_of`.
    """


@keep.register(Velocities)
@compiled
def _keep_velocity(made, k, velocity, params, state):
    made.velocity[k] = velocity


@keep.register(Motions)
@compiled
def _keep_motion(made, k, velocity, params, state):
    made.velocity[k] = velocity
    made.acceleration[k] = acceleration_of(params, state)
