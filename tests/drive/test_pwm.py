"""The gates of an H-bridge: RTL against model at every clock, and what a bridge is promised, whatever is asked."""

from itertools import pairwise

import cocotb
import pytest

from hardwall.hdl.drive.pwm import Pwm
from hardwall.model.drive import pwm
from hardwall.model.drive.pwm import Design, Inputs
from hardwall.model.drive.stage import Amplifier
from hardwall.testing import SAMPLES, Recorded, check, parameters, play, simulate
from stimuli.lengths import some_of
from stimuli.stages import STAGES, axis, drives

NAMES = ["pwm", "pwm narrow"]
AMPLIFIER = Amplifier(unit="V", newtons_per_unit=2.0, full_scale=24.0)


def design(name: str) -> Design:
    return axis(name).drive


def make(name: str) -> Recorded:
    return Recorded(Pwm(design(name)))


def levels(name: str, columns) -> list[dict[str, int]]:
    """Return the pins after every edge for columns of inputs."""
    d, rows = design(name), []
    state = d.start
    seen = [list(columns(each)) for each in ("reset", "magnitude", "negative", "armed", "permitted")]
    for reset, size, negative, armed, may in zip(*seen[:4], [*seen[4][1:], 0], strict=True):
        state = d.start if reset else pwm.step(d.params, state, Inputs(size, negative, armed))
        rows.append(pwm.pins(d, state, may))
    return rows


def campaign(name: str, clocks: int) -> dict:
    d = design(name)
    return drives(d.magnitude.width, axis(name).force_limit_word, clocks, 2 * d.period)


@cocotb.test()
async def follows_model(dut):
    name = parameters()["name"]
    inputs, outputs = await play(dut, make(name), campaign(name, SAMPLES))
    rows = levels(name, inputs.column)
    expected = {pin: [row[pin] for row in rows] for pin in Design.pins}
    check(inputs, outputs, expected)
    assert all(set(seen) == {0, 1} for seen in expected.values())


@pytest.mark.parametrize("name", some_of(NAMES, 0))
def test_rtl(name):
    simulate(__file__, make, name=name)


@pytest.mark.parametrize("name", NAMES)
def test_no_leg_shoots_through_and_the_dead_time_is_kept_whatever_is_asked(name):
    columns, dead = campaign(name, 60_000), design(name).dead
    # Among the columns are resets of a single clock.
    rows = levels(name, columns.__getitem__)
    for leg in "ab":
        fell = {"high": -dead, "low": -dead}
        for clock, (before, now) in enumerate(pairwise(rows)):
            for side, other in (("high", "low"), ("low", "high")):
                assert not (now[f"gate_high_{leg}"] and now[f"gate_low_{leg}"])
                if before[f"gate_{side}_{leg}"] and not now[f"gate_{side}_{leg}"]:
                    fell[side] = clock
                if now[f"gate_{side}_{leg}"] and not before[f"gate_{side}_{leg}"]:
                    assert clock - fell[other] >= dead
    assert all(sum(row[pin] for row in rows) > 1000 for pin in Design.pins)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("negative", [0, 1])
def test_the_difference_of_the_legs_is_the_drive_in_every_period(name, negative):
    d, spec = design(name), axis(name)
    assert d.period == spec.clock_hz // STAGES[name][1].pwm_hz
    for size in {0, 1, spec.force_limit_word // 3, spec.force_limit_word - 1, spec.force_limit_word}:
        state, net, dead_clocks = d.start, [], 0
        for clock in range(d.latency + 6 * d.period):
            state = pwm.step(d.params, state, Inputs(size, negative, 1))
            pins = pwm.pins(d, state, 1)
            if clock >= d.latency:
                up, down = pins["gate_high_a"] & pins["gate_low_b"], pins["gate_high_b"] & pins["gate_low_a"]
                net.append(up - down)
                dead_clocks += not (pins["gate_high_a"] | pins["gate_low_a"])
        newtons = sum(net) / len(net) * d.full_scale_n
        wanted = size * spec.force_resolution_n * (-1 if negative else 1)
        assert abs(newtons - wanted) <= d.step_n * 5 / 8 + 1e-9
        # Half of the periods has half of it.
        assert sum(net[: 3 * d.period]) * 2 == sum(net)
        if sum(net) == 0:
            assert (pins["gate_low_a"], pins["gate_low_b"]) == (1, 1), "zero while ARMED is a brake"
        elif not negative:
            assert dead_clocks == 6 * 2 * d.dead


@pytest.mark.parametrize("name", NAMES)
def test_the_gates_are_off_one_clock_after_the_axis_is_not_armed_and_at_once_without_permission(name):
    d = design(name)
    armed, on = d.start, 0
    for _ in range(d.latency + 2 * d.period):
        armed = pwm.step(d.params, armed, Inputs(d.magnitude.max // 2, 0, 1))
        on += any(pwm.pins(d, armed, 1).values())
        assert not any(pwm.pins(d, armed, 0).values())
        # From here it is not ARMED.
        off = pwm.step(d.params, armed, Inputs(d.magnitude.max // 2, 0, 0))
        assert not any(pwm.pins(d, off, 1).values())
    assert on > d.period


@pytest.mark.parametrize("name", NAMES)
def test_a_drive_comes_at_the_latest_when_the_latency_says(name):
    d, waits = design(name), []
    rest = d.start
    for _ in range(2 * d.period):
        rest = pwm.step(d.params, rest, Inputs(0, 0, 1))
    for _ in range(d.period):
        rest = state = pwm.step(d.params, rest, Inputs(0, 0, 1))
        clocks = 0
        while not state.a.high:
            state, clocks = pwm.step(d.params, state, Inputs(d.magnitude.max, 0, 1)), clocks + 1
        waits.append(clocks)
    assert max(waits) == d.latency
    assert min(waits) == d.latency - d.period + 1


def wrong(**fields) -> pwm.Stage:
    return pwm.Stage(**{"amplifier": AMPLIFIER, "pwm_hz": 200_000, "dead_time_s": 100e-9} | fields)


@pytest.mark.parametrize(
    ("stage", "message"),
    [
        (
            wrong(pwm_hz=300_000),
            r"^stage.pwm_hz must be clock_hz 50000000 divided by a whole number from 8, not 300000$",
        ),
        (wrong(pwm_hz=10_000_000), r"^stage.pwm_hz must be .*, not 10000000$"),
        (
            wrong(dead_time_s=2e-6),
            r"^stage.dead_time_s must be less than a third of the 250 clocks .*, not 100 clocks$",
        ),
        (wrong(dead_time_s=0.0), r"^stage.dead_time_s must be 1e-09 to 0.001, not 0.0$"),
        (wrong(dead_time_s=1e-6), r"^force_max_n must be at most 19.2 N, all that the drive stage gives, not 40.0$"),
        (
            wrong(amplifier=Amplifier(unit="V", newtons_per_unit=2.0, full_scale=24.0, offset=1.0)),
            r"^stage.offset must be 0 with a bridge, not 1.0$",
        ),
    ],
)
def test_stages_that_do_not_fit_are_refused(stage, message):
    with pytest.raises(ValueError, match=message):
        Design(axis("pdm"), stage)


@pytest.mark.parametrize(("dead_time_s", "clocks"), [(100e-9, 5), (101e-9, 6), (1e-9, 1), (3 * 20e-9, 3)])
def test_the_dead_time_is_rounded_up_to_clocks(dead_time_s, clocks):
    assert Design(axis("pdm"), wrong(dead_time_s=dead_time_s)).dead == clocks


def test_wrong_designs_are_refused():
    with pytest.raises(TypeError, match=r"not 3$"):
        Pwm(3)
    with pytest.raises(TypeError, match=r"^stage must be a pwm.Stage, not 3$"):
        Design(axis("pdm"), 3)
