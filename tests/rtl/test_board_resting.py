"""A board that rests: what the check of its netlist finds, and clocks that are left out beside clocks that are not."""

from collections.abc import Callable
from contextlib import ExitStack

import numpy as np
import pytest
from amaranth.hdl import Cat, ClockDomain, Module, Mux, Signal
from amaranth.lib import wiring
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In, Out

from hardwall.hdl.axis.board import Board
from hardwall.hdl.export import to_netlist
from hardwall.model.axis.register_file import Design
from hardwall.model.link.line import framed
from hardwall.sim.rtl import board_library, board_resting, shared_library
from hardwall.sim.rtl.board_library import LEVELS, SWITCHES, WIRES, BoardHardware
from hardwall.sim.rtl.c_function import call
from hardwall.sim.rtl.resting import RestsNotError
from hardwall.sim.rtl.shared_library import Recipe
from hardwall.sim.scene.load import load
from hardwall.testing import rng
from stimuli.lengths import LONG
from stimuli.random_requests import random_request

VOLTS = {"drive.newtons_per_volt": 4.0, "drive.full_scale_v": 12.0}
BRIDGE = VOLTS | {"drive.stage": "pwm", "drive.pwm_hz": 20_000, "drive.dead_time_s": 1e-6}
BOARDS = {
    "pdm": {},
    "pdm of volts": VOLTS | {"drive.stage": "pdm"},
    "dac": VOLTS
    | {"drive.stage": "dac", "drive.dac_bits": 16, "drive.dac_serial_hz": 2_000_000, "drive.offset_v": 0.01}
    | {"drive.dac_header_bits": 8, "drive.dac_header": 3, "drive.dac_mode": 1, "drive.dac_setup": [0x0F0000, 0x040268]},
    "pwm": BRIDGE,
    "25 MHz": {"controller.clock_hz": 25_000_000},
    "1 MHz": {"controller.clock_hz": 1_000_000, "encoder.count_m": 10e-6},
    "learned": {"controller.estimator": "levant-edge"},
}
WALKED = tuple(BOARDS) if LONG else ("pdm", "dac")
STEPS = 4000 if LONG else 400
Describe = Callable[[Module, "Clockwork"], None]


class Clockwork(wiring.Component):
    """A timer, the number of the clock, a monitor of the clock, a sum of pulses, and what `describe` adds."""

    def __init__(self, describe: Describe = lambda m, clockwork: None):
        self._describe = describe
        super().__init__({"edge": In(1), "amount": In(4), "drive_pdm": Out(1), "seen": Out(8), "other": Out(8)})
        self.stamp = Signal(8)
        self.quiet = Signal(4)
        self.beat = Signal(3, reset_less=True)
        self.total = Signal(5)
        self.permitted = Signal()
        self.running = Signal(reset_less=True)

    def elaborate(self, platform):
        m = Module()
        link, line, stage, monitor = Module(), Module(), Module(), Module()
        m.submodules.link, m.submodules.stage, m.submodules.clock_monitor = link, stage, monitor
        link.submodules.line = line
        m.d.sync += [self.stamp.eq(self.stamp + 1), self.beat.eq(self.beat + 1)]
        gap = Signal()
        line.d.comb += gap.eq(self.quiet == 9)
        line.d.sync += self.quiet.eq(Mux(self.edge, 0, self.quiet + ~gap))
        monitor.d.sync += self.running.eq(self.beat[-1] | self.running)
        stage.d.sync += self.total.eq(self.total[:-1] + self.amount)
        stage.d.comb += [self.permitted.eq(self.running), self.drive_pdm.eq(self.total[-1] & self.permitted)]
        with m.If(self.edge):
            m.d.sync += self.seen.eq(self.stamp)
        self._describe(m, self)
        return m


def check(describe: Describe = lambda m, clockwork: None) -> board_resting.BoardResting:
    return board_resting.check(to_netlist(Clockwork(describe), "top"))


def test_what_runs_in_a_clockwork_is_found():
    found = check()
    assert {counter.names[0]: counter.stops for counter in found.counters} == {"stamp": (), "link.line.quiet": (9,)}
    assert (found.guards, found.sum_bits, found.memories) == ((), 4, ())
    assert [names[0] for names in (*found.watched, *found.exits)] == ["beat", "running"]


def _low_bit(m, c):
    with m.If(c.edge):
        m.d.sync += c.other.eq(c.stamp[0])


def _mixed(m, c):
    moving, kept = Signal(name="moving"), Signal(8, reset_less=True)
    m.d.comb += [moving.eq(c.edge & c.amount.any()), c.other.eq(kept)]
    with m.If(moving):
        m.d.sync += kept.eq(c.stamp ^ c.amount)


def _mixed_always(m, c):
    m.d.sync += c.other.eq(c.stamp ^ c.amount)


def _shown(m, c):
    m.d.comb += c.other.eq(c.stamp)


def _sum_shown(m, c):
    m.d.comb += c.other.eq(c.total)


def _sum_taken(m, c):
    with m.If(c.total[2]):
        m.d.sync += c.other.eq(1)


def _slow_clock(m, c):
    m.domains.oscillator = oscillator = ClockDomain(reset_less=True)
    m.d.comb += oscillator.clk.eq(c.edge)
    m.d.oscillator += c.other.eq(c.other + 1)


def _written_in_parts(m, c):
    m.submodules.kept = kept = Memory(shape=8, depth=2, init=[])
    write = kept.write_port(granularity=4)
    m.d.comb += [write.data.eq(c.stamp), write.en.eq(Cat(c.edge, c.amount[0]))]


def _read_at_once(m, c):
    m.submodules.kept = kept = Memory(shape=8, depth=2, init=[])
    m.d.comb += [kept.write_port().en.eq(c.edge), c.other.eq(kept.read_port(domain="comb").data)]


def _counts_one_bit(m, c):
    m.submodules.axis = axis = Module()
    axis.submodules.supervisor = supervisor = Module()
    pump = Signal(name="pump")
    supervisor.d.sync += pump.eq(pump + 1)


def _beat_of_the_edge(m, c):
    with m.If(c.edge):
        m.d.sync += c.beat.eq(0)


@pytest.mark.parametrize(
    ("describe", "why"),
    [
        (_low_bit, "other takes what is computed from a counter"),
        (_mixed_always, "other takes what is computed from a counter"),
        (_shown, "the output other depends on a counter"),
        (_sum_shown, "stage.total reaches more than its pin"),
        (_sum_taken, "stage.total reaches more than its pin"),
        (_slow_clock, "it has more clocks than the monitor of its clock needs"),
        (_written_in_parts, "kept is written in parts"),
        (_read_at_once, "kept is read without a clock"),
        (_counts_one_bit, "a counter has fewer than 2 bits"),
        (_beat_of_the_edge, "the monitor of the clock follows from more than clocks"),
    ],
)
def test_what_keeps_a_board_from_resting_is_named(describe, why):
    with pytest.raises(RestsNotError, match=f"^{why}$"):
        check(describe)


def test_what_is_mixed_behind_a_condition_has_a_guard():
    assert check(_mixed).guards == ("moving",)


@pytest.mark.parametrize("stage", BOARDS if LONG else ("pdm of volts", "dac", "learned"))
def test_every_board_can_rest(stage):
    spec = load("seed-2011", BOARDS[stage]).spec
    found = board_resting.check(to_netlist(Board(spec), "board"))
    assert [counter.stops for counter in found.counters] == [
        (),
        (spec.clocks_per_sample - 1,),
        (spec.clock_hz // 25_000 - 1,),
        (spec.clock_hz // 50,),
    ]
    assert found.guards == ("link.file.moving",)
    assert [names[0] for names in found.exits] == ["running"]
    assert (found.sum_bits > 0) == (spec.stage.name == "pdm")


def test_a_board_that_fails_the_check_runs_every_clock_and_says_why(monkeypatch, caplog):
    def fails(netlist):
        raise RestsNotError("it is tired")

    recipes: list[Recipe] = []
    monkeypatch.setattr(board_resting, "check", fails)
    monkeypatch.setattr(shared_library, "build", recipes.append)
    board_library.build(load("seed-2011", BOARDS["1 MHz"]).spec)
    assert "#define SKIPS 0\n" in recipes[0].files["board_ports.h"]
    assert "the virtual board runs every clock, for it is tired" in caplog.text


def _advance(board: BoardHardware, clocks: np.ndarray, levels: np.ndarray, until: int) -> tuple[int, bytes]:
    """Run to a clock with edges at the pins; return the sum of the amplifier's steps, and what the board has sent."""
    rtl, places = board.controller, [np.asarray(clocks, np.int64), np.asarray(levels, np.int64)]
    assert call(rtl.advance, rtl.context, *(place.ctypes.data for place in places), len(clocks), until) == len(clocks)
    return call(rtl.read, rtl.context, 0, 0, 0, 0), board.take()


@pytest.mark.parametrize("stage", WALKED)
def test_a_board_that_skips_does_what_one_does_that_does_not(stage):
    """Its pins are looked at after runs of any length: in rests, at strobes, in frames, at edges, faults and stops.

    Each skip of a third one is compared with its clocks, in all that Verilator keeps.
    """
    spec, random = load("seed-2011", BOARDS[stage]).spec, rng()
    design, every = Design(Board(spec).registers), spec.clocks_per_sample
    number, until, seen, stood = 0, 0, [[], [], []], 0
    with ExitStack() as stack:
        boards = [stack.enter_context(BoardHardware(spec, 0, 64)) for _ in seen]
        boards[0].skip_nothing()
        boards[2].check_skips()
        for _ in range(STEPS):
            run = int(
                random.choice((1, 7, every // 3, every, 5 * every, 60 * every), p=(0.2, 0.2, 0.2, 0.2, 0.15, 0.05))
            )
            edges = int(random.choice((0, 0, 0, 1, 2, 9)))
            clocks = np.sort(until + random.integers(0, run, edges))
            ways = np.cumsum(random.choice((1, 1, 1, -1), edges))
            levels = [int(_level(number + way)) for way in ways]
            number += int(ways[-1]) if edges else 0
            until += run
            request = framed(b"\1" + random_request(random, design)) if random.random() < 0.1 else b""
            wire = (str(random.choice(WIRES)), str(random.choice(LEVELS, p=(0.85, 0.05, 0.05, 0.05))))
            loop, broken = str(random.choice(SWITCHES[:3])), random.random(2)
            stands = random.random() < 0.05
            stood += stands
            for board, read in zip(boards, seen, strict=True):
                if request and not board.waiting:
                    board.send(request)
                if broken[0] < 0.02:
                    board.wire(*wire)
                if broken[1] < 0.04:
                    board.switch(loop, bool(broken[1] > 0.01))
                board.switch("clock", not stands)
                read.append(_advance(board, clocks, levels, until))
        evaluated, (checked, wrong) = [board.evaluated for board in boards], boards[2].check_skips()
    assert [at for at, (every, *others) in enumerate(zip(*seen, strict=True)) if others != [every, every]] == []
    assert wrong == 0
    assert (checked > STEPS) == (stage != "pwm")
    assert stood > STEPS // 40
    assert len(b"".join(sent for _, sent in seen[0])) > 0.5 * STEPS
    assert evaluated[0] >= until
    assert (evaluated[1] < evaluated[0]) == (stage != "pwm")


def _level(number: int) -> int:
    quarter = number + 1 & 3
    return quarter ^ quarter >> 1
