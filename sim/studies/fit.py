"""A fit of the parameters that the founding paper does not give, so that the facts of its Figure 5 hold.

The search is SciPy's differential evolution, seeded, over the ranges of `PARAMETERS`. It minimises a sum: the
shortfalls of the facts (`figure_5`), `MISSED` for every fact that does not hold, and two distances of the maps from the
paper's axes:

- the region of Levant with adjusted gains should end where the B axis ends. The axis may have lost zeros, so there are
  two readings of it, each with its own search. The distance is the logarithm of the ratio, less what counts as about
  equal;
- the largest K of that region should be on the K axis. The distance is the logarithm of the ratio.

The scene's own values are one of the first trials, so a fit can continue from an earlier fit. Trials are mapped in
coarse steps, on a shortened protocol unless the verdict is the paper's own. If the region of Levant with adjusted gains
ends far (`FAR`) from the end of the B axis, the other maps are not made. No fact holds then. The `FINALISTS` with the
least sum are then judged in full: in fine steps, on the scene's own protocol.
"""

import math
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import scipy

from ...model.runtime.result import Table, table_of
from ..scene.case import Case
from ..scene.errors import SceneError
from ..scene.schema import Scene
from ..walls.figure_5 import ABOUT, NUMBER, Fact, facts
from ..walls.mapping import Effort, Mapper, NeverReached
from ..walls.methods import Curve, methods
from ..walls.zwidth import Map

READINGS = {"3-30": (3.0, 30.0), "30-300": (30.0, 300.0)}
"""The readings of the paper's B axis: its first and its last damping, N s/m."""
STIFFNESS_AXIS_N_PER_M = 60e3
BEYOND = 1.3
"""The factor by which maps extend beyond the paper's axes, so that the end of a region is visible."""
COARSE, FULL = 12, 54
"""The numbers of steps of B in a map."""
STIFFNESS_STEP_N_PER_M = 1e3
SHORT = {"protocol.settle_s": 2.5, "protocol.mean_s": 0.25}
MISSED = 0.05
FAR = math.log(1.5)
HOPELESS = math.log(1e3)
"""The distance from the axes where there are no maps: the scene is not valid, or the handle does not reach walls."""
FINALISTS = 4
MEMBERS = 4
"""The number of members of the population for every parameter."""


@dataclass(frozen=True)
class Range:
    """The range of a parameter, `low` to `high`; `scale` is log, linear, or samples: linear in whole samples."""

    low: float
    high: float
    scale: str

    def at(self, part: float, sample_hz: int) -> float:
        """Return the value at a fraction of the range, 0 to 1, rounded to the three digits that are printed."""
        if self.scale == "log":
            return float(f"{self.low * (self.high / self.low) ** part:.3g}")
        value = self.low + (self.high - self.low) * part
        return round(value * sample_hz) / sample_hz if self.scale == "samples" else float(f"{value:.3g}")

    def part(self, value: float) -> float:
        """Return the fraction of the range at which a value lies, 0 or 1 if it is outside."""
        inside = min(max(value, self.low), self.high)
        if self.scale == "log":
            return math.log(inside / self.low) / math.log(self.high / self.low)
        return (inside - self.low) / (self.high - self.low)


PARAMETERS = {
    "handle.mass_kg": Range(0.02, 2.0, "log"),
    "handle.viscous_n_s_per_m": Range(0.1, 10.0, "log"),
    "handle.coulomb_n": Range(0.005, 0.33, "log"),
    "amplifier.delay_s": Range(0.0, 6e-3, "samples"),
    "protocol.threshold_mm": Range(0.3e-3, 0.1, "log"),
    "controller.gains.levant.alpha_m_per_s2": Range(17.7, 400.0, "log"),
}
"""The ranges that are searched, by key of the scene."""
MEAN = {"protocol.mean_s": Range(0.02, 1.0, "log")}
"""The range of one more, where the verdict is the paper's own: nothing else takes this mean."""


@dataclass(frozen=True)
class Trial:
    """Values of the parameters, and the Figure 5 that they give.

    Attributes:
        values: values of the parameters, by key of the scene.
        facts: the paper's facts; empty where only Levant with adjusted gains was mapped, or no map was possible.
        off_b, off_k: distances of the maps from the ends of the axes, logarithms of ratios.
        maps: maps by the names of `methods`.
    """

    values: dict[str, float]
    facts: list[Fact]
    off_b: float
    off_k: float
    maps: dict[str, Map]

    @property
    def held(self) -> int:
        """The number of facts that hold."""
        return sum(fact.held for fact in self.facts)

    @property
    def score(self) -> float:
        """The sum that the search minimises."""
        lacking = sum(fact.shortfall for fact in self.facts) if self.facts else NUMBER
        return lacking + MISSED * (NUMBER - self.held) + self.off_b + self.off_k

    def report(self) -> dict[str, Any]:
        """Return the trial as the command line prints it."""
        return {
            "values": self.values,
            "score": self.score,
            "held": self.held,
            "off_b_axis": self.off_b,
            "off_k_axis": self.off_k,
            "facts": [asdict(fact) for fact in self.facts],
        }


@dataclass(frozen=True)
class Fit:
    """The result of the search for one reading of the B axis.

    Attributes:
        reading: name of the reading in `READINGS`.
        own: the scene's own values, by key.
        before: the trial of the scene's own values, judged in full.
        trials: trials of the search, in their order.
        finalists: trials judged in full, the best first.
    """

    reading: str
    own: dict[str, float]
    before: Trial
    trials: list[Trial]
    finalists: list[Trial]

    def least_shortfalls(self) -> list[float | None]:
        """Return for every fact its least shortfall in the trials where all the other facts hold; None without any.

        A fact with more than 0 there is in conflict with the others.
        """
        least: list[float | None] = []
        for number in range(NUMBER):
            among = [trial.facts for trial in self.trials if trial.facts]
            lacks = [
                each[number].shortfall
                for each in among
                if all(fact.held for index, fact in enumerate(each) if index != number)
            ]
            least.append(min(lacks, default=None))
        return least

    def report(self) -> dict[str, Any]:
        """Return the fit as the command line prints it."""
        return {
            "b_axis": self.reading,
            "values_before": self.own,
            "before": self.before.report(),
            "evaluations": len(self.trials),
            "evaluations_of_all_methods": sum(bool(trial.facts) for trial in self.trials),
            "least_shortfalls_of_trials": self.least_shortfalls(),
            "finalists": [trial.report() for trial in self.finalists],
        }

    def tables(self) -> list[Table]:
        """Return the values of the best finalist, and its facts."""
        best = self.finalists[0]
        values = [[key, f"{self.own[key]:g}", f"{value:g}"] for key, value in best.values.items()]
        lacks = self.least_shortfalls()
        judged = [
            [before.text, _held(before), _held(after), after.numbers, "" if lack is None else f"{lack:.3f}"]
            for before, after, lack in zip(self.before.facts, best.facts, lacks, strict=True)
        ]
        columns = ("the paper's Figure 5", "before", f"fitted: {best.held} of {len(judged)}", "numbers")
        return [
            table_of((f"B axis {self.reading}",), ("before", "fitted"), values),
            table_of(columns, ("least, others held",), judged),
        ]


def _held(fact: Fact) -> str:
    return "held" if fact.held else f"short by {fact.shortfall:.3f}"


@dataclass(frozen=True)
class Fits:
    """The fits of a scene with one seed: one for every reading of the B axis that was searched."""

    scene: Scene
    fits: list[Fit]
    seed: int
    effort: Effort

    def report(self) -> dict[str, Any]:
        """Return what the command line prints."""
        keys = {"scene": self.scene.name, "seed": self.seed, "fits": [each.report() for each in self.fits]}
        return keys | {"backend": self.effort.backend, "seconds": self.effort.seconds}

    def tables(self) -> list[Table]:
        """Return the tables of every fit."""
        return [table for each in self.fits for table in each.tables()]

    def notes(self) -> list[str]:
        """Return the effort of the searches."""
        return [f"{sum(len(each.trials) for each in self.fits)} evaluations, {self.effort.seconds:.0f} s"]


class _Judge:
    """A judge that maps a scene with given values of the parameters, and compares the maps with Figure 5."""

    def __init__(self, case: Case, reading: str, mapper: Mapper):
        self._case, self._mapper = case, mapper
        self._low, self._end = READINGS[reading]

    def _grid(self, steps: int) -> dict[str, Any]:
        end = BEYOND * self._end
        return {
            "zwidth.damping_from_n_s_per_m": self._low,
            "zwidth.damping_to_n_s_per_m": end,
            "zwidth.damping_step_n_s_per_m": (end - self._low) / steps,
            "zwidth.stiffness_step_n_per_m": STIFFNESS_STEP_N_PER_M,
            "zwidth.stiffness_to_n_per_m": BEYOND * STIFFNESS_AXIS_N_PER_M,
        }

    def coarsely(self, values: dict[str, float]) -> Trial:
        """Return a trial in coarse steps, on a shortened protocol."""
        # The paper's own verdict depends on when it is made.
        short = {} if self._case.scene.protocol.verdict == "literal" else SHORT
        case = self._case.changed(self._grid(COARSE) | short | values)
        try:
            papers = methods(case.scene)
            (adjusted,) = self._maps(papers, case, ["adjusted"]).values()
        except (SceneError, NeverReached):
            return Trial(values, [], HOPELESS, 0.0, {})
        off = self._off(adjusted)
        if off[0] > FAR:
            return Trial(values, [], *off, {"adjusted": adjusted})
        return self._judged(values, papers, case)

    def fully(self, values: dict[str, float]) -> Trial:
        """Return a trial in fine steps, on the scene's own protocol.

        Raises:
            SceneError: if the scene is not valid.
        """
        case = self._case.changed(self._grid(FULL) | values)
        return self._judged(values, methods(case.scene), case)

    def _judged(self, values: dict[str, float], papers: dict[str, Curve], case: Case) -> Trial:
        maps = self._maps(papers, case, list(papers))
        return Trial(values, facts(maps), *self._off(maps["adjusted"]), maps)

    def _maps(self, papers: dict[str, Curve], case: Case, names: list[str]) -> dict[str, Map]:
        cases = [case.changed(papers[name].changes, papers[name].label) for name in names]
        return dict(zip(names, self._mapper("fit", cases), strict=True))

    def _off(self, adjusted: Map) -> tuple[float, float]:
        """Return the distances of the map of Levant with adjusted gains from the ends of the B axis and the K axis."""
        if not adjusted.damping_n_s_per_m:
            return HOPELESS, 0.0
        along = abs(math.log(adjusted.damping_n_s_per_m / self._end)) - math.log1p(ABOUT)
        return max(along, 0.0), max(math.log(adjusted.largest_n_per_m / STIFFNESS_AXIS_N_PER_M), 0.0)


def study(
    case: Case, reading: str, evaluations: int, seed: int, mapper: Mapper, progress: Callable[[int], None]
) -> Fit:
    """Return the fit of a scene for one reading of the B axis.

    Args:
        case: the scene; a key that is searched has the searched value, whatever the case's changes say.
        reading: name of the reading in `READINGS`.
        evaluations: approximate number of evaluations, rounded to whole generations.
        seed: seed of the search.
        mapper: function that makes the maps, and keeps them.
        progress: function called after every evaluation with the number of evaluations done.

    Raises:
        SceneError: if the scene is not valid, or lacks a key that is searched.
        NeverReached: if the handle, with the scene's own values, does not reach the wall.
    """
    judge, plain = _Judge(case, reading, mapper), case.scene
    ranges = searched(plain)
    own = {key: value_of(plain, key) for key in ranges}
    before = judge.fully({})
    trials: list[Trial] = []

    def score(parts: np.ndarray) -> float:
        pairs = zip(ranges.items(), parts, strict=True)
        values = {key: where.at(part, plain.controller.sample_hz) for (key, where), part in pairs}
        trials.append(judge.coarsely(values))
        progress(len(trials))
        return trials[-1].score

    generations = max(round(evaluations / (MEMBERS * len(ranges))) - 1, 0)
    options = {"popsize": MEMBERS, "maxiter": generations, "rng": seed, "tol": 0, "polish": False}
    begin = [ranges[key].part(value) for key, value in own.items()]
    scipy.optimize.differential_evolution(score, [(0.0, 1.0)] * len(ranges), x0=begin, **options)
    best = {tuple(trial.values.items()): trial for trial in sorted(trials, key=lambda trial: -trial.score)}
    finalists = [judge.fully(trial.values) for trial in list(best.values())[::-1][:FINALISTS]]
    return Fit(reading, own, before, trials, sorted(finalists, key=lambda trial: trial.score))


def searched(scene: Scene) -> dict[str, Range]:
    """Return the ranges that are searched for a scene, by key."""
    return PARAMETERS | (MEAN if scene.protocol.verdict == "literal" else {})


def value_of(scene: Scene, key: str) -> Any:
    """Return the value of a dotted key of a scene.

    Raises:
        SceneError: if the scene has no value for the key.
    """
    value: Any = scene
    for name in key.split("."):
        value = getattr(value, name, None)
    if value is None:
        raise SceneError(f"{scene.name}: {key} is missing, which this command changes")
    return value
