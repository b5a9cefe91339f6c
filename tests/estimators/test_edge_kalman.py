"""The Kalman filter of edges: RTL against model, model against exact rationals, fixed against float."""

import math
from dataclasses import replace
from itertools import chain, islice

import cocotb
import numpy as np
import pytest
from cocotb.triggers import ClockCycles, ReadOnly, RisingEdge
from edge_oracle import Oracle

from hardwall.hdl.estimators.edge_kalman import Estimator
from hardwall.model.encoder.quadrature import Seen
from hardwall.model.estimators import edge_kalman
from hardwall.model.estimators.edge_kalman_design import START
from hardwall.model.estimators.edge_kalman_tables import USUAL_SHARE
from hardwall.model.estimators.estimate import estimate
from hardwall.testing import CAMPAIGN, SAMPLES, Bench, parameters, simulate
from hardwall.testing.estimators import follow, model, names, outputs
from stimuli.decoder_outputs import Scale
from stimuli.lengths import LONG, some_of
from stimuli.seeded import seeded
from stimuli.specs import spec


def design(name: str) -> edge_kalman.Design:
    return spec(name, "edge-kalman").design.estimator


def make(name: str) -> Estimator:
    return Estimator(design(name))


def stimulus(d: edge_kalman.Design, samples: int):
    """Yield rows: motion at every speed, through every wrap; impacts, rests, vibration, displaced edges, noise."""
    random = seeded()
    half = 1 << (d.count_width - 1)
    scale = Scale(d, now=(1 << d.stamp_width) - 3 * d.clocks, count=half - 5)
    # Motion faster than the velocity format, and than the distance's, in both directions.
    fast = (d.velocity.max >> d.velocity.f) + 2
    for k in range(120):
        scale.now += d.clocks
        edges, up = (fast, 2 * d.distance.max)[k // 20 % 2], k // 40 % 2 == 0
        for edge in range(scale.pass_all_but_four(up, edges), edges):
            scale.pass_edge(up, scale.now - min(edges, d.clocks - 1) + edge)
        yield *scale.row(), int(k % 60 == 0)
    while samples > 0:
        style, pace, up = random.randrange(8), random.randrange(9), random.random() < 0.5
        # A rest, at most until the stamps wrap.
        scale.now += int(2.0 ** random.uniform(0, d.stamp_width)) if random.random() < 0.3 else 0
        every = random.randrange(1, 40)
        for k in range(random.randrange(5, 120)):
            scale.now += d.clocks
            edges = random.randrange(fast) if pace == 0 else int(random.random() < 2.0 ** (1 - pace))
            if style > 5:  # a constant speed, to which the gains become quiet
                edges = int(k % every == 0)
            for edge in range(scale.pass_all_but_four(up, edges) if style > 1 else 0, edges):
                if style == 0 or (style == 1 and random.random() < 0.1):
                    up = not up
                scale.pass_edge(up, scale.now - 1 - int(random.random() * d.clocks / (edge + 1)) * (style != 7))
            if style == 2:
                scale.count = random.randrange(-half, half)
            row = scale.row()
            if style == 3:
                noise = [random.getrandbits(d.stamp_width) for _ in range(5)]
                row = (row[0], *noise, *(random.randrange(most) for most in (4, 2, 5)))
            yield *row, int(random.random() < 0.002)
            samples -= 1


def drifting(d: edge_kalman.Design, samples: int):
    """Yield rows of edges at a constant time until the memory is long, which then come later and later.

    The mean of the errors passes the alarm's bound as slowly as not, so that a little more or less of it tells.
    """
    random, scale = seeded(), Scale(d)
    while samples > 0:
        size, up = random.uniform(7, d.stamp_width - 4), random.random() < 0.5
        # The shorter the time between edges, the more of them make the memory long, and the less each of them weighs.
        span, quiet = int(2.0**size), min(int(2.0 ** random.uniform(3, max(20 - size, 5))), 3_000)
        grow = 2.0 ** random.uniform(-14, -3)
        for k in range(quiet + 40):
            scale.now += span
            scale.pass_edge(up, scale.now - 1 - int(min(grow * max(k - quiet, 0), 0.9) * span))
            yield *scale.row(), 0
        samples -= quiet + 40


def braking(d: edge_kalman.Design, samples: int):
    """Yield rows of an axis that brakes evenly and stays behind its last edge, or stops at once.

    Where it stays, silence tells that the line, which goes on to brake, is wrong: at first it is held at the speed with
    which the edge would be passed again, and then by the bound, which becomes smaller. After a stop it is the bound
    alone.
    """
    random, scale = seeded(), Scale(d)
    # In counts a clock per clock.
    steepest = d.a.max * d.a.lsb / d.clocks / (1 << d.unit)
    while samples > 0:
        up, begin = random.random() < 0.5, scale.now + 1
        if random.random() < 0.5:
            edges, brake = random.randrange(8, 80), steepest * random.uniform(0.05, 0.9)
            speed = math.sqrt(2 * brake * (edges + random.random()))
            passed = [(speed - math.sqrt(speed**2 - 2 * brake * n)) / brake for n in range(edges)]
        else:  # as many edges as it takes to catch up with their speed
            every = d.clocks * random.uniform(0.4, 1.6)
            passed = [n * every for n in range(random.randrange(120, 200))]
        waiting = [begin + int(time) for time in passed]
        end = waiting[-1] + random.uniform(0.5, 4) * (passed[-1] - passed[-2] + d.clocks)
        while scale.now < end:
            scale.now += d.clocks
            while waiting and waiting[0] < scale.now:
                scale.pass_edge(up, waiting.pop(0))
            yield *scale.row(), 0
            samples -= 1


def learning(d: edge_kalman.Design, samples: int):
    """Yield edges that are all in their places for long, or all out of them, so that an error is halved and doubled."""
    random, scale, wide = seeded(), Scale(d), 0.9
    while samples > 0:
        every, wide, up = random.randrange(1, 3), 0.9 - wide, random.random() < 0.5
        for k in range(random.randrange(300, 500)):
            scale.now += d.clocks
            if k % every == 0:
                scale.pass_edge(up, scale.now - 1 - int((0.5 + wide * (random.random() - 0.5)) * d.clocks))
            yield *scale.row(), int(random.random() < 0.002)
            samples -= 1


def rows_of(d: edge_kalman.Design, samples: int):
    """Yield the rows of all stimuli."""
    yield from chain(stimulus(d, samples // 2), *(each(d, samples // 6) for each in (drifting, braking, learning)))


@cocotb.test(**CAMPAIGN)
async def follows_model(dut):
    name = parameters()["name"]
    expected = await follow(dut, make(name), rows_of(design(name), SAMPLES), START)
    # The campaign must reach both saturations, and the quiet track too.
    assert 0 in expected["saturated"]
    assert np.bitwise_or.reduce(expected["saturated"]) == 0b111


@cocotb.test()
async def outputs_change_with_valid_alone(dut):
    """What a sample has found is shown at once and whole, not as it is found."""
    d = design(parameters()["name"])
    bench, shown = Bench(dut, Estimator(d)), set()
    await bench.reset()

    async def watch():
        before = None
        while True:
            await RisingEdge(dut.clk)
            await ReadOnly()
            now = tuple(int(getattr(dut, name).value) for name in outputs(d))
            assert before in (None, now) or dut.valid.value == 1, f"{before} becomes {now} without valid"
            before = now
            shown.add(now[-1])

    watching = cocotb.start_soon(watch())
    for row in islice(rows_of(d, 400), 400):
        await bench.transact("strobe", "valid", **dict(zip(names(d), row, strict=True)))
    watching.cancel()
    assert len(shown) > 1


@cocotb.test()
async def reset_mid_stream_starts_afresh(dut):
    d = design(parameters()["name"])
    bench, scale = Bench(dut, Estimator(d)), Scale(d)

    async def sample(edges):
        scale.now += 4 * d.clocks
        for _ in range(edges):
            scale.pass_edge(True, scale.now - 3)
        row = (*scale.row()[:9], 0)
        await bench.transact("strobe", "valid", **dict(zip(names(d), row, strict=True)))
        return bench.reader("velocity")()

    await bench.reset()
    # A clock without a strobe begins nothing.
    await ClockCycles(dut.clk, 2)
    moving = [await sample(1) for _ in range(4)]
    assert moving[:2] == [0, 0]
    assert moving[3] > 0
    await bench.reset()
    assert await sample(1) == 0


@pytest.mark.parametrize("name", some_of(["mhz", "narrow", "paper"], 0))
def test_rtl(name):
    simulate(__file__, make, name=name)


@pytest.mark.parametrize("name", ["paper", "mhz", "narrow", "wide"])
def test_model_is_the_exact_equation_rounded_as_documented(name):
    d = design(name)
    rows = list(rows_of(d, 12_000 if LONG else 6_000))
    seen, oracle, changes = model(d, rows, START), Oracle(d), set()
    for k, row in enumerate(rows):
        before = oracle.halvings
        assert oracle.step(row) == tuple(seen[name][k] for name in outputs(d)), f"sample {k}: {row}"
        changes.add("forgotten" if before and row[-1] else oracle.halvings - before)
    # An error is halved, doubled, and forgotten.
    assert changes >= {1, -1, "forgotten"}


# ---- promises -------------------------------------------------------------------------------------------------------


def walk(d: edge_kalman.Design, rows) -> list[tuple[int, int]]:
    """Return (velocity, flags) of rows of a decoder, with a restart appended or without."""
    seen = model(d, [(*row[:9], row[9] if len(row) > 9 else 0) for row in rows], START)
    return list(zip(seen["velocity"].tolist(), seen["saturated"].tolist(), strict=True))


def steady(d, samples: int, every: int, scale: Scale | None = None, displaced=None):
    """Yield rows of an axis with an edge every `every` samples, each `displaced` clocks late."""
    scale, displaced = scale or Scale(d), displaced if displaced is not None else np.zeros(samples, int)
    for k in range(samples):
        scale.now += d.clocks
        if k % every == every - 1:
            scale.pass_edge(True, scale.now - 1 - d.clocks * every // 4 + int(displaced[k]))
        yield scale.row()


def test_a_constant_speed_is_read_to_a_few_words():
    d = design("mhz")
    seen = walk(d, steady(d, 60_000, 20))
    assert seen[:39] == [(0, 0)] * 39
    assert seen[60][0] > 0
    # A place that is rounded by half an LSB at every edge is a velocity off by that over the interval.
    exact, rounding = 2**d.velocity.f / 20, 2.0 ** (d.velocity.f - d.error.f - 1) / (20 * d.clocks) + 1
    assert max(abs(velocity - exact) for velocity, _ in seen[50_000:]) <= rounding
    assert {flags for _, flags in seen} == {0}


def test_a_slow_speed_whose_edges_are_at_the_end_of_a_row_is_read():
    """Edges at twice the memory, the longest T, where the gains of a white jerk would diverge."""
    axis = replace(spec("mhz", "edge-kalman"), edge_error_max_counts=1e-3)
    d, every = axis.design.estimator, 3900
    assert 1.4 < every * d.clocks / 2 ** int(math.log2(every * d.clocks)) < 1.5
    row_s = 2.0 ** (int(math.log2(every * d.clocks)) + 1) * math.sqrt(1.5) / 2 / axis.clock_hz
    assert d.agile_s[0, 2 * (every * d.clocks).bit_length()] == pytest.approx(row_s / 2)
    seen = walk(d, steady(d, 40 * every, every))
    assert all(velocity * d.velocity.lsb == pytest.approx(1 / every, rel=1e-3) for velocity, _ in seen[20 * every :])


def test_silence_between_edges_in_pairs_does_not_bound_the_velocity():
    """Edges in turns early and late, 0.55 and 1.45 counts apart: a long silence is no sign of a slower axis."""
    d, every, samples = design("mhz"), 16, 60_000
    late = int(0.45 * every * d.clocks / 2)
    assert (every * d.clocks + 2 * late).bit_length() > (every * d.clocks).bit_length()
    displaced = np.zeros(samples, int)
    displaced[every - 1 :: 2 * every], displaced[2 * every - 1 :: 2 * every] = late, -late
    seen = np.array([v for v, _ in walk(d, steady(d, samples, every, displaced=displaced))[samples // 2 :]])
    assert seen.min() * d.velocity.lsb * every > 0.99


@pytest.mark.parametrize("halvings", [1, 2, 4])
def test_edges_that_err_are_averaged_over_the_memory_of_the_error_that_is_learned(halvings):
    """At a constant speed and independent errors the velocity's deviation is that of the filter's own covariance."""
    d, axis, every = design("mhz"), spec("mhz", "edge-kalman"), 20
    # Well within the errors for which this number of halvings stays, which are 0.56 to 2 times the error in use.
    sigma = 0.95 * 0.1 * 2.0**-halvings
    displaced = np.round(sigma * every * d.clocks * np.random.default_rng(5).standard_normal(400_000)).astype(int)
    rows = [(*row, 0) for row in steady(d, 400_000, every, displaced=displaced)]
    assert states(d, rows[:40_000])[-1].halvings == halvings
    velocity = model(d, rows, START)["velocity"][40_000:] * d.velocity.lsb - 1 / every
    time_s = every * d.clocks / axis.clock_hz
    memory_s = d.quiet_s[halvings, 2 * 10 + 0]
    # The continuous filter's: sigma sqrt(3/2 T / M) / M; each edge errs independently of the motion.
    expected = sigma * math.sqrt(1.5 * time_s / memory_s) / memory_s / axis.sample_hz
    assert velocity.std() == pytest.approx(expected, rel=0.15)


def states(d: edge_kalman.Design, rows) -> list:
    """Return the state after each of the rows, which have a restart."""
    after, params = [START], d.params({})
    for *row, restart in rows:
        after.append(estimate(params, after[-1], Seen(*row), restart)[0])
    return after[1:]


def test_what_is_learned_follows_the_edges_is_kept_over_a_rest_and_forgotten_with_a_restart():
    d, every, scale = design("mhz"), 20, Scale(design("mhz"))
    perfect = [(*row, 0) for row in steady(d, 40_000, every, scale)]
    rest = [(*row, 0) for row in steady(d, 2_000, 10**9, scale)]
    again = [(*row, 0) for row in steady(d, 400, every, scale)]
    displaced = np.round(0.05 * every * d.clocks * np.random.default_rng(6).standard_normal(12_000)).astype(int)
    worse = [(*row, 0) for row in steady(d, 12_000, every, scale, displaced)]
    begun = [(*row, int(k == 0)) for k, row in enumerate(steady(d, 1, every, scale))]
    parts = perfect, rest, again, worse, begun
    seen = iter(states(d, [row for part in parts for row in part]))
    perfect, rest, again, worse, begun = ([next(seen) for _ in part] for part in parts)
    assert perfect[0].halvings == 0
    assert perfect[-1].halvings == d.halvings_max
    assert rest[-1].velocity == 0
    assert {state.halvings for state in rest} == {d.halvings_max}
    assert again[-1].halvings == d.halvings_max
    # Four hundred edges later the error in use is that of the edges, half of what is stated, or a half more or less.
    assert {state.halvings for state in worse[400 * every :]} <= {0, 1, 2}
    assert (begun[0].halvings, begun[0].share) == (0, USUAL_SHARE)


def test_a_vibration_across_one_edge_teaches_nothing():
    """An edge that is crossed back has its own error twice: no innovation says that it is in its place."""
    d, scale, rows = design("mhz"), Scale(design("mhz")), []
    for k in range(60_000):
        scale.now += d.clocks
        if k % 50 == 49:
            scale.pass_edge(k // 50 % 2 == 0, scale.now - 1)
        rows.append((*scale.row(), 0))
    assert {state.halvings for state in states(d, rows)} == {0}


class Told(edge_kalman.Design):
    """A filter that is told the error, and cannot learn."""

    halvings_max = 0


@pytest.mark.parametrize("ratio", [0.6, 0.7, 0.8])
def test_an_error_between_two_halvings_costs_little(ratio):
    """The velocity's deviation beside that of a filter which is told the error, and cannot learn: half more at most."""
    every, sigma, samples = 20, 0.05 * ratio, 400_000
    axis = replace(spec("mhz", "edge-kalman"), edge_error_max_counts=sigma)

    d = design("mhz")
    displaced = np.round(sigma * every * d.clocks * np.random.default_rng(7).standard_normal(samples)).astype(int)
    rows = [(*row, 0) for row in steady(d, samples, every, displaced=displaced)]

    def deviation(d: edge_kalman.Design) -> float:
        return np.std(model(d, rows, START)["velocity"][samples // 4 :])

    assert deviation(d) < 1.5 * deviation(Told(axis, edge_kalman.Gains.default(axis)))


def test_a_speed_that_jumps_is_hardly_an_error_of_edges():
    """A speed that triples at once makes some tens of large innovations: one doubling, which is taken back."""
    d, scale = design("mhz"), Scale(design("mhz"))
    rows = [(*row, 0) for row in (*steady(d, 40_000, 20, scale), *steady(d, 8_000, 7, scale))]
    learned = [state.halvings for state in states(d, rows)]
    assert learned[39_999] == learned[-1] == d.halvings_max
    assert min(learned[40_000:]) >= d.halvings_max - 1


def test_an_impact_makes_the_memory_agile_and_it_grows_again():
    """A speed that doubles at once is read within an agile memory or two, far sooner than a quiet one fades."""
    axis = replace(spec("mhz", "edge-kalman"), jerk_max_m_per_s3=12.0)
    d = axis.design.estimator
    scale = Scale(d)
    before = list(steady(d, 100_000, 20, scale))
    after = list(steady(d, 20_000, 10, scale))
    seen = [velocity * d.velocity.lsb for velocity, _ in walk(d, [*before, *after])]
    # These edges are perfect, and learned as such.
    agile = d.agile_s[-1, 2 * 9 + 1] * axis.sample_hz
    quiet = d.quiet_s[-1, 2 * 9 + 1] * axis.sample_hz
    assert quiet > 4 * agile
    reached = next(k for k, velocity in enumerate(seen[100_000:]) if abs(velocity - 0.1) < 0.01)
    assert reached < 2.5 * agile
    assert abs(seen[-1] - 0.1) < 1e-5


@pytest.mark.parametrize("every", [50, 1000])
def test_an_axis_that_stops_reads_exactly_zero(every):
    """After a stop from constant speed the velocity is 0 within 16 times the last interval, and stays 0."""
    d = design("mhz")
    scale = Scale(d)
    moving = list(steady(d, 40 * every, every, scale))
    seen = walk(d, [*moving, *steady(d, 20 * every, 10**9, scale)])
    at_rest = [velocity for velocity, _ in seen[40 * every :]]
    assert at_rest[0] > 0
    assert set(at_rest[17 * every :]) == {0}
    assert all(abs(velocity) <= at_rest[0] for velocity in at_rest)


def test_a_vibration_across_one_edge_reads_no_drift():
    d, scale, rows = design("mhz"), Scale(design("mhz")), []
    for k in range(4000):
        scale.now += d.clocks
        if k % 100 == 99:
            scale.pass_edge(k // 100 % 2 == 0, scale.now - 1)
        rows.append(scale.row())
    assert {velocity for velocity, _ in walk(d, rows)} == {0}


def test_wraps_of_count_and_clock_change_nothing():
    d = design("mhz")
    plain = walk(d, steady(d, 3000, 7, Scale(d, now=10**6)))
    wrapped = Scale(d, now=(1 << d.stamp_width) - 1500 * d.clocks, count=(1 << (d.count_width - 1)) - 200)
    assert walk(d, steady(d, 3000, 7, wrapped)) == plain


def test_restart_mid_motion_starts_afresh():
    d = design("mhz")
    rows = [(*row, 0) for row in steady(d, 1000, 50)]
    rows[500] = (*rows[500][:-1], 1)
    seen = walk(d, rows)
    assert seen[499][0] > 0
    assert [velocity for velocity, _ in seen[500:549]] == [0] * 49


def test_stamps_of_a_faster_clock_are_taken_in_units():
    """A clock beyond TIME_BITS: the times in use have the same bits, and the velocity is the same."""
    axis = replace(spec("mhz", "edge-kalman"), clock_hz=1_000_000_000)
    d = axis.design.estimator
    assert (d.unit, d.time_bits) == (3, 27)
    seen = model(d, [(*row[:9], 0) for row in steady(d, 20_000, 20)], START)
    assert abs(int(seen["velocity"][-1]) * d.velocity.lsb - 1 / 20) < 1e-4


def test_wrong_design_is_refused():
    with pytest.raises(TypeError, match=r"not 3$"):
        Estimator(3)


@pytest.mark.parametrize("acceleration_max_m_per_s2", [1e-30, 1e-6, 12.0, 1e6, 1e30] if LONG else [1e-30, 12.0, 1e30])
@pytest.mark.parametrize(
    ("clock_hz", "sample_hz", "fastest_m_per_s"),
    [(10**9, 4, 490.0), (1 << 36, 4, 400.0), (1 << 36, 16, 400.0), (176, 4, 8e-5), (50_000_000, 1_000_000, 24.0)],
)
def test_no_axis_that_is_accepted_is_beyond_the_integers_of_the_model(
    clock_hz, sample_hz, fastest_m_per_s, acceleration_max_m_per_s2
):
    """The exact equation has integers without an end; the model's have 64 bits."""
    given = {"clock_hz": clock_hz, "sample_hz": sample_hz, "actuation_hz": sample_hz, "travel_m": 1e-6 * 2**28}
    bounds = {"acceleration_max_m_per_s2": acceleration_max_m_per_s2, "jerk_max_m_per_s3": 12.0}
    axis = replace(spec("mhz", "edge-kalman"), **given, **bounds, speed_max_m_per_s=fastest_m_per_s)
    d = axis.design.estimator
    rows = list(rows_of(d, 600))
    seen, oracle = model(d, rows, START), Oracle(d)
    for k, row in enumerate(rows):
        assert oracle.step(row) == tuple(seen[name][k] for name in outputs(d)), f"sample {k}: {row}"


@pytest.mark.parametrize("edge_error_counts", [1e-30, 1e8, 1e18, 1e30])
def test_any_error_that_is_accepted_has_words(edge_error_counts):
    """A filter that expects errors of any size believes no edge; it has no more than the speed."""
    d = replace(spec("mhz", "edge-kalman"), edge_error_max_counts=edge_error_counts).design.estimator
    assert max(abs(velocity) for velocity, _ in walk(d, steady(d, 20_000, 20))) * d.velocity.lsb < 1 / 10
