"""One axis, pins to force: RTL against the models of decoder and axis, with everything changing while it runs."""

from itertools import count

import cocotb
import numpy as np
import pytest
from cocotb.triggers import ClockCycles, RisingEdge, Timer, ValueChange

from hardwall.hdl.axis.axis import Axis
from hardwall.model import stamped
from hardwall.model.axis import clocked
from hardwall.model.axis.design import change_of, overlap_of, strobe_of
from hardwall.model.axis.supervised import Design
from hardwall.model.axis.virtual_mass import FIELD
from hardwall.model.estimators.acceleration import room_of
from hardwall.model.spec import AxisSpec
from hardwall.testing import SAMPLES, Bench, parameters, rng, simulate
from oracles.axis import AxisTwin
from stimuli import handle
from stimuli.axes import busy, fastest, random_words
from stimuli.lengths import REACHING, WHOLE, some_of
from stimuli.places import place

PINS, OUTPUTS = clocked.Pins._fields, clocked.Outputs._fields
MASS_KG = 0.05
"""The largest virtual mass, where there is one."""
LATE_BIT = 20 if WHOLE else 18
"""The bit of a clock's number that the others' numbers have not; the top bit where a stamp has fewer."""
STROBES = "commit", "preload", "clear_flags", "index_arm", "origin_shift", "slip"
ACTS, CHANCES = ("", "words", "drive_enable", *STROBES), (0.958, 0.006, 0.006, *[0.005] * len(STROBES))
"""What a host does at a clock, and the chance of each."""


def make(estimator: str, overlaps: bool, parts: str) -> Axis:
    axis = busy(estimator, **{part: MASS_KG if part == FIELD else True for part in parts.split()})
    return Axis(fastest(axis) if overlaps else axis)


class Events:
    """Changes of the pins in the simulator: (clock whose edge sees the change first, row in PINS, value)."""

    def __init__(self, bench: Bench):
        self.rows: list[tuple[int, int, int]] = []
        for row, name in enumerate(PINS):
            cocotb.start_soon(self._watch(bench, row, bench.reader(name), getattr(bench.dut, name)))

    async def _watch(self, bench: Bench, row: int, read, handle):
        while True:
            await ValueChange(handle)
            # Set between two edges, it is seen by the second.
            self.rows.append((bench.clock_number() + 1, row, read()))

    def records(self, first_clock: int, clocks: int) -> np.ndarray:
        """Return the level of every pin at every clock from `first_clock` on."""
        pins = np.zeros((len(PINS), clocks), np.int64)
        for row, levels in enumerate(pins):
            changes = [(max(clock - first_clock, 0), value) for clock, changed, value in self.rows if changed == row]
            ends = [*(begin for begin, _ in changes[1:]), clocks]
            for (begin, value), end in zip(changes, ends, strict=True):
                levels[begin:end] = value
        return pins


def reference(spec: AxisSpec, pins: np.ndarray, commits: list[tuple[int, dict[str, int]]]) -> dict[str, np.ndarray]:
    """Return the model's outputs of every sample, by name; `commits` says at which strobe which words take effect."""
    design = spec.design
    words = {word.name: word.reset for word in design.words}
    state = clocked.start(design)
    samples = pins.shape[1] // spec.clocks_per_sample
    out, made = np.zeros((len(OUTPUTS), samples), np.int64), room_of(design.estimator, (samples,), np.int64)
    clock = 0

    def run_to(clocks: int, settings: dict[str, int], gains: dict[str, int]) -> None:
        nonlocal state, clock
        encoder = settings["encoder_glitch_clocks"], settings["encoder_invert"]
        controller = stamped.Controller(design.decoder, *encoder, design.params(gains))
        records = clocked.Pins(*pins), clocked.Outputs(*out), made
        state = clocked.run(controller, design.timing, state, *records, clock, clocks)
        clock = clocks

    for strobe, new in commits:
        run_to(strobe, words, words)
        # The strobe's sample uses the new words; the decoder uses them from the next clock on.
        run_to(strobe + 1, words, new)
        words = new
    run_to(pins.shape[1], words, words)
    return dict(zip(OUTPUTS, out, strict=True)) | made._asdict()


async def motion(bench: Bench, spec: AxisSpec, samples: int, random: np.random.Generator) -> None:
    """Move the encoder by one edge at a time: slowly, fast, back and forth, and sometimes too fast or glitching."""
    end = bench.clock_number() + samples * spec.clocks_per_sample
    for pins, clocks in handle.edges(random):
        if bench.clock_number() >= end:
            return
        bench.drive(**pins)
        await Timer(clocks * bench.period_ns, "ns")


async def host(bench: Bench, spec: AxisSpec, samples: int, random: np.random.Generator, commits: list) -> None:
    """Act behind changed drives: commit words, preload, clear, arm, drop the enable and raise it again."""
    dut, sampled, timing = bench.dut, bench.dut.sampled, spec.design.timing
    committed = 0
    for sample in range(samples - 1):
        await RisingEdge(sampled)
        if sample == committed:
            assert not int(dut.commit_pending.value), "a commit has ended with the drive of its sample"
        act = random.random()
        if act > 0.1:
            continue
        await RisingEdge(dut.clk)
        await Timer(bench.period_ns // 2, "ns")
        pulse = ""
        if act < 0.02 and sample >= committed:
            words, pulse = random_words(spec.design, random), "commit"
            bench.drive(**words)
            # The commit is seen a clock behind the changed drive, and waits from the next clock on.
            committed = next(k for k in count(sample) if strobe_of(timing, k) >= change_of(timing, sample) + 2)
            commits.append((strobe_of(timing, committed), words))
        elif act < 0.035:
            pulse = "preload" if act < 0.03 else "origin_shift"
            bench.drive(preload_count=place(random, spec.count_width))
        elif act < 0.06:
            pulse = "clear_flags"
        elif act < 0.08:
            pulse = "index_arm" if act < 0.078 else "slip"
        else:
            bench.drive(drive_enable=int(random.random() < 0.8))
        if pulse:
            bench.drive(**{pulse: 1})
            await Timer(bench.period_ns, "ns")
            bench.drive(**{pulse: 0})
        if pulse == "commit":
            await Timer(bench.period_ns, "ns")
            assert int(dut.commit_pending.value), "a commit waits for the strobe"


@cocotb.test()
async def follows_model(dut):
    spec = make(**parameters()).spec
    # Every estimator has its own campaign; this one tests the wiring.
    samples = max(SAMPLES, REACHING) // (5 if spec.estimator in ("levant", "fdm") else 20) // (1 if WHOLE else 2)
    random = rng()
    bench = Bench(dut, Axis(spec))
    await bench.reset()
    bench.drive(**dict.fromkeys(PINS, 0), commit=0)
    await RisingEdge(dut.clk)
    await Timer(bench.period_ns // 2, "ns")
    bench.drive(rst=1)
    await Timer(2 * bench.period_ns, "ns")
    events, seen = (
        Events(bench),
        bench.monitor("sampled", *OUTPUTS, *room_of(spec.design.estimator, (), np.int64)._fields),
    )
    bench.drive(rst=0, drive_enable=1)
    first_clock = bench.clock_number() + 1
    commits: list[tuple[int, dict[str, int]]] = []
    hosting = cocotb.start_soon(host(bench, spec, samples, random, commits))
    await motion(bench, spec, samples, random)
    await hosting
    kept = len(seen.rows) - 1
    assert kept >= samples - 2
    assert len(commits) > samples // 100
    timing = spec.design.timing
    assert overlap_of(timing) == parameters()["overlaps"]
    pins = events.records(first_clock, change_of(timing, kept))
    expected = reference(spec, pins, commits)
    for name, words in expected.items():
        found = seen.column(name)[:kept]
        wrong = np.flatnonzero(found != words[:kept])
        assert not len(wrong), f"{name}: {len(wrong)} of {kept} differ, first at sample {wrong[:1]}"
    # The run must show forces in both directions, all faults of the encoder, a saturated estimator, and both limits.
    assert (seen.column("drive") > 0).any()
    assert (seen.column("drive") < 0).any()
    rose = spec.design.flag_names(int(np.bitwise_or.reduce(seen.column("flags"))))
    limits = {"slew_limited", "force_limited"}
    limits |= {"error_saturated"} if spec.estimator in ("levant", "levant-edge") else set()
    limits |= {"passivity_active"} if spec.passivity else set()
    assert {"encoder_illegal", "encoder_overspeed", "count_wrapped", *limits} <= set(rose)
    assert [clock - first_clock for clock in seen.clocks[:kept]] == [change_of(timing, k) for k in range(kept)]


@cocotb.test()
async def every_output_is_the_twins_at_every_clock(dut):
    spec, random = make(**parameters()).spec, rng()
    bench, twin, moves = Bench(dut, Axis(spec)), AxisTwin(Design(spec)), handle.edges(random, handle.Habits(index=0.1))
    await bench.reset()
    pins, words, left = dict.fromkeys(PINS, 0), random_words(spec.design, random), 0
    for _ in range((300 if WHOLE else 100) * spec.clocks_per_sample):
        if left == 0:
            changed, left = next(moves)
            pins |= changed
        left -= 1
        act = random.choice(ACTS, p=CHANCES)
        if act == "words" and not twin.pending:
            words = random_words(spec.design, random) | twin.fixed()
            pins["preload_count"] = place(random, spec.count_width)
        elif act == "drive_enable":
            pins["drive_enable"] ^= 1
        reset = int(random.random() < 2e-4)
        given = {**pins, **words, **dict.fromkeys(STROBES, 0)} | ({act: 1} if act in STROBES else {})
        bench.drive(**given, rst=reset)
        await RisingEdge(dut.clk)
        seen = bench.packing.unpack(int(dut.bench_seen.value))
        wanted = twin.outputs()
        unlike = {name: (seen[name], word) for name, word in wanted.items() if seen[name] != word}
        assert not unlike, f"clock {twin.clocks}: the axis's and the twin's {unlike}"
        twin.restarted() if reset else twin.advance(given, given["drive_enable"])


@cocotb.test()
async def late_edges_have_late_stamps(dut):
    axis, passed = make(**parameters()), 40
    bench, late = Bench(dut, axis), 1 << min(LATE_BIT, axis.spec.stamp_width - 1)
    await bench.reset()
    await Timer((late + passed) * bench.period_ns, "ns")
    for (a, b), kind in zip(((1, 0), (1, 1), (0, 1), (0, 0)), ("a_rise", "b_rise", "a_fall", "b_fall"), strict=True):
        bench.drive(encoder_a=a, encoder_b=b)
        await ClockCycles(dut.clk, passed)
        now, of_edge = (bench.reader(name)() for name in ("stamp", f"stamp_{kind}"))
        assert late < now - passed < of_edge < now


# One estimator on the count and one on the stamps. `test_loop` runs all estimators.
SIZES = [
    ("levant", False, ""),
    ("levant", True, ""),
    ("levant", True, "passivity"),
    ("levant-edge", False, "passivity coupling"),
    ("levant-edge", True, "coupling"),
    ("kalman", False, FIELD),
    ("kalman", True, "passivity"),
    ("levant-2", True, f"{FIELD} passivity coupling"),
]


@pytest.mark.parametrize(("estimator", "overlaps", "parts"), some_of(SIZES, 1, 3))
def test_rtl(estimator, overlaps, parts):
    simulate(__file__, make, estimator=estimator, overlaps=overlaps, parts=parts)


def test_wrong_spec_is_refused():
    with pytest.raises(TypeError, match=r"not 3$"):
        Axis(3)
