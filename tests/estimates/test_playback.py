"""A known motion through an axis: the count at every strobe is the position at its time, on every backend."""

import numpy as np
import pytest

from hardwall.model.estimators.acceleration import Motions, Velocities
from hardwall.sim.estimates import signals
from hardwall.sim.estimates.accuracy import axis_spec
from hardwall.sim.estimates.motions import position
from hardwall.sim.estimates.playback import outputs, velocities
from hardwall.sim.world.encoder import Encoder, locate, offsets
from stimuli.lengths import LONG

NONE = (0.0, 0.0, 0.0, 0.0)


def record(signal, spec, output, backend, errors=NONE) -> np.ndarray:
    return np.concatenate([part for _, part, _ in velocities(signal, spec, output, backend, errors)])


@pytest.mark.parametrize("errors", [NONE, offsets(0.25, 0.1)])
@pytest.mark.parametrize("name", ["sweep", "hit"])
def test_every_strobe_sees_the_place_at_its_time(name, errors):
    signal, spec = signals.load(name), axis_spec("fdm", 2000, 12.0)
    scale = Encoder(spec.count_m, float(spec.clock_hz), errors)
    cells = np.array(
        [locate(scale, position(signal.motion, k / 2000)).number for k in range(int(signal.seconds * 2000))]
    )
    found = np.cumsum(record(signal, spec, "u", "float", errors)) / (spec.count_m * 2000)
    assert np.round(found).tolist() == (cells - cells[0]).tolist()


@pytest.mark.parametrize(("estimator", "output"), [("levant", "u1"), *([("fdm", "u")] if LONG else [])])
def test_rtl_gives_the_velocities_of_fixed(estimator, output):
    signal, spec = signals.load("hit"), axis_spec(estimator, 100_000, 28.5)
    fixed, rtl = (record(signal, spec, output, backend, offsets(0.25)) for backend in ("fixed", "rtl"))
    assert len(fixed) == int(signal.seconds * 100_000)
    assert np.flatnonzero(fixed != rtl).tolist() == []
    assert np.ptp(fixed) > 0.2


def test_chunks_are_one_record(monkeypatch):
    signal, spec = signals.load("stop"), axis_spec("levant", 10_000, 12.0)
    whole = record(signal, spec, "u", "fixed")
    monkeypatch.setattr("hardwall.sim.estimates.playback.CHUNK", 999)
    parts = list(velocities(signal, spec, "u", "fixed", NONE))
    assert [first for first, _, _ in parts] == list(range(0, len(whole), 999))
    assert (np.concatenate([part for _, part, _ in parts]) == whole).all()


def test_the_acceleration_comes_where_the_estimator_and_the_backend_have_one():
    signal = signals.load("stop")
    kinds = {("kalman", "fixed"): Motions, ("kalman", "float"): Motions, ("levant", "fixed"): Velocities}
    for (estimator, backend), kind in kinds.items():
        spec = axis_spec(estimator, 10_000, 12.0)
        made = [part for _, part, _ in outputs(signal, spec, "u", backend, NONE)]
        assert {type(part) for part in made} == {kind}
        velocity = np.concatenate([part.velocity for part in made])
        assert (velocity == record(signal, spec, "u", backend)).all()
        if kind is Motions:
            # The axis brakes from 5 mm/s to a standstill.
            acceleration = np.concatenate([part.acceleration for part in made])
            assert np.sum(acceleration[4_900:5_300]) / 10_000 == pytest.approx(-5e-3, rel=0.05)
