"""The virtual mass: RTL against model, model against exact rationals, and what it promises of its sum."""

import dataclasses
import itertools
import math
from fractions import Fraction

import cocotb
import numpy as np
import pytest
from cocotb.triggers import RisingEdge

from hardwall.hdl.axis.virtual_mass import VirtualMass
from hardwall.model.axes.axis import AxesSpec
from hardwall.model.axis import virtual_mass
from hardwall.model.axis.axis import Axis
from hardwall.model.axis.virtual_mass import FIELD
from hardwall.model.estimators.acceleration import Accelerated
from hardwall.model.estimators.registry import ESTIMATORS
from hardwall.model.spec import AxisSpec
from hardwall.testing import CAMPAIGN, SAMPLES, Bench, check, parameters, rng, simulate
from stimuli.borne import Borne
from stimuli.lengths import LONG, some_of
from stimuli.magnitudes import magnitudes
from stimuli.specs import spec

NAMES = "acceleration", "wall_mass", "free_mass", "may_be_positive", "may_be_negative", "force"
ACCELERATED = [name for name, kind in ESTIMATORS.items() if issubclass(kind, Accelerated)]
SIZES = [
    ("mhz", "kalman", 0.25, 2),
    ("paper", "levant-2", 0.06, 5),
    ("narrow", "levant-3-implicit", 10.0, 3),
    ("wide", "edge-kalman", 1e-6, 2),
    ("mhz", "edge-kalman", 1e7, 3),
]
"""Axis, estimator, the largest mass (kg; the last two make the format of the product extreme), clocks to the force."""


def design(name: str, estimator: str, most_kg: float) -> virtual_mass.Design:
    return dataclasses.replace(spec(name, estimator), virtual_mass_max_kg=most_kg).design.mass


def make(name: str, estimator: str, most_kg: float, behind: int) -> Borne:
    return Borne(design(name, estimator, most_kg), behind)


def stimulus(d: virtual_mass.Design, samples: int):
    """Yield rows of NAMES: extremes of all together, sums beside a tie and beside zero, and words of all sizes."""
    a, m, f = d.acceleration, d.mass, d.force
    extremes = (
        (a.min, a.min + 1, -1, 0, 1, a.max), (m.min, -d.most - 1, -d.most, -1, 0, 1, d.most, d.most + 1, m.max),
        (m.min, 0, m.max), (0, 1), (0, 1), (f.min, -f.max, -1, 0, 1, f.max),
    )  # fmt: skip
    yield from itertools.product(*extremes)
    random = rng()
    columns = (
        magnitudes(random, a.min, a.max, samples, a.width),
        magnitudes(random, m.min, m.max, samples, m.width),
        magnitudes(random, m.min, m.max, samples, m.width),
        *random.integers(0, 2, (2, samples)),
        np.where(random.random(samples) < 0.3, 0, magnitudes(random, f.min, f.max, samples, f.width)),
    )
    for row in zip(*(column.tolist() for column in columns), strict=True):
        yield row
        # The same in free space, with either mass; and where the sum is a few LSB from zero.
        yield *row[:3], 0, 0, 0
        yield row[0], row[2], row[1], 0, 0, 0
        near = math.floor(Fraction(row[1] * (row[0] >> a.f - d.coarse.f)) / Fraction(2) ** d.shift)
        if 0 < abs(near) <= f.max - 4:
            yield *row[:5], near + int(random.integers(-3, 4))


def model(d: virtual_mass.Design, rows) -> list[int]:
    given = []
    for acceleration, wall_mass, free_mass, positive, negative, force in rows:
        params = d.params({"wall_mass": wall_mass, "free_mass": free_mass})
        given.append(virtual_mass.weighed(params, acceleration, force, positive, negative))
    return given


@cocotb.test(**CAMPAIGN)
async def follows_model(dut):
    component = make(**parameters())
    d, bench = component.design, Bench(dut, component)
    await bench.reset()
    gaps = range(component.behind, component.latency + 2, 2)
    for every in gaps:
        rows = stimulus(d, SAMPLES // len(gaps))
        inputs, outputs = await bench.campaign("strobe", "valid", NAMES, ("given",), rows, every=every, momentary=NAMES)
        expected = model(d, inputs.rows)
        assert {-d.force.max, 0, d.force.max} <= set(expected)
        check(inputs, outputs, {"given": np.array(expected)}, component.latency)


@cocotb.test()
async def the_force_is_0_after_reset_and_constant_from_one_valid_to_the_next(dut):
    component = make(**parameters())
    d, bench, before = component.design, Bench(dut, component), 0
    await bench.reset()
    given = bench.reader("given")
    for row in (
        (d.acceleration.max, d.most, 0, 1, 1, 1),
        (d.acceleration.min, 0, d.most, 0, 0, 0),
        (0, 0, 0, 1, 0, d.force.max),
    ):
        bench.drive(**dict(zip(NAMES, row, strict=True)), strobe=1)
        for clock in range(component.latency + 3):
            await RisingEdge(dut.clk)
            bench.drive(strobe=0)
            assert given() == before, f"the force changed {clock} clocks after the strobe"
            if clock == component.latency - 1:
                (before,) = model(d, [row])
        assert before


@pytest.mark.parametrize(("name", "estimator", "most_kg", "behind"), some_of(SIZES, 1))
def test_rtl(name, estimator, most_kg, behind):
    simulate(__file__, make, name=name, estimator=estimator, most_kg=most_kg, behind=behind)


def oracle(d: virtual_mass.Design, row: tuple[int, ...]) -> int:
    """Return the force that is given on, by the module's words, in exact rationals."""
    acceleration, wall_mass, free_mass, positive, negative, force = row
    inside = positive or negative
    mass = max(-d.most, min(wall_mass if inside else free_mass, d.most))
    coarse = math.floor(Fraction(acceleration, 2**d.acceleration.f) * Fraction(2) ** d.coarse.f)
    inertia = math.floor(Fraction(mass) * coarse / Fraction(2) ** d.shift + Fraction(1, 2))
    total = max(-d.force.max, min(force - inertia, d.force.max))
    return 0 if inside and not (negative if total < 0 else positive) else total


@pytest.mark.parametrize(("name", "estimator", "most_kg", "behind"), SIZES)
def test_model_is_its_words_in_exact_arithmetic(name, estimator, most_kg, behind):
    d = design(name, estimator, most_kg)
    rows = list(stimulus(d, 10_000))
    assert model(d, rows) == [oracle(d, row) for row in rows]


@pytest.mark.parametrize(("name", "estimator", "most_kg", "behind"), SIZES[:4])
def test_fixed_point_is_within_a_force_lsb_of_float(name, estimator, most_kg, behind):
    d, compared = design(name, estimator, most_kg), 0
    unit_kg = d.words[0].si_per_unit * d.mass.lsb
    for row in stimulus(d, 5_000):
        acceleration, wall_mass, free_mass, positive, negative, force = row
        if max(abs(wall_mass), abs(free_mass)) > d.most:
            continue
        exact = d.float_params(wall_mass * unit_kg, free_mass * unit_kg)
        given = virtual_mass.weighed(exact, acceleration * d.acceleration.lsb, float(force), positive, negative)
        assert abs(model(d, [row])[0] - given) <= 1 + 1e-9 * d.force.max
        compared += 1
    assert compared > 5_000


@pytest.mark.parametrize("estimator", ACCELERATED if LONG else ["kalman", "levant-2", "edge-kalman"])
def test_no_mass_is_no_change(estimator):
    """An axis with both masses at 0 is the axis without the block, but for its latency."""
    counts = np.cumsum(rng().integers(-1, 2, 5_000))
    axis = spec("mhz", estimator)
    borne = dataclasses.replace(axis, virtual_mass_max_kg=0.1)
    assert borne.design.latency_to_drive == axis.design.latency_to_drive + VirtualMass(borne.design.mass).latency
    if axis.design.estimator.uses_stamps():
        return
    wanted, found = (Axis(each, wall_stiffness=5e3, wall_damping=9.0).run(counts) for each in (axis, borne))
    assert np.array_equal(wanted.drive, found.drive)
    assert (wanted.drive != 0).any()


@pytest.mark.parametrize("floating", [False, True])
@pytest.mark.parametrize("side", [1, -1])
def test_a_wall_that_may_not_pull_does_not_pull_by_a_mass(side, floating):
    """Also where its damper takes the spring's force to 0, and free space would have another mass."""
    axis = dataclasses.replace(spec("mhz", "kalman"), virtual_mass_max_kg=0.3)
    seconds = np.arange(300_000) / axis.sample_hz
    counts = side * np.round(2e-3 / axis.count_m * np.sin(2 * np.pi * 5 * seconds)).astype(int)
    wall = {"wall_stiffness": 200.0, "wall_damping": 20.0, "wall_left": int(side < 0), "wall_forbid_pull": 1}
    inside = side * counts > 0
    for masses in ({"free_mass": 0.3}, {"free_mass": -0.3, "wall_mass": 0.3}, {"wall_mass": -0.3}):
        record = Axis(axis, floating, **wall, **masses).run(counts)
        assert (side * record.drive[inside] <= 0).all()
        assert (record.drive[inside] != 0).any()
        assert (record.force[inside] == 0).any()


@pytest.mark.parametrize("floating", [False, True])
def test_a_mass_is_newtons_second_law(floating):
    """At a constant acceleration the drive is -M a, in free space as in a wall; both signs of M."""
    axis = dataclasses.replace(spec("mhz", "kalman"), virtual_mass_max_kg=0.3)
    seconds = np.arange(200_000) / axis.sample_hz
    acceleration = 8.0
    counts = np.floor(acceleration * seconds**2 / 2 / axis.count_m).astype(int)
    for mass in (0.25, -0.25):
        record = Axis(axis, floating, free_mass=mass).run(counts)
        mean = record.acceleration_m_per_s2[-50_000:].mean()
        assert mean == pytest.approx(acceleration, rel=0.02)
        inertia = mass * record.acceleration_m_per_s2[-1]
        assert record.drive_n[-1] == pytest.approx(-inertia, abs=2 * axis.force_resolution_n)
        inside = {"wall_stiffness": 100.0, "wall_position": -0.01}
        bare, borne = (Axis(axis, floating, wall_mass=each, **inside).run(counts).drive_n[-1] for each in (0.0, mass))
        assert borne - bare == pytest.approx(-inertia, abs=2 * axis.force_resolution_n)


def test_a_word_beyond_the_bound_acts_as_the_bound():
    d = design("mhz", "kalman", 0.25)
    assert d.words[0].si_max == pytest.approx(0.25, rel=2**-15)
    for most_kg in (0.05, 0.1, 0.25, 1 / 3, 1e-4):
        bounded = design("mhz", "kalman", most_kg)
        for sign in (1, -1):
            assert bounded.most - sign * bounded.words[0].from_si(sign * most_kg) in (0, 1)
    for sign in (1, -1):
        rows = [(d.acceleration.max // 9, 0, sign * most, 0, 0, 0) for most in (d.most, d.most + 1, d.mass.max)]
        assert len(set(model(d, rows))) == 1


@pytest.mark.parametrize(
    ("most_kg", "estimator", "error", "message"),
    [
        (0.1, "fdm", ValueError, r"virtual_mass_max_kg needs an estimator with an acceleration \(kalman, .*, not fdm"),
        (0.0, "kalman", ValueError, r"virtual_mass_max_kg must be 1e-30 to 1e\+30, not 0\.0"),
        (math.nan, "kalman", ValueError, r"virtual_mass_max_kg must be 1e-30 to 1e\+30, not nan"),
        (1e-28, "kalman", ValueError, r"virtual_mass_max_kg must be at least 4\.\d+e-22 beside the force's resolution"),
        (1e25, "kalman", ValueError, r"virtual_mass_max_kg must be at most 4\.\d+e\+09 beside the resolution of force"),
        (True, "kalman", TypeError, r"virtual_mass_max_kg must be a number, not True"),
        ("1", "kalman", TypeError, r"virtual_mass_max_kg must be a number, not '1'"),
    ],
)
def test_what_cannot_be_is_refused(most_kg, estimator, error, message):
    with pytest.raises(error, match=message):
        _ = dataclasses.replace(spec("mhz", estimator), virtual_mass_max_kg=most_kg).design


def test_named_bounds_are_accepted():
    for wrong in (1e-28, 1e25):
        with pytest.raises(ValueError, match=FIELD) as refused:
            _ = dataclasses.replace(spec("mhz", "kalman"), virtual_mass_max_kg=wrong).design
        bound = float(str(refused.value).split(" beside")[0].rpartition(" ")[2])
        for inside in (bound * (1.01 if wrong < 1 else 0.99),):
            assert dataclasses.replace(spec("mhz", "kalman"), virtual_mass_max_kg=inside).design.mass.most > 0


def test_axes_that_share_their_logic_refuse_one():
    fields = {field.name: getattr(spec("mhz"), field.name) for field in dataclasses.fields(AxisSpec)}
    with pytest.raises(ValueError, match="virtual_mass_max_kg must be None: axes that share their logic have no"):
        AxesSpec(**{**fields, FIELD: 0.1, "axes": 2, "gains": None} | {"estimator": "fdm"}) if fields.pop(
            "stage"
        ) else 0


def test_wrong_design_is_refused():
    with pytest.raises(TypeError, match=r"design must be a virtual_mass\.Design, not 3"):
        VirtualMass(3)
