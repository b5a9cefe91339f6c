"""The passivity controller: RTL against model, the model against its words, and what observer and controller promise."""

import cocotb
import numpy as np
import pytest

from hardwall.hdl.passivity import Passivity
from hardwall.model import passivity
from hardwall.testing import CAMPAIGN, SAMPLES, Bench, check, parameters, rng, simulate
from stimuli.lengths import some_of
from stimuli.magnitudes import magnitudes
from stimuli.observed import Observed
from stimuli.specs import spec

NAMES = "count", "restart", "velocity", "drive", "passivity_damping", "force"


def design(name: str) -> passivity.Design:
    return passivity.Design(spec(name), spec(name).design.estimator.velocity)


def make(name: str, after: int, behind: int) -> Observed:
    return Observed(design(name), after, behind)


def wrapped(d: passivity.Design, count: int) -> int:
    half = 1 << d.count_width - 1
    return (count + half) % (2 * half) - half


def fastest(d: passivity.Design) -> int:
    """Return the largest change of the count in a sample, so that its change of place fits."""
    return d.place.max // 2 - 1


def stimulus(d: passivity.Design, samples: int):
    """Yield rows of NAMES: an energy at both ends of its word, without any, and debts and credits of all magnitudes."""
    top, most, random = d.force.max, d.damping.max, rng()
    count = 0
    yield 0, 1, 0, 0, 0, 0
    # The fastest way under the largest drive, until the energy is at an end of its word, and back again.
    whole = d.energy.max // (2 * top * fastest(d)) + 3
    for sign in (1, -1, -1):
        for k in range(min(whole, samples // 6)):
            count += fastest(d)
            yield wrapped(d, count), 0, d.velocity.max, sign * top, most, (top, -top, 1, -1)[k % 4]
    yield wrapped(d, count), 0, 0, 0, 0, 0
    # Short ways of one mood: edge by edge or faster, forth and back, while the drive gives, or takes, or both.
    rows = 0
    while rows < samples:
        length = int(random.integers(4, 60))
        rows += length
        one, gives, way = random.random() < 0.6, random.random(), random.choice((-1, 1))
        largest = int(magnitudes(random, 1, top, 1)[0])
        words = zip(
            magnitudes(random, 0, fastest(d), length).tolist(),
            magnitudes(random, 0, d.velocity.max, length, d.velocity.width).tolist(),
            magnitudes(random, 0, largest, length).tolist(),
            magnitudes(random, 0, most, length).tolist(),
            magnitudes(random, -top, top, length).tolist(),
            random.random((length, 4)).tolist(),
            strict=True,
        )
        for step, speed, drive, damping, force, (turn, giving, nothing, extreme) in words:
            way = -way if turn < 0.2 else way
            count += way * (int(turn < 0.7) if one else step)
            drive = drive if (giving < 0.9) == (gives < 0.6) else -drive  # noqa: PLW2901
            restart = int(nothing > 0.99)
            if restart:
                count = int(random.integers(-(1 << d.count_width - 1), 1 << d.count_width - 1))
            velocity = d.velocity.min if extreme > 0.99 else way * speed
            force = 0 if nothing < 0.02 else force or 1  # noqa: PLW2901
            force = (top, -top, 1, -1)[int(extreme * 100) % 4] if extreme < 0.1 else force  # noqa: PLW2901
            yield wrapped(d, count), restart, velocity, way * drive, damping, force


def model(d: passivity.Design, rows, state: passivity.State = passivity.START) -> tuple[list[tuple], passivity.State]:
    """Return (what is given, whether the controller acts, energy at the sample) for rows, and the state behind them."""
    out = []
    for count, restart, velocity, drive, damping, force in rows:
        params = d.params({"passivity_damping": damping})
        state, given, active = passivity.step(params, state, count, restart, velocity, force, drive)
        out.append((given, active))
    return out, state


@cocotb.test(**CAMPAIGN)
async def follows_model(dut):
    component = make(**parameters())
    d, bench, state = component.design, Bench(dut, component), passivity.START
    await bench.reset()
    # The next sample's lead comes with this one's strobe, and its strobe with this one's force; or later by any number.
    soonest = max(component.after, component.behind)
    gaps = range(soonest, component.latency + 2, 3)
    for every in gaps:
        rows = stimulus(d, SAMPLES // len(gaps))
        inputs, outputs = await bench.campaign(
            "strobe", "valid", NAMES, ("given", "active"), rows, every=every, momentary=NAMES
        )
        expected, state = model(d, inputs.rows, state)
        given, active = np.array(expected).T
        assert 0.05 < active.mean() < 0.95
        assert {-d.force.max, 0, d.force.max} <= set(given[active == 1].tolist())
        check(inputs, outputs, {"given": given, "active": active}, component.latency)


SIZES = [("paper", 2, 3), ("mhz", 3, 5), ("narrow", 8, 3), ("wide", 5, 4)]


@pytest.mark.parametrize(("name", "after", "behind"), some_of(SIZES, 1, 2))
def test_rtl(name, after, behind):
    simulate(__file__, make, name=name, after=after, behind=behind)
