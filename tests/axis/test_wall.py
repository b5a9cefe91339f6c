"""The virtual wall: RTL against model, model against exact rationals, and a wall that may not pull never pulls."""

import dataclasses
import itertools
import math
from fractions import Fraction

import cocotb
import numpy as np
import pytest
from cocotb.triggers import ClockCycles, RisingEdge

from hardwall.hdl.axis.wall import Wall
from hardwall.model.axes.axis import Axes, AxesSpec
from hardwall.model.axis import wall
from hardwall.model.axis.axis import Axis
from hardwall.model.estimators.registry import ESTIMATORS
from hardwall.testing import CAMPAIGN, SAMPLES, Bench, check, parameters, rng, simulate
from stimuli.lengths import LONG, some_of
from stimuli.locked import mean_error
from stimuli.magnitudes import magnitudes
from stimuli.sampled import Sampled
from stimuli.specs import MHZ, NARROW, spec


def design(name: str, estimator: str = "levant", coupling: bool = False) -> wall.Design:
    return dataclasses.replace(spec(name, estimator), coupling=coupling).design.wall


def make(name: str, estimator: str, after: int, coupling: bool) -> Sampled:
    return Sampled(Wall(design(name, estimator, coupling)), after)


def names_of(d: wall.Design) -> tuple[str, ...]:
    return tuple(word.name for word in d.words)


def stimulus(d: wall.Design, samples: int):
    """Yield (count, velocity, *words): for a coupling, what a surface at rest has, and surfaces that move or hold."""
    if not d.coupling:
        yield from of_a_wall(d, samples)
        return
    least, most = d.surface.min, d.surface.max
    for row in of_a_wall(d, samples // 2):
        yield *row, 0, 0
    half = 1 << (d.count_width - 1)
    extremes = (
        (-half, -1, 0, 1, half - 1), (d.velocity.min, 0, d.velocity.max), (0, 1, d.stiffness.max),
        (0, 1, d.damping.max), (0,), (0, 1), (0, 1), (least, -1, 0, 1, most), (0, 1),
    )  # fmt: skip
    yield from itertools.product(*extremes)
    random = rng()
    surface = magnitudes(random, least, most, samples // 2, d.surface.width).tolist()
    sides = random.integers(0, 2, samples // 2).tolist()
    for row, *moving in zip(of_a_wall(d, samples // 2), surface, sides, strict=False):
        yield *row, *moving


def of_a_wall(d: wall.Design, samples: int):
    """Yield (count, velocity, *words): every combination of extremes, rounding ties, random rows near and far."""
    half = 1 << (d.count_width - 1)
    gains = d.stiffness.max, d.damping.max
    for k in (0, 1, gains[0]):
        for b in (0, 1, gains[1]):
            for position in (-half, 0, half - 1):
                for depth in (-half, -1, 0, 1, 2, half - 1):
                    for velocity in (d.velocity.min, -1, 0, 1, d.velocity.max):
                        for sides in range(4):
                            yield (
                                (position + depth + half) % (2 * half) - half,
                                velocity,
                                k,
                                b,
                                position,
                                *divmod(sides, 2),
                            )
    # Ties: the force of a spring alone, with a remainder of half a force LSB.
    tie = 1 << max(d.stiffness.f - 1, 0)
    for odd in (1, 3, 5):
        for left in (0, 1):
            yield (-odd if left else odd), 0, tie, 0, 0, left, 0
    random = rng()
    yield from beside_ties(d, samples // 10, random)
    # Depths of a single bit, and a spring that the force still holds.
    for bit in range(d.count_width - 1):
        for left in (0, 1):
            yield (1 << bit) * (-1 if left else 1), 0, 1, 0, 0, left, 0
    k, b = (magnitudes(random, 0, most, samples) for most in gains)
    depth = magnitudes(random, -half, half - 1, samples, d.count_width)
    velocity = magnitudes(random, d.velocity.min, d.velocity.max, samples, d.velocity.width)
    position = random.integers(-half, half, samples)
    count = (position + depth + half) % (2 * half) - half
    columns = count, velocity, k, b, position, *random.integers(0, 2, (2, samples))
    yield from zip(*(column.tolist() for column in columns), strict=True)


def beside_ties(d: wall.Design, samples: int, random: np.random.Generator):
    """Yield rows whose sum of spring and damper is as near to half a force LSB as the stiffness's LSB lets it be."""
    half, unit = 1 << (d.count_width - 1), Fraction(1, 2**d.push)
    for left in random.integers(0, 2, samples).tolist():
        depth = int(random.integers(1, 4))
        velocity = int(random.integers(d.velocity.min, d.velocity.max)) >> int(random.integers(0, d.velocity.width))
        b = int(random.integers(0, d.damping.max)) >> int(random.integers(0, d.damping.width))
        coarse = velocity >> d.velocity.f - d.coarse.f
        damped = Fraction(b * coarse * (-1 if left else 1), 2 ** (d.damping.f + d.coarse.f))
        force = Fraction(int(random.integers(0, min(d.force.max, 32)))) + Fraction(1, 2)
        k = round((force + int(random.integers(-1, 2)) * unit - damped) / depth * Fraction(2) ** d.stiffness.f)
        if 0 <= k <= d.stiffness.max and depth < half:
            yield depth * (-1 if left else 1), velocity, k, b, 0, left, 0


def model(d: wall.Design, rows) -> list[int]:
    names = names_of(d)
    return [wall.render(d.params(dict(zip(names, words, strict=True))), c, v) for c, v, *words in rows]


@cocotb.test(**CAMPAIGN)
async def follows_model(dut):
    component = make(**parameters())
    bench = Bench(dut, component)
    await bench.reset()
    names, top = ("count", "velocity", *names_of(component.design)), component.design.force.max
    # The next sample comes with this one's velocity, or later by any number of clocks until it comes behind its force.
    gaps = range(component.after, component.latency + 2, 2)
    for every in gaps:
        rows = stimulus(component.design, SAMPLES // len(gaps))
        inputs, outputs = await bench.campaign("strobe", "valid", names, ("force",), rows, every=every, momentary=names)
        expected = model(component.design, inputs.rows)
        assert {-top, 0, top} <= set(expected)
        check(inputs, outputs, {"force": np.array(expected)}, component.latency)


@cocotb.test()
async def a_reset_at_any_clock_of_a_sample_leaves_nothing_of_it(dut):
    """The products are not reset: no force is made of them before the next sample has made its own."""
    component = make(**parameters())
    d, bench = component.design, Bench(dut, component)
    force, valid = bench.reader("force"), bench.reader("valid")
    words = dict.fromkeys(names_of(d), 0) | {"wall_stiffness": d.stiffness.max, "wall_damping": d.damping.max}
    deepest = {"count": (1 << (d.count_width - 1)) - 1, "velocity": d.velocity.max, **words}
    row = {"count": 2, "velocity": -1, **words, "wall_stiffness": d.stiffness.max // 5, "wall_damping": 1}
    expected = wall.render(d.params({name: row[name] for name in names_of(d)}), row["count"], row["velocity"])
    for clocks in range(component.latency + 2):
        await bench.reset()
        bench.drive(**deepest, strobe=1)
        await RisingEdge(dut.clk)
        bench.drive(strobe=0)
        await ClockCycles(dut.clk, clocks + 1)
        # One clock: what is not reset has no time to become quiet.
        dut.rst.value = 1
        await RisingEdge(dut.clk)
        dut.rst.value = 0
        for _ in range(component.latency + 2):
            await RisingEdge(dut.clk)
            assert (force(), valid()) == (0, 0), f"something is left {clocks} clocks after the strobe"
        await bench.transact("strobe", "valid", **row)
        assert force() == expected


@cocotb.test()
async def the_force_is_constant_from_one_valid_to_the_next(dut):
    component = make(**parameters())
    d, bench, before = component.design, Bench(dut, component), 0
    await bench.reset()
    force = bench.reader("force")
    words = dict.fromkeys(names_of(d), 0) | {"wall_stiffness": d.stiffness.max, "wall_damping": d.damping.max}
    deepest = (1 << (d.count_width - 1)) - 1
    for count, velocity, left in ((deepest, d.velocity.max, 0), (-deepest, d.velocity.min, 1), (0, 0, 0), (-1, 0, 1)):
        row = {"count": count, "velocity": velocity, **words, "wall_left": left}
        bench.drive(**row, strobe=1)
        for clock in range(component.latency + 3):
            await RisingEdge(dut.clk)
            bench.drive(strobe=0)
            assert force() == before, f"the force changed {clock} clocks after the strobe"
            if clock == component.latency - 1:
                before = wall.render(d.params({name: row[name] for name in names_of(d)}), count, velocity)


SLOW = [name for name, design in ESTIMATORS.items() if not design.uses_stamps()]
"""Estimators of a sampled count, which stands still for many samples."""
FOLLOWED = [
    (name, estimator, floating)
    for name, estimator, floating in itertools.product(("paper", "mhz"), SLOW, (False, True))
    if LONG or (name == "mhz" and not floating) or estimator == "levant"
]
"""Axis, estimator and arithmetic of a coupling; the short form has the fixed point of every estimator at one rate."""
SIZES = [
    ("paper", "fdm", wall.LEAD, False),
    ("mhz", "levant", wall.LEAD + 1, False),
    ("narrow", "levant", 8, False),
    ("wide", "levant", 5, False),
    ("paper", "fdm", wall.LEAD, True),
    ("narrow", "levant", wall.LEAD + 1, True),
    ("wide", "levant", 5, True),
]


@pytest.mark.parametrize(("name", "estimator", "after", "coupling"), some_of(SIZES, 1, 4))
def test_rtl(name, estimator, after, coupling):
    simulate(__file__, make, name=name, estimator=estimator, after=after, coupling=coupling)


def oracle(d: wall.Design, row) -> int:
    """Return the force by the module's equations in exact rationals, rounded only where the module documents it."""
    count, velocity, k, b, position, left, forbid_pull, *moving = row
    surface, two_sided = moving or (0, 0)
    side = -1 if left else 1
    depth = side * (count - position)
    if not two_sided and depth <= 0:
        return 0
    coarse = math.floor(Fraction(velocity) / 2 ** (d.velocity.f - d.coarse.f)) * Fraction(2) ** -d.coarse.f
    beyond = coarse - surface * Fraction(2) ** -d.surface.f
    push = k * Fraction(2) ** -d.stiffness.f * depth + b * Fraction(2) ** -d.damping.f * side * beyond
    push = math.floor(push + Fraction(1, 2))
    if forbid_pull:
        push = max(push, 0)
    return -side * max(-d.force.max, min(d.force.max, push))


AXES = [("paper", "fdm"), ("proposed", "levant"), ("mhz", "levant"), ("wide", "levant")]
EXACT = [(*axis, coupling) for n, axis in enumerate(AXES) for coupling in (False, True) if LONG or n % 2 == coupling]


@pytest.mark.parametrize(("name", "estimator", "coupling"), EXACT)
def test_model_is_the_exact_equation_rounded_as_documented(name, estimator, coupling):
    d = design(name, estimator, coupling)
    rows = list(stimulus(d, 20_000))
    assert model(d, rows) == [oracle(d, row) for row in rows]


@pytest.mark.parametrize("coupling", [False, True])
def test_the_force_is_exact_for_every_position_and_count(coupling):
    """A narrow axis has few enough of both that each pair is met, beside gains and velocities at their extremes."""
    d = design("narrow", coupling=coupling)
    every = range(-(1 << d.count_width - 1), 1 << d.count_width - 1)
    gains = (0, d.stiffness.max // 3), (0, d.damping.max)
    moving = (d.surface.min, d.surface.max), (0, 1)
    rows = itertools.product(
        every, (d.velocity.min, 0, d.velocity.max), *gains, every, (0, 1), (0, 1), *(moving if coupling else ())
    )
    rows = list(rows)
    assert model(d, rows) == [oracle(d, row) for row in rows]


FAR_M, HANDLE_M = 1.0, -0.1
"""A wall at the end of the positions that an axis with 0.15 m of travel has, and a handle: far from each other."""


@pytest.mark.parametrize("left", [0, 1])
@pytest.mark.parametrize("kind", ["fixed", "float", "coupling", "passivity", "axes"])
def test_a_wall_far_away_is_far(kind, left):
    """The depth is more than the count has bits for: nothing of it may come around from the other side."""
    side = -1 if left else 1
    words = {"wall_position": side * FAR_M, "wall_stiffness": 1e3, "wall_damping": 0.0, "wall_left": left}
    counts = np.full(50, round(side * HANDLE_M / 1e-6))
    if kind == "axes":
        rates = {"sample_hz": 500_000, "actuation_hz": 500_000}
        several = AxesSpec(**MHZ | rates, axes=2, estimator="fdm")
        record = Axes(several, [words, words]).run(np.stack([counts, counts]))
    else:
        options = {kind: True} if kind in ("coupling", "passivity") else {}
        made = dataclasses.replace(spec("mhz", "fdm"), **options)
        record = Axis(made, kind == "float", **words).run(counts)
    assert (record.force == 0).all()
    assert (record.drive == 0).all()
    assert (record.flags == 0).all()
    # A wall that holds there, for the handle is beyond it: as deep as that it is exact, too.
    deep = dataclasses.replace(spec("mhz", "fdm"), force_max_n=4e3)
    deep = Axis(deep, **words | {"wall_left": 1 - left, "wall_forbid_pull": 0}).run(counts)
    assert deep.force_n[-1] == pytest.approx(side * 1e3 * (FAR_M - HANDLE_M), abs=1e-3)


@pytest.mark.parametrize("floating", [False, True])
@pytest.mark.parametrize("side", [1, -1])
def test_a_count_that_wraps_is_flagged_and_drives_nothing(side, floating):
    """Beyond the end of its range a count is at the other end, where another wall may be."""
    axis = Axis(spec("mhz", "fdm"), floating, wall_position=side * 1.0, wall_stiffness=1e3, wall_left=int(side < 0))
    end = 1 << axis.spec.count_width - 1
    counts = side * (end - 100 + np.arange(200))
    record = axis.run(counts)
    beyond = ~((counts >= -end) & (counts < end))
    wrapped = 1 << axis.design.flags.index("count_wrapped")
    assert (np.logical_or.accumulate(beyond) == (record.flags & wrapped != 0)).all()
    assert (record.drive[~beyond] != 0).all()
    assert (record.drive[beyond] == 0).all()
    assert beyond.sum() > 90


@pytest.mark.parametrize("kind", ["fixed", "float", "axes"])
@pytest.mark.parametrize("way", [1, -1])
def test_a_count_that_no_decoder_can_follow_is_flagged_and_drives_nothing(kind, way):
    """A decoder counts an edge a clock at most; a handle that jumps by more than the travel is none that it saw."""
    words, clocks = {"wall_stiffness": 1e3, "wall_left": int(way < 0)}, MHZ["clock_hz"] // 500_000
    made = AxesSpec(**MHZ | {"sample_hz": 500_000, "actuation_hz": 500_000}, axes=1, estimator="fdm")
    axis = Axes(made, [words]) if kind == "axes" else Axis(made, kind == "float", **words)
    for jump, flagged in ((clocks, False), (clocks + 1, True), (200_000, True)):
        counts = way * np.array([[0, 1, 1 + jump, jump, jump]])
        record = axis.run(counts)
        illegal = record.flags & 1 << axis.design.flags.index("encoder_illegal") != 0
        assert illegal.tolist() == [[False, False, *[flagged] * 3]]
        assert (record.drive != 0).tolist() == [[False, True, *[not flagged] * 3]]


@pytest.mark.parametrize("coupling", [False, True])
@pytest.mark.parametrize("name", ["paper", "mhz", "wide"])
def test_fixed_point_is_within_a_force_lsb_of_float(name, coupling):
    """The module's docstring promises this on the same words, wherever neither saturates."""
    d, compared = design(name, coupling=coupling), 0
    for count, velocity, *words in stimulus(d, 20_000):
        named = dict(zip(names_of(d), words, strict=True))
        si = [word.to_si(named[word.name]) for word in d.words[:2]]
        exact = wall.render(d.float_params(*si, named), count, velocity * d.velocity.lsb)
        fixed = wall.render(d.params(named), count, velocity)
        if abs(exact) < d.force.max - 1:
            compared += 1
            assert abs(fixed - exact) <= 1 + 1e-9
    assert compared > 10_000


def test_a_wall_that_may_not_pull_never_pulls():
    d = design("paper", coupling=True)
    for count, velocity, *words in stimulus(d, 5_000):
        named = dict(zip(names_of(d), words, strict=True)) | {"wall_forbid_pull": 1}
        force = wall.render(d.params(named), count, velocity)
        assert force >= 0 if named["wall_left"] else force <= 0


@pytest.mark.parametrize("floating", [False, True])
def test_a_surface_that_is_moved_is_that_of_its_words(floating):
    d = design("mhz", coupling=True)
    words = dict(zip(names_of(d), (700, 900, -3, 1, 0, 5, 1), strict=True))

    def params(changes):
        made = words | changes
        return d.float_params(20e3, 30.0, made) if floating else d.params(made)

    changes = {"wall_position": 1234, "wall_velocity": -77}
    assert wall.moved(params({}), *changes.values()) == params(changes)


@pytest.mark.parametrize(("name", "estimator", "floating"), FOLLOWED)
def test_a_coupling_damps_to_its_surface_however_slow_it_is(name, estimator, floating):
    """A handle that goes with its surface is not braked: in the mean over the counts, at less than a count a sample."""
    made = dataclasses.replace(spec(name, estimator), coupling=True)
    held = {"wall_stiffness": 0.0, "wall_two_sided": 1, "wall_forbid_pull": 0}
    error_m_per_s = mean_error(made.design.estimator) * made.velocity_unit_m_per_s
    for speed in (5e-3, -23e-3):
        counts = np.floor(np.arange(100_000) * (speed / made.sample_hz / made.count_m)).astype(np.int64)
        record = Axis(made, floating, wall_damping=100.0, wall_velocity=speed, **held).run(counts)
        assert abs(record.force_n[50_000:].mean()) < 2 * made.force_resolution_n + 100.0 * error_m_per_s


def test_gains_of_an_axis_that_are_too_small_are_refused_by_name():
    for stiffness, name in ((1e-17, "stiffness_max_n_per_m"), (1e3, "damping_max_n_s_per_m")):
        with pytest.raises(ValueError, match=f"^{name} must be at least "):
            dataclasses.replace(spec("paper"), stiffness_max_n_per_m=stiffness, damping_max_n_s_per_m=1e-20)


def test_several_axes_have_no_moving_surfaces():
    with pytest.raises(ValueError, match=r"^coupling must be False: axes that share their logic"):
        AxesSpec(**NARROW, axes=2, estimator="fdm", coupling=True)


def test_wrong_design_is_refused():
    with pytest.raises(TypeError, match=r"not 3$"):
        Wall(3)
