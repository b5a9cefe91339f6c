"""The chatter of a velocity estimate at rest, as the force sees it, and the walls in which a handle can rest with it.

At a constant count some estimators do not come to rest: they go through a cycle of a few samples, one of several. The
force is updated every so many samples, and takes one of its values each time. That is the cycle's alias, which may
be a single value, a velocity that is not there.

A handle with Coulomb friction f_c, pushed by P into a wall (K, B), rests at x if for every value u that the force takes

    |P - K x - B u| <= f_c,    and x > 0.

There is such an x if and only if

    B (max u - min u) <= 2 f_c     friction holds against the swing
    B max u < P + f_c              and the mean does not hold the handle out of the wall.

K is not in it. That a handle cannot rest does not make a wall unstable: it may be shaken by less than the threshold.
"""

from dataclasses import dataclass

import numpy as np

from ...model.axis import Axis
from ..scene.schema import Scene

LANES = 200
"""Motions from which the estimator comes to rest: enough to meet every cycle."""
SPEEDS_M_PER_S = (3e-4, 0.1)
FADING_S = (1e-3, 0.02)
"""Those motions begin at a speed and fade with a time constant."""
SETTLING_S, SEEN_S = 0.3, 0.3
SEED = 1


@dataclass(frozen=True)
class Chatter:
    """What the force takes for the velocity of a handle at rest: the ends of every cycle that was met.

    Attributes:
        least_m_per_s, most_m_per_s: shape (cycles,), one for each motion that came before.
    """

    least_m_per_s: np.ndarray
    most_m_per_s: np.ndarray

    @property
    def swing_m_per_s(self) -> np.ndarray:
        """From the least to the most of every cycle."""
        return self.most_m_per_s - self.least_m_per_s

    @property
    def mean_m_per_s(self) -> np.ndarray:
        """The middle of every cycle."""
        return (self.most_m_per_s + self.least_m_per_s) / 2

    def rests_up_to(self, coulomb_n: float, push_n: float) -> np.ndarray:
        """Return for every cycle the largest B (N s/m) of a wall in which the handle can rest; infinite without end.

        Args:
            coulomb_n: friction.
            push_n: that the handle is held to the wall with.
        """
        with np.errstate(divide="ignore", over="ignore"):
            swing = 2 * coulomb_n / self.swing_m_per_s
            out = np.where(self.most_m_per_s > 0, (push_n + coulomb_n) / self.most_m_per_s, np.inf)
        return np.minimum(swing, out)


def motions(scene: Scene) -> np.ndarray:
    """Return the counts of motions that came to rest, shape (motions, samples), after `SETTLING_S` constant.

    An estimator that never saw a count change has nothing to chatter about, so there are none that did not move.
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
        scene: its estimator, gains, output and rates.
        backend: `float` or `fixed`.

    Raises:
        ValueError: if the estimator needs the stamps of edges.
    """
    spec = scene.spec
    velocity = Axis(spec, backend == "float", **scene.parameters).run(motions(scene)).velocity_m_per_s
    # The force follows the first sample, and then one of every so many.
    seen = velocity[:, :: spec.samples_per_actuation]
    seen = seen[:, round(SETTLING_S * spec.actuation_hz) :]
    return Chatter(seen.min(axis=1), seen.max(axis=1))
