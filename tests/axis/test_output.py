"""The output stage: RTL against model, and its promises about limits and zero."""

import cocotb
import numpy as np
import pytest
from amaranth.hdl import Module, Signal
from amaranth.lib import wiring
from cocotb.triggers import RisingEdge

from hardwall.hdl.axis.output import Output
from hardwall.model.axis import output
from hardwall.testing import CAMPAIGN, SAMPLES, Bench, check, parameters, rng, simulate
from stimuli.lengths import some_of
from stimuli.magnitudes import magnitudes
from stimuli.specs import spec

NAMES = ("output_force_limit", "output_slew_limit")


def design(name: str) -> output.Design:
    return spec(name).design.output


class Limited(wiring.Component):
    """An output stage whose limits are at its pins when it takes them, with the `strobe` of this component.

    The stage has its strobe `design.ahead` clocks later, and the force and the fault of then.
    """

    def __init__(self, design: output.Design):
        self.design, self._stage = design, Output(design)
        super().__init__(dict(self._stage.signature.members))

    @property
    def latency(self) -> int:
        return self.design.ahead + self._stage.latency

    def elaborate(self, platform) -> Module:
        m = Module()
        m.submodules.stage = stage = self._stage
        late = ("strobe", "force", "fault")
        for name, member in self.signature.members.items():
            mine, its = getattr(self, name), getattr(stage, name)
            for clock in range(self.design.ahead if name in late else 0):
                now, mine = mine, Signal.like(mine, name=f"{name}_{clock}")
                m.d.sync += mine.eq(now)
            m.d.comb += its.eq(mine) if member.flow == wiring.In else mine.eq(its)
        return m


def make(name: str) -> Limited:
    return Limited(design(name))


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


def model(d: output.Design, rows, state: output.State = output.START) -> tuple[dict[str, np.ndarray], output.State]:
    """Return drive, flags and actuation for rows of `stimulus`, and the state behind them."""
    out = []
    for force, fault, *words in rows:
        actuated = state.phase == 0
        state, flags = output.step(d.params(dict(zip(NAMES, words, strict=True))), state, force, not fault)
        out.append((state.drive, flags, actuated))
    return dict(zip(("drive", "limited", "actuated"), np.array(out).T, strict=True)), state


@cocotb.test(**CAMPAIGN)
async def follows_model(dut):
    component = make(**parameters())
    bench = Bench(dut, component)
    await bench.reset()
    bench.drive(enable=1)
    names, interval = ("force", "fault", *NAMES), component.design.interval
    gaps = range(interval, interval + 6, 2)
    state = output.START
    for every in gaps:
        rows = stimulus(component.design, SAMPLES // len(gaps))
        inputs, outputs = await bench.campaign(
            "strobe", "valid", names, ("drive", "limited", "actuated"), rows, every=every, momentary=names
        )
        expected, state = model(component.design, inputs.rows, state)
        assert set(expected["limited"].tolist()) == {0, 1, 2, 3}
        check(inputs, outputs, expected, component.latency)


def random_clocks(d: output.Design, clocks: int):
    """Yield inputs by name: strobes `d.interval` clocks apart or more, an enable that drops at times, and limits."""
    random, wait = rng(), 0
    words = {word.name: word.format.max for word in d.words}
    for _ in range(clocks):
        wait = wait - 1 if wait else d.interval - 1 + int(random.integers(0, 4))
        if random.random() < 0.1:
            most = d.force_limit // int(2 ** random.integers(0, 3))
            words = {word.name: int(random.integers(0, most + 1)) for word in d.words}
        force, fault, low = int(random.integers(d.force.min, d.force.max + 1)), random.random(), random.random()
        yield {"strobe": int(wait == 0), "force": force, "fault": int(fault < 0.05), "enable": int(low > 0.1), **words}


@cocotb.test()
async def enable_low_is_zero_at_the_next_clock_and_slewing_starts_from_there(dut):
    d, ahead, bench = design(**parameters()), output.AHEAD, Bench(dut, make(**parameters()))
    await bench.reset()
    drive, limited = bench.reader("drive"), bench.reader("limited")
    zero = {"strobe": 0, "force": 0, "fault": 0, "enable": 0, **{word.name: word.reset for word in d.words}}
    past, state, expected = [zero] * ahead, output.START, None
    # By the clocks from an enable that was low to a strobe, how often the drive has grown from zero there.
    since, begun = 99, dict.fromkeys(range(1, 6), 0)
    for now in random_clocks(d, 20_000):
        bench.drive(**now)
        await RisingEdge(dut.clk)
        if expected:
            assert (drive(), int(dut.valid.value), int(dut.actuated.value)) == expected[:3]
            assert not expected[1] or limited() == expected[3]
        taken, past = past[0], [*past[1:], now]
        actuated, flags = taken["strobe"] and state.phase == 0, 0
        if taken["strobe"]:
            params = d.params({name: taken[name] for name in NAMES})
            state, flags = output.step(params, state, taken["force"], now["enable"] and not taken["fault"])
            if flags & 1 and since in begun:
                begun[since] += 1
        since = since + 1 if now["enable"] else 1
        if not now["enable"]:
            state = state._replace(drive=0)
        expected = state.drive, taken["strobe"], int(actuated), flags
    assert all(begun.values()), begun


@cocotb.test()
async def actuated_is_high_at_its_valid_alone(dut):
    component = make(**parameters())
    bench, d = Bench(dut, component), component.design
    pairs = []
    await bench.reset()
    for _ in range(2 * d.decimation):
        bench.drive(strobe=1, enable=1)
        for _ in range(component.latency + 2):
            await RisingEdge(dut.clk)
            bench.drive(strobe=0)
            pairs.append((int(dut.valid.value), int(dut.actuated.value)))
    assert pairs.count((1, 1)) == 2
    assert pairs.count((1, 0)) == 2 * d.decimation - 2
    assert (0, 1) not in pairs


@pytest.mark.parametrize("name", some_of(["paper", "mhz", "narrow"], 2))
def test_rtl(name):
    simulate(__file__, make, name=name)


@pytest.mark.parametrize("name", ["paper", "mhz", "narrow"])
def test_the_drive_never_exceeds_its_limits(name):
    d = design(name)
    rows = list(stimulus(d, 20_000))
    drive = model(d, rows)[0]["drive"].tolist()
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
