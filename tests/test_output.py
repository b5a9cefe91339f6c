"""The output stage: RTL against model, and its promises about limits and zero."""

import cocotb
import numpy as np
import pytest
from cocotb.triggers import ClockCycles, RisingEdge

from hardwall.hdl.output import Output
from hardwall.model import output
from hardwall.testing import CAMPAIGN, SAMPLES, Bench, check, parameters, rng, simulate
from stimuli.magnitudes import magnitudes
from stimuli.specs import spec

NAMES = ("output_force_limit", "output_slew_limit")


def design(name: str) -> output.Design:
    return spec(name).design.output


def make(name: str) -> Output:
    return Output(design(name))


def stimulus(d: output.Design, samples: int):
    """Yield (force, fault, force limit, slew limit): extremes in long and short runs, then random values."""
    top, limits = d.force.max, [word.format.max for word in d.words]
    for limit in (0, 1, limits[0]):
        for slew in (0, 1, limits[1] // 3, limits[1]):
            for force in (d.force.min, top, -1, 0, 1, top, d.force.min):
                for _ in range(2 * d.decimation):
                    yield force, 0, limit, slew
    # Stairs, whose steps are only limited in their growth, up to the largest drive.
    for steps in (7, 29):
        for force in (d.force.min, top):
            for _ in range((steps + 1) * d.decimation):
                yield force, 0, limits[0], d.force_limit // steps
    random, length = rng(), 50
    # Forces that a limit just holds, or just lets pass.
    for limit in (
        *magnitudes(random, 0, d.force_limit, 50).tolist(),
        *random.integers(0, d.force_limit + 1, 50).tolist(),
    ):
        for beyond in range(-3, 4):
            force = min(max(limit + beyond, 0), top) * int(random.choice((-1, 1)))
            for _ in range(d.decimation):
                yield force, 0, limit, limits[1]
    force = magnitudes(random, d.force.min, top, samples)
    fault = (random.random(samples) < 0.02).astype(np.int64)
    words = (magnitudes(random, 0, most, -(-samples // length)).repeat(length)[:samples] for most in limits)
    yield from zip(*(column.tolist() for column in (force, fault, *words)), strict=True)


def model(d: output.Design, rows) -> dict[str, np.ndarray]:
    """Return drive, flags and actuation for rows of `stimulus`."""
    state, out = output.START, []
    for force, fault, *words in rows:
        actuated = state.phase == 0
        state, flags = output.step(d.params(dict(zip(NAMES, words, strict=True))), state, force, not fault)
        out.append((state.drive, flags, actuated))
    return dict(zip(("drive", "limited", "actuated"), np.array(out).T, strict=True))


@cocotb.test(**CAMPAIGN)
async def follows_model(dut):
    component = make(**parameters())
    bench = Bench(dut, component)
    await bench.reset()
    bench.drive(enable=1)
    names, rows = ("force", "fault", *NAMES), stimulus(component.design, SAMPLES)
    inputs, outputs = await bench.campaign(
        "strobe", "valid", names, ("drive", "limited", "actuated"), rows, momentary=("force", "fault")
    )
    expected = model(component.design, inputs.rows)
    assert set(expected["limited"].tolist()) == {0, 1, 2, 3}
    check(inputs, outputs, expected, component.latency)


@cocotb.test()
async def enable_low_is_zero_at_the_next_clock(dut):
    d = design(**parameters())
    bench = Bench(dut, make(**parameters()))
    await bench.reset()
    words = {word.name: word.reset for word in d.words}
    drive = bench.reader("drive")
    for clock in range(output.LATENCY + 2):
        bench.drive(enable=1)
        # Actuate until the drive is there, then let one strobe enter the pipeline and pull enable low behind it.
        for _ in range(d.decimation):
            await bench.transact("strobe", "valid", force=5, **words)
        assert drive() == 5
        bench.drive(strobe=1)
        for _ in range(clock):
            await RisingEdge(dut.clk)
            bench.drive(strobe=0)
        bench.drive(enable=0)
        await RisingEdge(dut.clk)
        bench.drive(enable=1, strobe=0)
        for _ in range(output.LATENCY + 3):
            await RisingEdge(dut.clk)
            # The actuation that was in the pipeline does not bring the old force back.
            assert drive() == 0
        bench.drive(enable=0)
        await ClockCycles(dut.clk, 2)
        # Go back to phase 0, with enable low throughout.
        while True:
            await bench.transact("strobe", "valid", force=5, **words)
            assert drive() == 0
            if int(dut.actuated.value) and d.decimation == 1:
                break
            if d.decimation > 1 and int(dut.actuated.value):
                for _ in range(d.decimation - 1):
                    await bench.transact("strobe", "valid", force=5, **words)
                break


@cocotb.test()
async def actuated_is_high_at_its_valid_alone(dut):
    bench = Bench(dut, make(**parameters()))
    d = design(**parameters())
    pairs = []
    await bench.reset()
    for _ in range(2 * d.decimation):
        bench.drive(strobe=1, enable=1)
        for _ in range(output.LATENCY + 2):
            await RisingEdge(dut.clk)
            bench.drive(strobe=0)
            pairs.append((int(dut.valid.value), int(dut.actuated.value)))
    assert pairs.count((1, 1)) == 2
    assert pairs.count((1, 0)) == 2 * d.decimation - 2
    assert (0, 1) not in pairs


@pytest.mark.parametrize("name", ["paper", "mhz", "narrow"])
def test_rtl(name):
    simulate(__file__, make, name=name)


@pytest.mark.parametrize("name", ["paper", "mhz", "narrow"])
def test_the_drive_never_exceeds_its_limits(name):
    d = design(name)
    rows = list(stimulus(d, 20_000))
    drive = model(d, rows)["drive"].tolist()
    before = 0
    for k, (value, (force, fault, limit, slew)) in enumerate(zip(drive, rows, strict=True)):
        if fault:
            assert value == 0
        elif k % d.decimation:
            assert value == before
        else:
            limit = min(limit, d.force_limit)  # noqa: PLW2901
            assert abs(value) <= limit
            # The drive grows from its present value or from zero, and to a smaller force it goes at once.
            assert min(before, 0) - slew <= value <= max(before, 0) + slew
            if min(before, 0) <= force <= max(before, 0):
                assert value == max(-limit, min(force, limit))
        before = value


def test_wrong_design_is_refused():
    with pytest.raises(TypeError, match=r"not 3$"):
        Output(3)
