"""Which rounding decides a wall at the edge of Levant's region: that of the velocity, and that of the root."""

import pytest

from hardwall.model.estimators import levant
from hardwall.sim.scene.case import Case
from hardwall.sim.scene.case import _scene as accept_scene
from hardwall.sim.walls import hit
from hardwall.sim.walls.starts import start
from stimuli.lengths import long_form

STARTS = 40


def stable(backend: str, stiffness_n_per_m: float) -> int:
    """Return from how many starts a wall of 24 N s/m is stable, with the paper's adjusted gains."""
    # A design is derived once for every scene.
    accept_scene.cache_clear()
    case = Case.of("seed-2011", {"controller.estimator": "levant"})
    verdicts = [
        hit.run(case.hitting(stiffness_n_per_m, 24.0, start(number)), backend, until_sure=True).judged
        for number in range(STARTS)
    ]
    return verdicts.count("stable")


@long_form
@pytest.mark.parametrize("backend", ["fixed", "float"])
def test_off_the_edge_the_backends_agree(backend):
    assert (stable(backend, 25e3), stable(backend, 35e3)) == (STARTS, 0)


@long_form
def test_four_bits_more_of_the_velocity_or_of_the_root_give_the_chance_of_float64(monkeypatch):
    as_built, in_float = stable("fixed", 30e3), stable("float", 30e3)
    assert as_built > 0.9 * STARTS
    assert 0.4 * STARTS < in_float < 0.75 * STARTS
    with monkeypatch.context() as finer:
        fraction = levant.Design._fraction
        finer.setattr(levant.Design, "_fraction", lambda self, *rates: fraction(self, *rates) + 4)
        of_velocity = stable("fixed", 30e3)
    with monkeypatch.context() as finer:
        finer.setattr(levant, "POSITION_BUDGET", levant.POSITION_BUDGET / 16)
        of_root = stable("fixed", 30e3)
    assert abs(of_velocity - in_float) <= 0.1 * STARTS
    assert abs(of_root - in_float) <= 0.1 * STARTS
