"""How likely a wall is stable: a curve that falls in K at every B, by maximum likelihood, and how sure it is.

Hits of a wall from several starts are draws of one chance. Chances that fall in K and make the verdicts at one B most
likely are an isotonic regression (SciPy): of the shares of stable hits, weighted by their numbers. The boundary is
where that curve, straight between walls that were hit and 1 without a wall, passes one half.

An interval is of the starts, the percentiles of bootstraps: as many starts are drawn from the starts, with repetition,
and take all their verdicts with them, at every wall and with every method. So what two methods differ by is compared
draw by draw. Undecided hits are left out of the curve; the lower end of an interval takes them all for unstable, the
upper one for stable. Where all starts agree, an interval has no width: the steps of the map come on top.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
import scipy

from .boundary import STABLE, UNDECIDED, share

DRAWS = 200
"""The number of bootstraps."""
SEED = 1
ENDS = 2.5, 97.5
"""The percentiles that are the ends of an interval."""
HALF = 0.5


@dataclass(frozen=True)
class Wall:
    """A wall that was hit.

    Attributes:
        damping_n_s_per_m, stiffness_n_per_m: B and K.
        hits: what `mapping.verdict` returned, by the number of the start.
    """

    damping_n_s_per_m: float
    stiffness_n_per_m: float
    hits: dict[int, dict]

    def number_of(self, verdict: str) -> int:
        """Return the number of hits of a verdict."""
        return sum(hit["verdict"] == verdict for hit in self.hits.values())

    @property
    def share(self) -> float:
        """The share of the hits that are stable."""
        return share(hit["verdict"] for hit in self.hits.values())


def draws(starts: int) -> np.ndarray:
    """Return how often each start is in each of the bootstraps, shape (starts, DRAWS)."""
    return np.random.default_rng([SEED, starts]).multinomial(starts, np.full(starts, 1 / starts), DRAWS).T.astype(float)


class Column:
    """The walls of one B that were hit.

    Args:
        walls: these walls, by rising K.
        starts: number of starts.
    """

    def __init__(self, walls: list[Wall], starts: int):
        self._stiffness = np.array([wall.stiffness_n_per_m for wall in walls])
        shape = len(walls), starts
        self._stable, self._open, self._hit = np.zeros(shape), np.zeros(shape), np.zeros(shape)
        for row, wall in enumerate(walls):
            for start, hit in wall.hits.items():
                self._hit[row, start] = 1
                self._stable[row, start] = hit["verdict"] == STABLE
                self._open[row, start] = hit["verdict"] == UNDECIDED

    def boundary(self) -> float:
        """Return the K (N/m) at which a hit is as likely stable as not."""
        return self._half(self._stable.sum(axis=1), (self._hit - self._open).sum(axis=1))

    def bounds(self, drawn: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return that K for every bootstrap, with undecided hits taken for unstable, and for stable."""
        tries = (self._hit @ drawn).T
        low = self._all_halves((self._stable @ drawn).T, tries)
        if not self._open.any():
            return low, low
        return low, self._all_halves(((self._stable + self._open) @ drawn).T, tries)

    def _all_halves(self, stable: np.ndarray, tries: np.ndarray) -> np.ndarray:
        pairs, places = np.unique(np.hstack([stable, tries]), axis=0, return_inverse=True)
        halves = [self._half(*np.split(pair, 2)) for pair in pairs]
        return np.array(halves)[places.ravel()]

    def _half(self, stable: np.ndarray, tries: np.ndarray) -> float:
        """Return the K at which the curve passes one half: 0 if this is below the first wall hit."""
        some = tries > 0
        if not some.any():
            return 0.0
        stiffness, tries = self._stiffness[some], tries[some]
        curve = scipy.optimize.isotonic_regression(stable[some] / tries, weights=tries, increasing=False).x
        over = int((curve >= HALF).sum())
        if over in (0, len(curve)):
            return float(stiffness[-1]) if over else 0.0
        left, right = stiffness[over - 1 : over + 1]
        above, below = curve[over - 1 : over + 1]
        return float(left + (right - left) * (above - HALF) / (above - below))


def held(walls: list[Wall], boundary_n_per_m: float) -> float | None:
    """Return the share of stable hits below a boundary, over K, of the walls of one B; None if none was hit there."""
    below = [wall for wall in walls if wall.stiffness_n_per_m <= boundary_n_per_m]
    if not below:
        return None
    at = np.array([0.0, *(wall.stiffness_n_per_m for wall in below), boundary_n_per_m])
    shares = np.array([below[0].share, *(wall.share for wall in below), below[-1].share])
    return float(np.trapezoid(shares, at) / boundary_n_per_m)


def islands(walls: Iterable[Wall], boundary_of: Callable[[float], float]) -> list[Wall]:
    """Return the walls on the wrong side of the boundary: stable above, or unstable below."""
    return [
        wall
        for wall in walls
        if (wall.share > HALF) != (wall.stiffness_n_per_m <= boundary_of(wall.damping_n_s_per_m)) and wall.share != HALF
    ]
