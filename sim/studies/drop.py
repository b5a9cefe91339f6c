"""Why the stable region of Levant's differentiator ends at one B, in a sharp drop, and which estimators have no drop.

The explanation under test is `chatter`: at rest the output u still chatters, and B times the chatter is a force that
friction either holds or does not, whatever the stiffness. There are four experiments:

- *Shaken.* One wall with increasing B: the RMS of position after the settling mark. It is taken for Levant's u, for
  other estimators, and for Levant's differentiator with an implicit Euler step, which does not chatter at rest; the
  gains are the same.
- *Ends.* Two values of B, from soft walls to stiff walls: up to the first, three of four hits come to rest; up to the
  second, they are stable. (A handle that is shaken by less than the threshold is stable, too.)
- *Laws.* Two values of B are compared: up to the first, three of four hits come to rest, measured in the closed loop.
  Up to the second, `chatter` lets three of four cycles rest, predicted from the estimator alone. Friction, push, gains
  and the number of samples a force are changed, because they are in the law. Mass, count, delay and stiffness are
  changed, too, though they are not in it.
- *Maps.* The stable region of every method, as the founding paper traces it.
"""

import math
from collections import Counter
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np

from ..jobs.parallel import Run
from ..scene.case import Case, accepted
from ..scene.errors import SceneError
from ..scene.schema import Scene
from ..walls import hit
from ..walls.chatter import at_rest, force_every
from ..walls.grid import wider_grid
from ..walls.mapping import Mapper
from ..walls.methods import PROPOSED, Curve, methods
from ..walls.starts import start as start_of
from .drop_result import STIFFNESS_N_PER_M, Drop, End, Law, Shaken

DAMPINGS_N_S_PER_M = np.geomspace(3, 400, 18).round(1)
STARTS = 8
"""The number of hits of a wall, each from another start, as the cycle of the chatter is chance."""
REST_COUNTS = 0.1
"""A handle whose RMS of position is less has come to rest."""
ENOUGH = 0.75
"""The share of the hits, and of the cycles, that must come to rest."""
HALVINGS = 5
"""The number of bisections of the range of B in the search for its end."""
COARSER = 4.0
"""The steps of the maps, as a multiple of the scene's steps."""
TIMES = {
    "Coulomb friction": ("handle.coulomb_n", (0.3, 0.5, 2.0, 3.0)),
    "push": ("protocol.push_n", (0.7, 1.5, 2.0)),
    "mass": ("handle.mass_kg", (0.5, 2.0)),
    "count": ("encoder.count_m", (0.5, 2.0)),
    "delay": ("amplifier.delay_s", (0.0, 2.0)),
    "stiffness": ("wall.stiffness_n_per_m", (0.5, 2.0, 3.0)),
}
"""The changes of the scene: a key and the factors that multiply its value."""
GAINS = {"lambda": ("lambda_sqrt_m_per_s", (0.7, 1.5)), "alpha": ("alpha_m_per_s2", (0.4, 2.0, 4.0))}
SAMPLES_A_FORCE = (8, 9, 11, 20)
PAPERS = ("proposed", "adjusted")
"""The methods whose ends and laws are studied, by the names of `curves`."""
STIFFNESSES_N_PER_M = (2.5e3, 5e3, 10e3, 20e3, 30e3)
ENDS_N_S_PER_M = np.geomspace(20, 240, 14).round(1)
"""The dampings of the walls in the experiment on ends."""


def curves(scene: Scene) -> dict[str, Curve]:
    """Return the methods that are compared: the paper's, the same gains without chatter, and other estimators."""
    papers = methods(scene)
    adjusted = papers["adjusted"].gains
    return {
        "proposed": papers["proposed"],
        "adjusted": papers["adjusted"],
        "adjusted u1": Curve("Levant u1, adjusted gains", "levant", "u1", adjusted),
        "implicit proposed": Curve("implicit Levant u, proposed gains", "levant-implicit", "u", PROPOSED),
        "implicit adjusted": Curve("implicit Levant u, adjusted gains", "levant-implicit", "u", adjusted),
        "semi-implicit adjusted": Curve("semi-implicit u, adjusted gains", "levant-semi-implicit", "u", adjusted),
        "kalman": Curve("Kalman", "kalman", "u"),
        "window": Curve("minimax window", "window", "u"),
        "fdm-500": papers["fdm-500"],
    }


def strike(scene: str, text: str, changes: dict[str, Any], damping: float, start: int, backend: str) -> dict:
    """Hit a scene's wall; return whether the handle `rests` and is `stable`, and its `rms_m`, None if it fled.

    Args:
        scene, text, changes: fields of a `Case`.
        damping: damping of the wall, N s/m.
        start: number of the start, from 0 to `STARTS` - 1.
        backend: `float` or `fixed`.
    """
    case = Case("", scene, text, changes)
    plain = case.scene
    result = hit.run(case.hitting(damping_n_s_per_m=damping, start=start_of(start)), backend, until_sure=True)
    if math.isinf(result.rms_m):
        return {"rests": False, "stable": False, "rms_m": None}
    rests = result.rms_m < REST_COUNTS * plain.encoder.count_m and result.mean_m > 0
    return {"rests": rests, "stable": result.stable, "rms_m": result.rms_m}


def study(case: Case, backend: str, run: Run, mapper: Mapper) -> Drop:
    """Return the four experiments on a scene.

    Args:
        case: the scene.
        backend: `float` or `fixed`.
        run: what does the single hits.
        mapper: function that makes maps, on the same backend.

    Raises:
        SceneError: if the scene is not valid, or has no section `zwidth`, no Coulomb friction, or a coupling.
    """
    case.without_coupling("the law of rest is of the damper that the axis renders, and here that is the coupling's")
    soft = case.changed({"wall.stiffness_n_per_m": STIFFNESS_N_PER_M})
    plain = soft.scene
    if not plain.handle.coulomb_n:
        raise SceneError(f"{plain.name}: handle.coulomb_n must be more than 0: no friction holds against a chatter")
    compared = curves(plain)
    most = max(float(DAMPINGS_N_S_PER_M[-1]), plain.controller.damping_max_n_s_per_m)
    damped = soft.changed({"controller.damping_max_n_s_per_m": most})
    cases = {name: damped.changed(curve.changes, curve.label) for name, curve in compared.items()}
    changed = {("none", "", name): case for name, case in cases.items()}
    for name in PAPERS:
        for (factor, value), change in _changes(plain, compared[name]).items():
            changed[factor, value, name] = cases[name].changed(change)
    changed = accepted(changed)
    wider = case.changed(wider_grid(plain, COARSER))
    maps = mapper("maps", [wider.changed(curve.changes, curve.label) for curve in compared.values()])
    return Drop(
        plain,
        {name: at_rest(own.scene, backend) for name, own in cases.items()},
        _shaken(cases, backend, run),
        _ends(cases, backend, run),
        _laws(changed, backend, run),
        dict(zip(compared, maps, strict=True)),
        mapper.effort(),
    )


def _changes(scene: Scene, curve: Curve) -> dict[tuple[str, str], dict[str, Any]]:
    """Return the changes of a scene, by factor and value."""
    changes = {}
    for factor, (key, values) in TIMES.items():
        section, name = key.split(".")
        own = getattr(getattr(scene, section), name, None)
        if own is not None:
            changes |= {(factor, f"x {times:g}"): {key: own * times} for times in values}
    for factor, (gain, values) in GAINS.items():
        for times in values:
            gains = {**curve.gains, gain: curve.gains[gain] * times}
            changes[factor, f"x {times:g}"] = replace(curve, gains=gains).changes
    for samples in SAMPLES_A_FORCE:
        changes["samples a force", f"{samples}"] = force_every(scene, samples)
    return changes


def _job(case: Case, damping: float, start: int, backend: str) -> dict:
    return case.job() | {"damping": damping, "start": start, "backend": backend}


def _shaken(cases: dict[str, Case], backend: str, run: Run) -> list[Shaken]:
    walls = list(product(cases, DAMPINGS_N_S_PER_M.tolist(), range(2)))
    jobs = [_job(cases[name], damping, start, backend) for name, damping, start in walls]
    results = run("shaken", strike, jobs)
    return [Shaken(name, damping, result["rms_m"]) for (name, damping, _), result in zip(walls, results, strict=True)]


def _ends(cases: dict[str, Case], backend: str, run: Run) -> list[End]:
    """Return the ends; every damping is tried, because a stiff wall has a least damping too."""
    walls = {}
    for name, stiffness in product(PAPERS, STIFFNESSES_N_PER_M):
        walls[name, stiffness] = cases[name].changed({"wall.stiffness_n_per_m": stiffness})
    hits = list(product(walls, ENDS_N_S_PER_M.tolist(), range(STARTS)))
    results = run("ends", strike, [_job(walls[key], damping, start, backend) for key, damping, start in hits])
    counts = {"rests": Counter(), "stable": Counter()}
    for (key, damping, _), result in zip(hits, results, strict=True):
        for what, count in counts.items():
            count[key, damping] += result[what]

    def last(what: str, key: tuple) -> float:
        enough = [damping for damping in ENDS_N_S_PER_M.tolist() if counts[what][key, damping] >= ENOUGH * STARTS]
        return max(enough, default=0.0)

    return [End(*key, last("rests", key), last("stable", key)) for key in walls]


def _laws(changed: dict[tuple[str, str, str], Case], backend: str, run: Run) -> list[Law]:
    """Return prediction and measurement for every change; the bisections of all changes go side by side."""
    least, most = DAMPINGS_N_S_PER_M[[0, -1]].tolist()
    low, high = dict.fromkeys(changed, least), dict.fromkeys(changed, most)
    for step in range(HALVINGS):
        middle = {key: float(f"{math.sqrt(low[key] * high[key]):.4g}") for key in changed}
        hits = list(product(changed, range(STARTS)))
        jobs = [_job(changed[key], middle[key], start, backend) for key, start in hits]
        resting = dict.fromkeys(changed, 0)
        for (key, _), result in zip(hits, run(f"laws, {step + 1} of {HALVINGS}", strike, jobs), strict=True):
            resting[key] += result["rests"]
        for key, count in resting.items():
            side = low if count >= ENOUGH * STARTS else high
            side[key] = middle[key]
    laws = []
    for key, case in changed.items():
        measured = math.sqrt(low[key] * high[key])
        if low[key] == least or high[key] == most:
            measured = 0.0 if low[key] == least else math.inf
        laws.append(Law(*key, _predicted(case.scene, backend), measured))
    return laws


def _predicted(scene: Scene, backend: str) -> float:
    """Return the B up to which a share `ENOUGH` of the cycles lets the handle rest."""
    ends = np.sort(at_rest(scene, backend).rests_up_to(scene.handle.coulomb_n, scene.protocol.push_n))
    return float(ends[math.floor((1 - ENOUGH) * len(ends))])
