"""The chatter of a velocity estimate at rest, as the force sees it, and the walls in which a handle can rest with it.

At a constant count some estimators do not come to rest: they go through one of several cycles of a few samples. The
force is updated only once in several samples, and takes one value of the cycle each time. These values are the cycle's
alias, which may be a single value: a constant velocity where there is none.

A handle with Coulomb friction f_c is pushed by P into a wall (K, B). It rests at x if, for every value u that the force
takes,

    |P - K x - B u| <= f_c,    and x > 0.

There is such an x if and only if

    B (max u - min u) <= 2 f_c     friction holds against the swing
    B max u < P + f_c              and the mean does not hold the handle out of the wall.

The condition does not depend on K. A wall in which a handle cannot rest may still be stable, as the handle may be
shaken by less than the threshold.
"""

from dataclasses import dataclass

import numpy as np

from ..loop.backends import whole
from ..scene.schema import Scene

LANES = 200
"""Number of motions that come to rest, enough to meet every cycle."""
SPEEDS_M_PER_S = (3e-4, 0.1)
FADING_S = (1e-3, 0.02)
"""The ranges of the motions' first speeds, and of the time constants with which the speeds fade."""
SETTLING_S, SEEN_S = 0.3, 0.3
SEED = 1


@dataclass(frozen=True)
class Chatter:
    """The velocity that the force takes for a handle at rest: the extremes of every cycle found.

    Attributes:
        least_m_per_s, most_m_per_s: shape (cycles,), one value for each preceding motion.
    """

    least_m_per_s: np.ndarray
    most_m_per_s: np.ndarray

    @property
    def swing_m_per_s(self) -> np.ndarray:
        """The difference between the most and the least of every cycle."""
        return self.most_m_per_s - self.least_m_per_s

    @property
    def mean_m_per_s(self) -> np.ndarray:
        """The middle of every cycle."""
        return (self.most_m_per_s + self.least_m_per_s) / 2

    def rests_up_to(self, coulomb_n: float, push_n: float) -> np.ndarray:
        """Return for every cycle the largest B (N s/m) of a wall in which the handle can rest; infinite if any B does.

        Args:
            coulomb_n: Coulomb friction.
            push_n: the force that holds the handle to the wall.
        """
        with np.errstate(divide="ignore", over="ignore"):
            swing = 2 * coulomb_n / self.swing_m_per_s
            out = np.where(self.most_m_per_s > 0, (push_n + coulomb_n) / self.most_m_per_s, np.inf)
        return np.minimum(swing, out)


def force_every(scene: Scene, samples: int) -> dict[str, int]:
    """Return changes of a scene, by dotted key: the force follows every so many samples, at the same rate of forces."""
    rate = samples * scene.controller.actuation_hz
    clock = rate * round(scene.controller.clock_hz / rate)
    return {"controller.sample_hz": rate, "controller.clock_hz": clock}


def motions(scene: Scene) -> np.ndarray:
    """Return the counts of motions that came to rest, shape (motions, samples); they are constant after `SETTLING_S`.

    Motions without a change of count are left out, because an estimator that never saw a change does not chatter.
    """
    spec, dice = scene.spec, np.random.default_rng(SEED)
    speed = np.exp(dice.uniform(*np.log(SPEEDS_M_PER_S), LANES)) * dice.choice((-1, 1), LANES)
    fading = np.exp(dice.uniform(*np.log(FADING_S), LANES))
    begin = dice.uniform(0, spec.count_m, LANES)
    times = np.arange(round((SETTLING_S + SEEN_S) * spec.sample_hz)) / spec.sample_hz
    positions = begin[:, None] + (speed * fading)[:, None] * -np.expm1(-times / fading[:, None])
    counts = np.floor(positions / spec.count_m).astype(np.int64)
    moved = (counts != counts[:, :1]).any(axis=1)
    rested = (counts[:, times >= SETTLING_S] == counts[:, -1:]).all(axis=1)
    return counts[moved & rested]


def at_rest(scene: Scene, backend: str) -> Chatter:
    """Return the chatter of a scene's estimator.

    Args:
        scene: the scene; its estimator, gains, output and rates are used.
        backend: `float` or `fixed`.

    Raises:
        ValueError: if the estimator needs the stamps of edges.
    """
    spec = scene.spec
    velocity = whole(spec, backend, scene.parameters).run(motions(scene)).velocity_m_per_s
    # The force follows the first sample of every actuation period.
    seen = velocity[:, :: spec.samples_per_actuation]
    seen = seen[:, round(SETTLING_S * spec.actuation_hz) :]
    return Chatter(seen.min(axis=1), seen.max(axis=1))
