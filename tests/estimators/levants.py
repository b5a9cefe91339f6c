"""Helpers that the tests of Levant's differentiator and its variants share: campaigns, promises, word-length error."""

import math
from collections.abc import Iterator
from functools import cache
from random import Random

import cocotb
import numpy as np

from hardwall.model.axis.axis import Axis
from hardwall.model.encoder.quadrature import seen_count
from hardwall.model.estimators import levant
from hardwall.model.estimators.estimate import estimate
from hardwall.model.runtime.compiled import compiled
from hardwall.model.spec import AxisSpec
from hardwall.testing import CAMPAIGN, SAMPLES, Bench, parameters, rng
from hardwall.testing.estimators import follow, reset_words
from stimuli.lengths import WHOLE
from stimuli.papers_signal import axis_at, swing
from stimuli.seeded import seeded

TURN_S = 1 + math.atan(2 * math.pi) / (2 * math.pi)
"""The time at which the paper's signal turns, so that its velocity is 0."""
REFUSED = [
    ({"lambda_sqrt_m_per_s": -1.0, "alpha_m_per_s2": 1.0}, "lambda_sqrt_m_per_s"),
    ({"lambda_sqrt_m_per_s": 1.0, "alpha_m_per_s2": math.nan}, "alpha_m_per_s2"),
    ({"lambda_sqrt_m_per_s": 1e9, "alpha_m_per_s2": 1.0}, "lambda_sqrt_m_per_s must be .* to .*, not"),
    ({"lambda_sqrt_m_per_s": 1.0, "alpha_m_per_s2": 1e12}, "alpha_m_per_s2 must be .* to .*, not"),
    ({"lambda_sqrt_m_per_s": 1.0, "alpha_m_per_s2": 1e-12}, "alpha_m_per_s2 must be .* to .*, not"),
    ({"lambda_sqrt_m_per_s": 1e-12, "alpha_m_per_s2": 1.0}, "lambda_sqrt_m_per_s must be .* to .*, not"),
]
"""Gains that no word can hold, and the beginning of the error message."""


def stimulus(d: levant.Design, samples: int) -> Iterator[tuple[int, ...]]:
    """Yield rows that visit the track, its saturations, the wrap of the count and the ends of the gains."""
    random = seeded()
    half, fast = 1 << (d.count_width - 1), d.velocity.max >> d.velocity.f
    reset = reset_words(d)[:2]
    top = [d.lambda_.max, d.alpha.max]
    # A smooth motion through the wrap of the count, with nominal gains.
    pace = min(1, fast / half) / 2
    for k in range(samples // 4):
        yield math.floor(half * (1 + 0.5 * math.sin(k * pace)) + random.random()), 0, *reset, 0
    # The worst signs for overflow: full swings of the count at the largest gains, held until everything saturates.
    for period in (1, 2, 3, 7, 50):
        for k in range(samples // 50):
            yield (-half, half // 2 - 1, half - 1)[k // period % 3], 0, *top, k & 1
    # Ramps faster than the velocity format, from a start, long enough for alpha alone to carry u1 to its ends, which it
    # reaches in many ways; with the largest lambda u has done so before, and with none u follows u1.
    steps = d.velocity.max // top[1] + 50
    for ramp in range(max(2, samples // 10 // steps)):
        alpha = random.randint(top[1] * 3 // 4, top[1]) if ramp > 1 else top[1]
        lam, way, count = (top[0], 0)[ramp // 2 % 2], (-1, 1)[ramp % 2], 0
        for k in range(d.velocity.max // alpha + 50):
            count = way * k * (fast + 1)
            # The words of an output last in the short form, for the model runs as long as they stay.
            yield count, int(k == 0), lam, alpha, (k if WHOLE else k // 16) % 2
        yield from ends(d, count, way, random)
    yield from led(d, samples // 4, random)
    # The least distance of the error's width alone has a magnitude beyond it: to it and beside it, in two jumps,
    # between which gains of 0 leave the distance as it is.
    far = 1 << d.error.width - 1 - d.velocity.f
    for count in (way * (far + beside) for way in (-1, 1) for beside in (-1, 0, 1)):
        yield from ((0, 1, 0, 0, 0), (count // 2, 0, 0, 0, 0), (count, 0, 0, 0, 0))
    # A random walk with jumps, gains anywhere in their range, and restarts.
    count = 0
    for _ in range(samples - 2 * (samples // 4) - samples // 10):
        count += random.randrange(-half, half) if random.random() < 0.01 else random.randint(-2 * fast, 2 * fast)
        gains = reset if random.random() < 0.5 else [random.randint(0, most) for most in top]
        yield count, int(random.random() < 0.002), *gains, random.randrange(2)


def ends(d: levant.Design, count: int, way: int, random: Random) -> Iterator[tuple[int, ...]]:
    """Yield rows that leave an end of u1, to which a ramp in a direction has led, and come back to it."""
    far = (1 << (d.count_width - 1)) - 1
    # By every power of two and an LSB less, with rests of u1 at the end and beside it; two jumps turn the error round.
    for step in ((1 << n // 2) - n % 2 for n in range(2, 2 * d.alpha.width + 1)):
        for turn, alphas in ((-way, (0, 0, 0, step)), (way, (0, 0, 0, d.alpha.max))):
            for alpha in alphas:
                count += turn * far
                yield count, 0, 0, alpha, 1
    # By steps of any size, and more of another size back, so that the last one comes to it from anywhere.
    for turn in range(40):
        alpha = random.randrange(d.alpha.max) >> random.randrange(8)
        for k in range(random.randint(3, 6) + 4 * (turn % 2)):
            count += (-way, way)[turn % 2] * far
            yield count, 0, 0, alpha, k % 2


class Leader:
    """Leads the error, by the model, to a size and a side, and keeps it there: for as long as no free motion would."""

    def __init__(self, d: levant.Design):
        self._design, self._state, self._restart = d, d.start(), 1

    def rows(self, size: int, side: int, samples: int, words: list[int]) -> Iterator[tuple[int, ...]]:
        """Yield rows with an error from `size` times `side` up to a count more; with no side, of a count at rest."""
        d, half = self._design, 1 << (self._design.count_width - 1)
        params = d.params(dict(zip((word.name for word in d.words), words, strict=True)))
        for _ in range(samples):
            moved = (self._state.lead >> d.velocity.f) - side * size if side else 0
            count = (self._state.count + moved + half) % (2 * half) - half
            yield count, self._restart, *words
            self._state, _, _ = estimate(params, self._state, seen_count(count), self._restart)
            self._restart = 0


def led(d: levant.Design, samples: int, random: Random) -> Iterator[tuple[int, ...]]:
    """Yield rows with errors of every size for every time, and rests in which all bits of the error go to 0."""
    leader, left = Leader(d), samples
    while left:
        gains = reset_words(d)[:2]
        if random.random() < 0.5:
            gains = [word.max >> random.randrange(word.width) for word in (d.lambda_, d.alpha)]
        size = random.randrange(1 << d.count_width - 1) >> random.randrange(d.count_width)
        rows = min(left, 1 + (random.randrange(max(samples // 8, 1)) >> random.randrange(8)))
        yield from leader.rows(size, random.choice((-1, 0, 1)), rows, [*gains, random.randrange(2)])
        left -= rows


def wrapped(d: levant.Design, rows) -> list[tuple[int, ...]]:
    """Return rows with their counts wrapped to the width of the port."""
    half = 1 << (d.count_width - 1)
    return [((count + half) % (2 * half) - half, *rest) for count, *rest in rows]


def campaign(make, start, rows=stimulus, fewer: tuple[str, ...] = ("narrow",)):
    """Return the two cocotb tests of an estimator that `make` makes for a named axis.

    Axes in `fewer` get a tenth of the rows: their words are a few bits wide, so everything saturates and wraps often.
    """

    @cocotb.test(**CAMPAIGN)
    async def follows_model(dut):
        name = parameters()["name"]
        component = make(name)
        samples = SAMPLES // 10 if name in fewer else SAMPLES
        expected = await follow(dut, component, rows(component.design, samples), start)
        # The campaign must reach both saturations, and the quiet track too.
        assert 0 in expected["saturated"]
        assert np.bitwise_or.reduce(expected["saturated"]) == 0b11

    @cocotb.test()
    async def reset_mid_stream_starts_afresh(dut):
        component = make(parameters()["name"])
        bench = Bench(dut, component)
        await bench.reset()
        reset = dict(zip((word.name for word in component.design.words), reset_words(component.design), strict=True))
        await bench.transact("strobe", "valid", seen__count=0, **reset)
        await bench.transact("strobe", "valid", seen__count=1, **reset)
        assert bench.reader("velocity")() != 0
        await bench.reset()
        await bench.transact("strobe", "valid", seen__count=-1, **reset)
        assert bench.reader("velocity")() == 0

    return follows_model, reset_mid_stream_starts_afresh


def axis(axis_spec: AxisSpec, output: str = "u", floating: bool = False) -> Axis:
    """Return an axis with the given output selected."""
    return Axis(axis_spec, floating, **axis_spec.design.estimator.choose(output))


@compiled
def _squared_errors(params, state, counts, truth, unit):
    """Return the sums of the squared errors of u and of u1: whichever is chosen, the state keeps u1."""
    of_u = of_u1 = 0.0
    for k in range(len(counts)):
        state, u, _ = estimate(params, state, seen_count(counts[k]), 0)
        of_u += (u * unit - truth[k]) ** 2
        of_u1 += (state.u1 * unit - truth[k]) ** 2
    return of_u, of_u1


@cache
def rms_errors(axis_spec: AxisSpec, seconds: float, runs: int) -> dict[str, tuple[float, float]]:
    """Return by output the RMS errors on the paper's signal, m/s, in float64 and in fixed point, over all runs.

    The runs have random phases.
    """
    d, unit = axis_spec.design.estimator, axis_spec.velocity_unit_m_per_s
    random, squares = rng(), np.zeros((2, 2))
    for _ in range(runs):
        counts, truth = swing(axis_spec.sample_hz, seconds, TURN_S, random.random())
        for way, (floating, lsb) in enumerate(((True, 1.0), (False, d.velocity.lsb))):
            params = Axis(axis_spec, floating).params.estimator
            squares[:, way] += _squared_errors(params, d.start(floating), counts, truth, lsb * unit)
    return dict(zip(("u", "u1"), np.sqrt(squares / (runs * len(truth))), strict=True))


def displacements(axis_spec: AxisSpec, counts: np.ndarray) -> Iterator[tuple[float, float, float]]:
    """Yield (sign, |b|, u - u1) of every sample with nonzero b, in counts, for the variants that project."""
    d = axis_spec.design.estimator
    params, state = d.params({word.name: word.reset for word in d.words}), d.start()
    for count in counts.tolist():
        moved = count - state.count if state.running else 0
        b = (state.lead - (moved << d.velocity.f)) * d.velocity.lsb
        state, velocity, flags = estimate(params, state, seen_count(count), 0)
        assert flags == 0
        if b:
            yield math.copysign(1, b), abs(b), (velocity - state.u1) * d.velocity.lsb


def half_up(dividend: int, divisor: int) -> int:
    """Return the quotient, rounded to the nearest integer, halves up."""
    return (2 * dividend + divisor) // (2 * divisor)


def oracle_run(d: levant.Design, rows, step) -> Iterator[tuple[int, int]]:
    """Yield (velocity word, flags) of the variants that project, in exact integers, on the unwrapped position.

    All but lambda is in LSBs of the velocity. `step(lambda, alpha, b, first)` returns (near, g), the parts of |b| that
    alpha and the root take, rounded as documented.
    """
    one, v_max, e_max = 2**d.velocity.f, d.velocity.max, d.error.max
    modulus, half = 2**d.count_width, 2 ** (d.count_width - 1)
    last = position = x = u1 = None
    for count, restart, lam, alpha, output in rows:
        first = x is None or bool(restart)
        if first:
            position = x = u1 = 0
        else:
            position += ((count - last + half) % modulus - half) * one
        last = count
        far_b = x + u1 - position
        b = max(-e_max, min(e_max, far_b))
        sign = (b > 0) - (b < 0)
        near, g = step(lam, alpha, b, first)
        far_u1 = u1 - sign * near
        u1 = max(-v_max, min(v_max, far_u1))
        far_u = u1 - sign * g
        u = max(-v_max, min(v_max, far_u))
        x = position + b - sign * (near + g)
        yield (u1 if output else u), int(b != far_b) | (u != far_u or u1 != far_u1) << 1


def check_wrap_and_restart(axis_spec: AxisSpec) -> None:
    """Check that the count may wrap anywhere, and that a restart in mid-motion is a start."""
    counts, _ = swing(axis_spec.sample_hz, 0.2, TURN_S)
    one, half = axis(axis_spec), 1 << (axis_spec.count_width - 1)
    expected = one.run(counts).velocity
    assert expected.any()
    assert (one.run(counts + half - counts[0] - 1000).velocity == expected).all()
    params, states = one.params.estimator, [axis_spec.design.start().estimator] * 2
    for k, count in enumerate(counts[: len(counts) // 2].tolist()):
        states[0], *_ = estimate(params, states[0], seen_count(count), int(k == 700))
        if k >= 700:
            states[1], *_ = estimate(params, states[1], seen_count(count), 0)
            assert states[0] == states[1]


def check_no_drift(axis_spec: AxisSpec) -> None:
    """Check that velocities sum up to the counts moved, from standstill to the largest speed and at the smallest."""
    rate, tau = axis_spec.sample_hz, 1 / axis_spec.sample_hz
    top, steep = axis_spec.speed_max_m_per_s / axis_spec.count_m, axis_spec.acceleration_max_m_per_s2 / 2
    ramp = np.minimum(np.arange(rate) * tau * steep / axis_spec.count_m, top)
    for speed in (ramp, -ramp, np.full(rate, 3.0), np.full(rate, -3.0)):
        counts = np.floor(np.cumsum(speed) * tau + 0.25).astype(np.int64)
        record = axis(axis_spec).run(counts)
        assert record.design.flag_names(int(record.flags[-1])) in ([], ["count_wrapped"])
        total = int(record.velocity.sum()) * record.design.estimator.velocity.lsb
        assert abs(total - (counts[-1] - counts[0])) <= 2


def check_finite_difference_in_the_band(estimator: str) -> None:
    """Check that there is no memory and no chatter where the count's second difference is below alpha.

    At 1 kHz alpha is 13 counts.
    """
    axis_spec = axis_at(estimator, 1_000, 12.0)
    d = axis_spec.design.estimator
    assert d.alpha.to_real(d.words[1].reset) > 12
    moved = np.cumsum(rng().integers(-6, 7, 5000))
    for output in axis_spec.design.estimator.outputs:
        for floating in (False, True):
            record = axis(axis_spec, output, floating).run(np.cumsum(moved))
            lsb = 1.0 if floating else d.velocity.lsb
            assert (record.velocity[1:] * lsb == moved[1:]).all()


def check_standstill(estimator: str, rate: int) -> None:
    """Check that both outputs are exactly 0 from 0.1 s after a stop from 30 mm/s on; `levant` never comes to 0."""
    axis_spec = axis_at(estimator, rate)
    ramp = np.floor(np.arange(rate // 20) * 0.03 / rate / axis_spec.count_m)
    counts = np.concatenate([ramp, np.full(rate // 4, ramp[-1])]).astype(np.int64)
    until = len(ramp) + rate // 10
    explicit = axis(axis_at("levant", rate)).run(counts).velocity
    assert (np.abs(explicit[until:]) > 0).mean() > 0.99
    for output in axis_spec.design.estimator.outputs:
        velocity = axis(axis_spec, output).run(counts).velocity
        assert velocity[: len(ramp)].any()
        assert not velocity[until:].any()
