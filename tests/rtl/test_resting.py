"""What may run while all else rests: what the check of a netlist refuses, and clocks that are skipped and evaluated."""

from collections.abc import Callable
from contextlib import ExitStack

import numpy as np
import pytest
from amaranth.hdl import Cat, Module, Mux, Signal
from amaranth.lib import wiring
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In, Out

from hardwall.hdl.axis.axis import Axis
from hardwall.hdl.export import to_netlist
from hardwall.model.axis.axis import Axis as Model
from hardwall.model.encoder.quadrature import latency
from hardwall.model.estimators import registry
from hardwall.sim.rtl import library
from hardwall.sim.rtl.c_function import call
from hardwall.sim.rtl.library import Hardware
from hardwall.sim.rtl.resting import Counter, Resting, RestsNotError, check
from hardwall.sim.scene.load import load
from hardwall.testing import rng
from stimuli.lengths import LONG
from stimuli.specs import spec

SKIPPING = tuple(registry.ESTIMATORS) if LONG else ("levant-edge",)
SLACK = (0, 3, 4, 5, 200) if LONG else (0, 200)
"""Clocks a sample beyond those of the way to the drive: with the fewest nothing rests after the first sample."""
STOP = 9
Describe = Callable[[Module, "Clockwork"], None]


class Clockwork(wiring.Component):
    """A divider with a stop, a stamp without, a latch of the stamp, and what `describe` adds."""

    def __init__(self, describe: Describe = lambda m, clockwork: None):
        self._describe = describe
        super().__init__({"edge": In(1), "word": In(8), "seen": Out(8), "other": Out(8)})
        self.divider = Signal(4)
        self.stamp = Signal(8)
        self.strobe = Signal()

    def elaborate(self, platform):
        m = Module()
        m.d.comb += self.strobe.eq(self.divider == STOP)
        m.d.sync += [self.divider.eq(Mux(self.strobe, 0, self.divider + 1)), self.stamp.eq(self.stamp + 1)]
        with m.If(self.edge):
            m.d.sync += self.seen.eq(self.stamp)
        self._describe(m, self)
        return m


def resting(describe: Describe = lambda m, clockwork: None, shown: str = "seen") -> Resting:
    return check(to_netlist(Clockwork(describe), "top"), (shown,), ("divider", "stamp"))


def counters(describe: Describe = lambda m, clockwork: None) -> tuple[Counter, ...]:
    return resting(describe).counters


def allowed_latch_of_some_bits(m, c):
    """The lowest bit is there, so the register differs from clock to clock while it follows."""
    with m.If(c.strobe & c.edge):
        m.d.sync += c.other.eq(Cat(c.stamp[:3], c.word[:2]))


def allowed_way_among_others(m, c):
    with m.If(c.word[0]):
        m.d.sync += c.other.eq(Mux(c.edge, c.stamp, c.word))
    with m.Elif(c.strobe):
        m.d.sync += c.other.eq(c.other + 1)


def allowed_reset_of_a_counter(m, c):
    with m.If(c.edge):
        m.d.sync += c.stamp.eq(c.word)


def allowed_counter_that_may_stand(m, c):
    with m.If(c.edge):
        m.d.sync += c.stamp.eq(c.stamp)


def allowed_memory_of_stamps(m, c):
    m.submodules.memory = memory = Memory(shape=8, depth=4, init=[])
    write = memory.write_port()
    m.d.comb += [write.en.eq(c.edge), write.addr.eq(c.word), write.data.eq(c.stamp)]


@pytest.mark.parametrize(
    "describe",
    [
        lambda m, c: None,
        allowed_latch_of_some_bits,
        allowed_way_among_others,
        allowed_reset_of_a_counter,
        allowed_counter_that_may_stand,
        allowed_memory_of_stamps,
    ],
)
def test_counters_that_only_stop_and_are_latched_may_run(describe):
    found = counters(describe)
    assert {(counter.names[-1], counter.width, counter.stops) for counter in found} == {
        ("divider", 4, (STOP,)),
        ("stamp", 8, ()),
    }


def test_every_value_at_which_a_counter_is_compared_is_a_stop():
    def compared(m, c):
        m.d.sync += c.other.eq(Cat(c.stamp == 3, c.stamp != 200, c.divider == STOP))

    assert set(counters(compared)) == {Counter(("divider",), 4, (STOP,)), Counter(("stamp",), 8, (3, 200))}


def bug_latch_without_the_lowest_bit(m, c):
    with m.If(c.edge):
        m.d.sync += c.other.eq(c.stamp[1:])


def bug_sum(m, c):
    with m.If(c.edge):
        m.d.sync += c.other.eq(c.stamp + c.word)


def bug_order(m, c):
    m.d.sync += c.other.eq(c.divider < STOP)


def bug_bit_that_decides(m, c):
    with m.If(c.stamp[4]):
        m.d.sync += c.other.eq(c.word)


def bug_case(m, c):
    with m.Switch(c.divider), m.Case(3, 4):
        m.d.sync += c.other.eq(c.word)


def bug_multiplexer(m, c):
    m.d.sync += c.other.eq(Mux(c.divider[0], c.word, c.other))


def bug_place_in_a_memory(m, c):
    m.submodules.memory = memory = Memory(shape=8, depth=4, init=[])
    write = memory.write_port()
    m.d.comb += [write.en.eq(c.edge), write.addr.eq(c.stamp), write.data.eq(c.word)]


def bug_permission_of_a_memory(m, c):
    m.submodules.memory = memory = Memory(shape=8, depth=4, init=[])
    write = memory.write_port()
    m.d.comb += [write.en.eq(c.divider[2]), write.addr.eq(c.word), write.data.eq(c.word)]


def bug_part_of_a_memory(m, c):
    m.submodules.memory = memory = Memory(shape=8, depth=4, init=[])
    write = memory.write_port()
    m.d.comb += [write.en.eq(c.edge), write.addr.eq(c.word), write.data.eq(c.stamp >> 2)]


def bug_place_that_is_read(m, c):
    m.submodules.memory = memory = Memory(shape=8, depth=4, init=[])
    read = memory.read_port()
    m.d.comb += [read.en.eq(c.edge), read.addr.eq(c.divider)]
    m.d.sync += c.other.eq(read.data)


def bug_output(m, c):
    m.d.comb += c.other.eq(c.stamp)


def bug_two_at_a_time(m, c):
    with m.If(c.edge):
        m.d.sync += c.stamp.eq(c.stamp + 2)


def bug_downwards(m, c):
    with m.If(c.edge):
        m.d.sync += c.stamp.eq(c.stamp - 1)


def bug_counter_that_follows_another(m, c):
    with m.If(c.edge):
        m.d.sync += c.stamp.eq(c.divider)


def bug_counter_that_decides_of_another(m, c):
    with m.If(c.divider[1]):
        m.d.sync += c.stamp.eq(0)


@pytest.mark.parametrize(
    ("describe", "why"),
    [
        (bug_latch_without_the_lowest_bit, "other takes what is computed from a counter"),
        (bug_sum, "other takes what is computed from a counter"),
        (bug_order, "other takes what is computed from a counter"),
        (bug_bit_that_decides, "what other takes depends on a counter"),
        (bug_case, "what other takes depends on a counter"),
        (bug_multiplexer, "what other takes depends on a counter"),
        (bug_place_in_a_memory, "memory depends on a counter"),
        (bug_permission_of_a_memory, "memory depends on a counter"),
        (bug_part_of_a_memory, "memory takes what is computed from a counter"),
        (bug_place_that_is_read, "memory depends on a counter"),
        (bug_two_at_a_time, "stamp does not count by one"),
        (bug_downwards, "stamp does not count by one"),
        (bug_counter_that_follows_another, "stamp does not count by one"),
        (bug_counter_that_decides_of_another, "what stamp takes depends on a counter"),
    ],
)
def test_a_counter_that_reaches_anything_else_is_found(describe, why):
    with pytest.raises(RestsNotError, match=f"^{why}$"):
        counters(describe)


def test_an_output_that_is_looked_at_and_shows_a_counter_is_found():
    netlist = to_netlist(Clockwork(bug_output), "top")
    assert len(check(netlist, ("seen",), ("divider", "stamp")).counters) == 2
    with pytest.raises(RestsNotError, match=r"^the output other depends on a counter$"):
        check(netlist, ("seen", "other"), ("divider", "stamp"))


def follows_nothing(m, c):
    m.d.sync += c.other.eq(c.word)


def follows_a_memory_without_stamps(m, c):
    m.submodules.memory = memory = Memory(shape=8, depth=4, init=[])
    write, read = memory.write_port(), memory.read_port()
    m.d.comb += [
        write.en.eq(c.edge),
        write.addr.eq(c.word),
        write.data.eq(c.word),
        read.en.eq(1),
        c.other.eq(read.data),
    ]


@pytest.mark.parametrize("describe", [follows_nothing, follows_a_memory_without_stamps])
def test_one_clock_is_enough_where_what_is_shown_follows_from_no_latch(describe):
    rest = resting(describe, "other")
    assert rest.clocks == 1
    stops = {counter.names[-1]: counter.stops for counter in rest.counters}
    assert stops == {"divider": (STOP, 15), "stamp": (255,)}  # both may be made 0


def follows_a_latch(m, c):
    m.d.sync += c.other.eq(c.seen ^ c.word)


def follows_a_latch_by_a_decision(m, c):
    with m.If(c.seen == c.word):
        m.d.sync += c.other.eq(c.word)


def follows_a_memory_of_stamps(m, c):
    m.submodules.memory = memory = Memory(shape=8, depth=4, init=[])
    write, read = memory.write_port(), memory.read_port()
    m.d.comb += [
        write.en.eq(c.edge),
        write.addr.eq(c.word),
        write.data.eq(c.stamp),
        read.en.eq(1),
        c.other.eq(read.data),
    ]


def follows_a_memory_that_is_read_at_once(m, c):
    m.submodules.memory = memory = Memory(shape=8, depth=4, init=[])
    write, read = memory.write_port(), memory.read_port(domain="comb")
    m.d.comb += [write.en.eq(c.edge), write.addr.eq(c.word), write.data.eq(c.stamp)]
    m.d.sync += c.other.eq(read.data)


def loads_a_counter(m, c):
    """The word may be one further by chance, and is the same in the next clock."""
    follows_nothing(m, c)
    allowed_reset_of_a_counter(m, c)


@pytest.mark.parametrize(
    "describe",
    [
        follows_a_latch,
        follows_a_latch_by_a_decision,
        follows_a_memory_of_stamps,
        follows_a_memory_that_is_read_at_once,
        loads_a_counter,
    ],
)
def test_two_clocks_are_needed_where_one_may_mislead(describe):
    rest = resting(describe, "other")
    assert rest.clocks == 2
    assert {counter.names[-1]: counter.stops for counter in rest.counters} == {"divider": (STOP,), "stamp": ()}


@pytest.mark.parametrize("estimator", SKIPPING)
def test_in_an_axis_the_divider_and_the_stamp_may_run(estimator):
    for name in ("mhz", "seed-2011"):
        axis = load(name, {"controller.estimator": estimator}).spec
        rest = library.resting_of(axis)
        found = {name: counter for counter in rest.counters for name in counter.names}
        assert len(rest.counters) == 2
        by_stamps = axis.design.estimator.uses_stamps()
        assert rest.clocks == (2 if by_stamps else 1)
        # Both begin again at 0, one of them by a reset, and to wrap does the same.
        below_0 = {} if by_stamps else {name: {(1 << found[name].width) - 1} for name in ("divider", "stamp")}
        assert set(found["divider"].stops) == {axis.clocks_per_sample - 1} | below_0.get("divider", set())
        assert (found["stamp"].width, set(found["stamp"].stops)) == (axis.stamp_width, below_0.get("stamp", set()))


class Leaky(Axis):
    """An axis in which a register follows the upper bits of the stamp, and takes the drive away after a while."""

    def elaborate(self, platform):
        m = super().elaborate(platform)
        late = Signal()
        m.d.sync += late.eq(self.stamp[8:].any())
        m.submodules.output_stage.enable = self.drive_enable & ~late
        return m


def test_an_axis_that_fails_the_check_runs_every_clock_and_says_why(monkeypatch, caplog):
    axis = spec("mhz", "fdm")
    library._sources.cache_clear()
    monkeypatch.setattr(library, "Axis", Leaky)
    with Hardware(axis, Model(axis).words) as hardware:
        _advance(hardware, [], [], 5_000)
        assert hardware.evaluated == 5_000
    library._sources.cache_clear()
    said = [message for message in caplog.messages if not message.startswith("building")]
    assert said == ["the RTL runs every clock, for late takes what is computed from a counter"]


def _advance(hardware: Hardware, clocks, levels, until: int) -> tuple[int, ...]:
    """Run to a clock with edges at the pins; return what is read there: drive, velocity and flags."""
    rtl, places = hardware.controller, [np.asarray(clocks, np.int64), np.asarray(levels, np.int64)]
    taken = call(rtl.advance, rtl.context, *(place.ctypes.data for place in places), len(places[0]), until)
    assert taken == np.count_nonzero(places[0] < until)
    return tuple(call(rtl.read, rtl.context, what, 0, 0, 0) for what in range(3))


def _stimulus(axis, random: np.random.Generator, edges: int) -> tuple[np.ndarray, np.ndarray]:
    """Return clocks and levels of edges, many of them around strobes, that the decoder can follow for a while.

    Then come glitches, edges that are too fast for the filter, and changes of both pins at once.
    """
    every, half = axis.clocks_per_sample, edges // 2
    apart = np.where(random.random(edges) < 0.5, random.integers(1, 14, edges), random.integers(1, 3 * every, edges))
    clocks = 2 + np.cumsum(apart)
    strobes = (clocks // every + 1) * every - 1
    near = random.random(edges) < 0.5
    clocks = np.sort(np.where(near, strobes + random.integers(-12, 45, edges), clocks))
    least = np.where(np.arange(edges) < half, 6, 0)
    clocks = clocks[0] + np.cumsum(np.maximum(np.diff(clocks, prepend=clocks[0]), least))
    ways = np.repeat(random.choice([1, -1], edges // 100), 100)
    wild = np.where(random.random(edges) < 0.9, random.choice([1, -1], edges), 2)
    return clocks, np.array([0, 1, 3, 2])[np.cumsum(np.where(np.arange(edges) < half, ways, wild)) % 4]


@pytest.mark.parametrize("estimator", SKIPPING)
def test_what_is_evaluated_is_the_way_to_the_drive_and_through_the_decoder(estimator):
    axis = load("seed-2011", {"controller.estimator": estimator}).spec
    every, words = axis.clocks_per_sample, Model(axis).words
    with Hardware(axis, words, short=True) as hardware:
        evaluated = []
        for first, until, edges in ((0, 1, 0), (1, 101, 0), (101, 201, 300)):
            clocks = np.linspace(first * every + 500, until * every - 500, edges).astype(int)
            before = hardware.evaluated
            _advance(hardware, clocks, np.array([1, 3, 2, 0])[np.arange(edges) % 4], until * every)
            evaluated.append(hardware.evaluated - before)
    decoder_clocks = latency(words["encoder_glitch_clocks"])
    assert evaluated[1] <= 100 * (axis.design.latency_to_drive + 2 + library.resting_of(axis).clocks)
    assert evaluated[2] <= evaluated[1] + 300 * (decoder_clocks + 4)


@pytest.mark.parametrize("slack", SLACK)
@pytest.mark.parametrize("estimator", SKIPPING)
def test_an_axis_that_skips_gives_the_words_of_one_that_does_not(estimator, slack):
    """They are read after runs of any length: in the middle of rests, at strobes, in between, and while edges come."""
    changes: dict = {"controller.estimator": estimator}
    clocks = load("mhz", changes).spec.design.latency_to_drive + slack
    scene = load("mhz", changes | {"controller.clock_hz": clocks * 1_000_000})
    axis, random = scene.spec, rng()
    clocks, levels = _stimulus(axis, random, 4_000)
    ends = np.cumsum(np.where(random.random(8_000) < 0.5, 1, random.integers(1, 3 * axis.clocks_per_sample, 8_000)))
    words = Model(axis, **scene.parameters | {"wall_position": 0.0}).words
    seen: list[list[tuple[int, ...]]] = [[], []]
    with ExitStack() as stack:
        both = [stack.enter_context(Hardware(axis, words, short=True)) for _ in seen]
        both[0].skip_nothing()
        given = 0
        for until in ends.tolist():
            some = slice(given, given := int(np.searchsorted(clocks, until)))
            for hardware, read in zip(both, seen, strict=True):
                read.append(_advance(hardware, clocks[some], levels[some], until))
        evaluated = [hardware.evaluated for hardware in both]
    assert [at for at, (every, most) in enumerate(zip(*seen, strict=True)) if every != most] == []
    drives, velocities, flags = (set(values) for values in zip(*seen[0], strict=True))
    assert min(len(drives), len(velocities)) > 100
    assert len(flags) > 1
    assert evaluated[0] == ends[-1]
    assert evaluated[1] < evaluated[0] * (0.5 if slack == 200 else 1)
