"""The passivity controller: RTL against model, the model against its words, and what both parts promise."""

import dataclasses
import math
from fractions import Fraction

import cocotb
import numpy as np
import pytest

from hardwall.hdl.axis.passivity import Passivity
from hardwall.hdl.export import to_verilog
from hardwall.model.arithmetic.fixed import shift_floor
from hardwall.model.axes.axis import AxesSpec
from hardwall.model.axis import passivity, wall
from hardwall.model.spec import AxisSpec
from hardwall.testing import CAMPAIGN, SAMPLES, Bench, check, parameters, rng, simulate
from stimuli.handle_paths import energies
from stimuli.lengths import some_of
from stimuli.magnitudes import magnitudes
from stimuli.observed import Observed
from stimuli.specs import NARROW, spec

NAMES = "count", "restart", "velocity", "drive", "passivity_damping", "force"


AXES = {
    "gentle": dataclasses.replace(spec("paper"), damping_max_n_s_per_m=1e-3),
    "whole": spec("mhz", "fdm"),
}
"""A damper whose largest force is far below the axis's, and a velocity of whole counts, so that no bit is dropped."""


def design(name: str) -> passivity.Design:
    axis = AXES[name] if name in AXES else spec(name)
    return passivity.Design(axis, axis.design.estimator.velocity)


def make(name: str, after: int, behind: int) -> Observed:
    return Observed(design(name), after, behind)


def wrapped(d: passivity.Design, count: int) -> int:
    half = 1 << d.count_width - 1
    return (count + half) % (2 * half) - half


def fastest(d: passivity.Design) -> int:
    """Return the largest change of the count in a sample, so that its displacement fits."""
    return d.displacement.max // 2 - 1


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
        one, gives, way = random.random() < 0.6, random.random(), int(random.choice((-1, 1)))
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
            restart = int(nothing > 0.997)
            if restart:
                count = int(random.integers(-(1 << d.count_width - 1), 1 << d.count_width - 1))
            velocity = d.velocity.min if extreme > 0.99 else way * speed
            force = 0 if nothing < 0.02 else force or 1  # noqa: PLW2901
            force = (top, -top, 1, -1)[int(extreme * 100) % 4] if extreme < 0.1 else force  # noqa: PLW2901
            yield wrapped(d, count), restart, velocity, way * drive, damping, force


def model(d: passivity.Design, rows, state: passivity.State = passivity.START) -> tuple[list[tuple], passivity.State]:
    """Return what is given, and whether the controller acts, for rows of NAMES, and the state behind them."""
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
        assert 0.01 < active.mean() < 0.95
        # A damper that is weaker than every force neither ends one nor saturates with it.
        strong = shift_floor(d.damping.max * d.coarse.max, d.shift) > d.force.max
        assert not strong or {-d.force.max, 0, d.force.max} <= set(given[active == 1].tolist())
        check(inputs, outputs, {"given": given, "active": active}, component.latency)


SIZES = [("paper", 2, 3), ("mhz", 3, 5), ("narrow", 8, 3), ("wide", 5, 4), ("gentle", 4, 3), ("whole", 2, 4)]


@pytest.mark.parametrize(("name", "after", "behind"), some_of(SIZES, 1))
def test_rtl(name, after, behind):
    simulate(__file__, make, name=name, after=after, behind=behind)


def bits(value: int) -> int:
    """Return the bits of a value's two's complement without its signs."""
    return (value if value >= 0 else -value - 1).bit_length()


def oracle(d: passivity.Design, rows) -> list[tuple[int, int]]:
    """Return what is given, and whether the controller acts, by the module's words, in exact integers and rationals."""
    energy, place, last, out, half = 0, 1, 0, [], 1 << d.count_width - 1
    for count, restart, velocity, drive, damping, force in rows:
        moved = (count - last + half) % (2 * half) - half
        # Half counts above the lower end of the last count, then of this one.
        now = {0: place, 1: 0, -1: 2}.get(moved, 1)
        energy = max(-d.energy.max, min(energy - drive * (2 * moved + now - place), d.energy.max))
        place, last, part = now, count, 0
        if restart:
            place, energy = 1, 0
        if energy < 0 and force:
            coarse = math.floor(Fraction(velocity) / 2 ** (d.velocity.f - d.coarse.f))
            damper = math.floor(Fraction(damping * coarse) / Fraction(2) ** d.shift + Fraction(1, 2))
            damper = max(-d.force.max, min(damper, d.force.max))
            samples = (d.decimation - 1).bit_length()
            n = 0
            while bits(damper) + bits(coarse) - d.coarse.f + 1 + samples - n > bits(energy):
                n += 1
            part = math.copysign(1, damper) * (abs(damper) // 2**n)
        low, high = (0, d.force.max) if force > 0 else (-d.force.max, 0)
        out.append((int(max(low, min(force - part, high))) if force else 0, int(part != 0)))
        if energy > 0:
            energy = energy - math.ceil(Fraction(energy, 2**d.memory)) if force else 0
    return out


@pytest.mark.parametrize("name", ["paper", "mhz", "narrow", "wide", *AXES])
def test_model_is_its_words_in_exact_arithmetic(name):
    d = design(name)
    rows = list(stimulus(d, 10_000))
    assert model(d, rows)[0] == oracle(d, rows)


@pytest.mark.parametrize("name", ["paper", "mhz"])
def test_a_damper_that_is_halved_dissipates_less_than_twice_the_debt_and_a_share_of_it_at_least(name):
    d, random, ratios, rows = design(name), rng(), [], 50_000
    # The samples of an actuation count as a power of two; a part of a few LSB is what rounding leaves of it.
    share, rounding = d.decimation / (1 << (d.decimation - 1).bit_length()), 1 / 50
    words = zip(
        (-1 - magnitudes(random, 0, d.energy.max - 1, rows, d.energy.width)).tolist(),
        magnitudes(random, d.velocity.min, d.velocity.max, rows, d.velocity.width).tolist(),
        magnitudes(random, 0, d.damping.max, rows).tolist(),
        strict=True,
    )
    for energy, velocity, damping in words:
        speed = abs(velocity) * d.velocity.lsb
        part = abs(passivity.part_of(d.params({"passivity_damping": damping}), energy, velocity))
        if 50 < part < 0.45 * min(damping * 2.0**-d.damping.f * speed, d.force.max):
            ratios.append(2 * part * speed * d.decimation / -energy)
    assert len(ratios) > 100
    assert 1 / 4 * (1 - rounding) < min(ratios) / share < 1 / 3
    assert 3 / 2 < max(ratios) / share < 2 * (1 + rounding)


def test_an_ideal_spring_edge_by_edge_takes_and_gives_nothing_in_all():
    """Whatever the way, the energy depends on the last edge alone, as the potential of the spring does."""
    d, random = design("mhz"), rng()
    counts = np.cumsum(random.choice([-1, 0, 1], 5_000)).tolist()
    drives = [-37 * count for count in counts]
    at_edge: dict[int, set[int]] = {}
    within = passivity.MIDDLE
    found = energies(d.params({"passivity_damping": 0}), counts, drives)
    for before, count, energy in zip(counts[:-1], counts[1:], found[1:], strict=True):
        within = {0: within, 1: passivity.LOWER, -1: passivity.UPPER}[count - before]
        if within != passivity.MIDDLE:
            at_edge.setdefault(2 * count + within, set()).add(energy)
    assert len(at_edge) > 50
    assert all(len(found) == 1 for found in at_edge.values())


def test_in_float_the_debt_is_dissipated_until_the_next_actuation_exactly():
    d = design("paper")
    params = d.float_params(30.0)
    damping = 30.0 / d.words[0].si_per_unit
    state = passivity.FLOAT_START._replace(energy=-500.0)
    _, given, active = passivity.step(params, state, 0, 0, 2.0, 1000.0, 0.0)
    assert active
    assert 2.0 * (1000.0 - given) * 2.0 * d.decimation == pytest.approx(500.0)
    _, given, active = passivity.step(params, state._replace(energy=-1e9), 0, 0, 2.0, 1000.0, 0.0)
    assert given == 1000.0 - 2.0 * damping
    assert passivity.step(params, state, 0, 0, 0.0, 1000.0, 0.0)[1:] == (1000.0, 0)


@pytest.mark.parametrize("floating", [False, True])
def test_a_credit_is_forgotten_and_a_debt_is_not(floating):
    d = design("paper")
    params = d.float_params(0.0) if floating else d.params({"passivity_damping": 0})
    number = float if floating else int
    memory_samples = 1 << d.memory
    assert memory_samples == pytest.approx(passivity.MEMORY_S * 10e3, rel=0.5)
    for energy in (10**8, -(10**8)):
        state = (passivity.FLOAT_START if floating else passivity.START)._replace(energy=number(energy))
        for _ in range(memory_samples):
            state = passivity.step(params, state, 0, 0, number(0), number(1), number(0))[0]
        assert state.energy / energy == pytest.approx(math.exp(-1) if energy > 0 else 1, rel=1e-3)
        state = passivity.step(params, state, 0, 0, number(0), number(0), number(0))[0]
        assert state.energy == min(energy, 0)


def test_a_force_is_taken_to_zero_at_most_and_in_range():
    for name in ("paper", "narrow"):
        d = design(name)
        rows = list(stimulus(d, 5_000))
        for (*_, force), (given, active) in zip(rows, model(d, rows)[0], strict=True):
            assert -d.force.max <= given <= 0 if force < 0 else 0 <= given <= d.force.max
            assert active or given == force


def test_an_axis_says_whether_it_has_a_controller():
    axis = spec("paper")
    passive = dataclasses.replace(axis, passivity=True)
    assert "passivity" not in axis.facts
    assert passive.facts["passivity"] is True
    assert axis.design.passivity is None
    assert "passivity_damping" not in {word.name for word in axis.design.words}
    assert passive.design.latency_to_drive == axis.design.latency_to_drive + passivity.LATENCY
    assert passive.design.flags == (*axis.design.flags, "passivity_active")
    with pytest.raises(TypeError, match=r"^passivity must be a bool, not 1$"):
        dataclasses.replace(axis, passivity=1)
    with pytest.raises(ValueError, match=r"^passivity must be False: axes that share their logic"):
        AxesSpec(**NARROW, axes=2, estimator="fdm", passivity=True)


def test_a_wall_that_is_too_quick_for_the_controller_is_refused(monkeypatch):
    monkeypatch.setattr(wall.Design, "latency", 2)
    assert AxisSpec(**NARROW).design.wall.latency == 2
    with pytest.raises(ValueError, match=r"^wall must take 3 clocks or more before a passivity controller, not 2$"):
        AxisSpec(**NARROW, passivity=True)


@pytest.mark.parametrize("damping", [1e-5, 1e-7])
def test_a_velocity_of_one_bit_is_elaborated(damping):
    axis = dataclasses.replace(spec("mhz"), damping_max_n_s_per_m=damping)
    d = passivity.Design(axis, axis.design.estimator.velocity)
    assert d.coarse.width == 1
    assert "module" in to_verilog(Passivity(d), "passivity")


def test_wrong_design_is_refused():
    with pytest.raises(TypeError, match=r"not 3$"):
        Passivity(3)
