"""The encoder: stamps and pins against an independent computation of the geometry, and passages known by hand."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from hardwall.model.stamped import Edges
from hardwall.sim.world.advance import Interval, Moment, advance, advance_quietly
from hardwall.sim.world.encoder import MARGIN, Cell, Encoder, edge, level, locate, number_at, offsets
from hardwall.sim.world.rigid import Coulomb, Handle, Motion, Rigid, span
from stimuli.device_motion import after

U = 2.0**-53
CLOCK_HZ = 100.0
UPWARDS = [0b00, 0b01, 0b11, 0b10]  # a | b << 1 as the handle moves up
UNIT = Handle(mass_kg=1.0, viscous_n_s_per_m=0.0)


def true_path(handle, friction, motion, force, seconds):
    """Return (position(times), time of the turn or None, whether the handle ends stuck) of one interval.

    It computes in extended precision, and finds the turn by bisection.
    """
    m, b = map(np.longdouble, handle)
    x, v = map(np.longdouble, motion)

    def laws(x, v, net):
        if b == 0:
            return lambda t: x + v * t + net / m * t * t / 2, lambda t: v + net / m * t
        fade, terminal = lambda t: (v - np.longdouble(net) / b) * np.expm1(-b / m * t), np.longdouble(net) / b
        return lambda t: x + terminal * t - fade(t) * m / b, lambda t: v + fade(t)

    holds = abs(force) <= friction
    if v == 0 and holds:
        return lambda t: x + 0 * t, None, True
    position, velocity = laws(x, v, np.longdouble(force) - (np.sign(v) or np.sign(force)) * friction)
    if v * velocity(np.longdouble(seconds)) >= 0:
        return position, None, False
    low, high = np.longdouble(0), np.longdouble(seconds)
    for _ in range(70):
        middle = (low + high) / 2
        low, high = (middle, high) if v * velocity(middle) > 0 else (low, middle)
    back, _ = laws(position(low), 0, 0 if holds else np.longdouble(force) - np.sign(force) * friction)
    return lambda t: np.where(t < low, position(t), back(t - low)), low, holds


class Scale:
    """The geometry of the scale, by counting the edges at or below a position."""

    def __init__(self, encoder, low, high):
        self.first = int(np.floor(low / encoder.count_m)) - 5
        numbers = np.arange(self.first, int(np.ceil(high / encoder.count_m)) + 6)
        self.edges = (numbers + np.array(encoder.offsets)[numbers % 4]) * encoder.count_m

    def cells(self, positions):
        return self.first - 1 + np.searchsorted(self.edges, positions, side="right")

    def distance(self, positions):
        return np.abs(self.edges[:, None] - positions).min(axis=0)


def buffers(size: int) -> Edges:
    return Edges(np.zeros(size, np.int64), np.zeros(size, np.uint8))


def steps(levels) -> np.ndarray:
    """Return +1 or -1 for every change of the pins; fail if a change is neither a step up nor a step down."""
    phases = np.array([UPWARDS.index(word) for word in levels])
    change = np.diff(phases) % 4
    assert set(change.tolist()) <= {1, 3}
    return np.where(change == 1, 1, -1)


def random_encoder(rng) -> Encoder:
    duty = float(rng.uniform(-0.4, 0.4))
    phase = float(rng.uniform(-0.5, 0.5)) if rng.random() < 0.5 else rng.uniform(-0.2, 0.2, 4).tolist()
    return Encoder(float(10 ** rng.uniform(-2.5, 0)), CLOCK_HZ, offsets(phase, duty))


def random_force(rng, friction: float) -> float:
    return float(rng.choice([rng.normal(0, 3), rng.normal(0, 0.3), friction, -friction]))


@pytest.mark.parametrize("dry", [False, True])
def test_pins_show_the_geometry_at_every_clock(dry):
    rng = np.random.default_rng(10 + dry)
    turns = stuck = compared = shared = 0
    for _ in range(1500):
        handle = Handle(float(10 ** rng.uniform(-0.5, 0.5)), float(rng.choice([0.0, 10 ** rng.uniform(-1, 1.5)])))
        friction = float(rng.uniform(0, 1)) if dry else 0.0
        coulomb = Coulomb(friction) if dry else None
        encoder = random_encoder(rng)
        motion = Motion(*rng.normal(0, 1, 2).tolist())
        cell = locate(encoder, motion.position_m)
        edges = stamps, words = buffers(20_000)
        clock = int(rng.integers(-1000, 1 << 40))
        n_edges = 0
        for _ in range(3):
            clocks = int(rng.choice([1, 2, rng.integers(1, 150)]))
            interval = Interval(span(handle, clocks / CLOCK_HZ), clock, clocks)
            seconds = interval.length.seconds
            force = random_force(rng, friction)
            position, turn_s, holds = true_path(handle, friction, motion, force, seconds)
            reach_m = (abs(motion.velocity_m_per_s) + (abs(force) + friction) * seconds) * seconds * 4
            scale = Scale(encoder, motion.position_m - reach_m, motion.position_m + reach_m)
            plant, moment = Rigid(handle, coulomb), Moment(motion, cell, n_edges)
            fast, quiet = advance_quietly(plant, moment, force, interval)
            unseen = after(plant, motion, force, interval.length)
            motion, cell, n_edges = advance(plant, encoder, moment, force, interval, edges)
            assert motion == unseen, "edges move nothing"
            assert cell.lower_m <= motion.position_m < cell.upper_m
            if quiet:
                assert fast == (motion, cell, n_edges) == (motion, *moment[1:])

            new = stamps[moment.n_edges : n_edges]
            assert (np.diff(new) >= 0).all()
            assert ((new > clock) & (new <= clock + clocks)).all()
            step = steps([level(moment.cell.number), *words[moment.n_edges : n_edges].tolist()])
            numbers = moment.cell.number + np.concatenate([[0], np.cumsum(step)])
            assert numbers[-1] == cell.number

            # The last edge up to a clock gives the cell there. Within the error of a position, either cell is right.
            times = np.arange(clocks + 1) / CLOCK_HZ
            positions = position(times)
            seen = numbers[np.searchsorted(new, clock + np.arange(clocks + 1), side="right")]
            certain = scale.distance(positions) > 200 * U * (abs(motion.position_m) + reach_m)
            assert (seen == scale.cells(positions))[certain].all()
            compared += certain.sum()
            assert (~certain).sum() <= 2

            # There are no more edges than on the way to the turn and back.
            ends = position(np.array([0, turn_s or 0, seconds]))
            assert len(new) == np.abs(np.diff(scale.cells(ends))).sum()
            turns += turn_s is not None
            stuck += holds
            shared += (np.diff(new) == 0).any()
            clock += clocks
    assert compared > 100_000
    assert turns > 200
    assert shared > 200
    assert (stuck > 200) == dry


def test_levels_are_quadrature():
    assert [level(n) for n in range(-4, 4)] == [0b01, 0b11, 0b10, 0b00] * 2


def test_edges_stand_where_the_errors_put_them():
    # B is late by 0.1 counts, and both pins are high for 2.2 counts.
    encoder = Encoder(2.0, CLOCK_HZ, offsets(0.1, 0.2))
    expected = np.array([-0.1, 1.0, 2.1, 3.2]) * 2
    assert [edge(encoder, n) for n in range(4)] == pytest.approx(expected)
    assert [edge(encoder, n) for n in range(-4, 0)] == pytest.approx(expected - 8)
    assert offsets((0.0, 0.1, 0.0, 0.1), 0.2) == offsets(0.1, 0.2)
    assert offsets() == Encoder(1.0, 1.0).offsets == (0, 0, 0, 0)


def test_the_counts_of_positions_are_the_numbers_of_their_cells():
    """An edge belongs to the cell above; just below it is the cell below."""
    encoder = Encoder(0.25, CLOCK_HZ, offsets((0.0, 0.3, -0.2, 0.1)))
    edges = np.array([edge(encoder, number) for number in range(-9, 10)])
    assert number_at(encoder, edges).tolist() == list(range(-9, 10))
    assert number_at(encoder, np.nextafter(edges, -1e9)).tolist() == list(range(-10, 9))


def test_locate_agrees_with_counting_edges():
    rng = np.random.default_rng(12)
    for _ in range(300):
        encoder = random_encoder(rng)
        scale = Scale(encoder, -40 * encoder.count_m, 40 * encoder.count_m)
        on_edges = scale.edges[5:-5]
        positions = np.concatenate([on_edges, np.nextafter(on_edges, -9e9), rng.uniform(-30, 30, 50) * encoder.count_m])
        for position, number in zip(positions.tolist(), scale.cells(positions).tolist(), strict=True):
            cell = locate(encoder, position)
            assert cell == Cell(number, *scale.edges[number - scale.first : number - scale.first + 2])


def passages(encoder, motion, force, clocks, clock=1000, coulomb=None, handle=UNIT):
    """Return the new motion, the new cell, and [(stamp, pins)] of one interval from `clock`."""
    edges = stamps, words = buffers(100)
    plant, start = Rigid(handle, coulomb), Moment(motion, locate(encoder, motion.position_m), 0)
    interval = Interval(span(handle, clocks / encoder.clock_hz), clock, clocks)
    fast, quiet = advance_quietly(plant, start, force, interval)
    motion, cell, n_edges = advance(plant, encoder, start, force, interval, edges)
    if quiet:
        assert fast == (motion, cell, n_edges) == (motion, start.cell, 0)
    return motion, cell, list(zip(stamps[:n_edges].tolist(), words[:n_edges].tolist(), strict=True))


def test_known_passages():
    # All numbers are dyadic, so that every passage is exact: counts of 1 m, 4 clocks a second, m = 1, b = 0.
    encoder = Encoder(1.0, 4.0)
    # 1 m/s from 0.25 to 1.25: it passes 1 m after exactly 3 clocks, and the pins are new at that very clock.
    assert passages(encoder, Motion(0.25, 1.0), 0.0, 4) == ((1.25, 1.0), (1, 1, 2), [(1003, 0b11)])
    # A passage exactly at the end belongs to this interval.
    assert passages(encoder, Motion(0.25, 1.0), 0.0, 3) == ((1.0, 1.0), (1, 1, 2), [(1003, 0b11)])
    # A motion downwards exactly to the edge does not pass it.
    assert passages(encoder, Motion(1.75, -1.0), 0.0, 3) == ((1.0, -1.0), (1, 1, 2), [])
    # A motion downwards past the edge: at clock 3 it is on the edge, in the upper cell; the next clock sees the lower.
    assert passages(encoder, Motion(1.75, -1.0), 0.0, 4) == ((0.75, -1.0), (0, 0, 1), [(1004, 0b01)])
    # A motion from the edge downwards passes it at once.
    assert passages(encoder, Motion(1.0, -1.0), 0.0, 1) == ((0.75, -1.0), (0, 0, 1), [(1001, 0b01)])
    # 16 m/s: four edges in every clock, in order; the first comes after half a metre.
    _, cell, edges = passages(encoder, Motion(0.5, 16.0), 0.0, 2)
    assert cell.number == 8
    assert edges == [(1001, word) for word in (0b11, 0b10, 0b00, 0b01)] + [(1002, w) for w in (0b11, 0b10, 0b00, 0b01)]
    # Up at 1 m/s from 0.625, turned by -1 N at 1.125 m after 1 s, back to 0.625: passes 1 m at 0.5 and 1.5 s.
    _, cell, edges = passages(encoder, Motion(0.625, 1.0), -1.0, 8)
    assert (cell, edges) == ((0, 0, 1), [(1002, 0b11), (1007, 0b01)])
    # A turn that touches the edge passes it and goes back at the next clock; one short of it does not.
    assert passages(encoder, Motion(0.5, 1.0), -1.0, 8)[2] == [(1004, 0b11), (1005, 0b01)]
    assert passages(encoder, Motion(0.499, 1.0), -1.0, 8)[2] == []
    # Friction stops it on the edge, and it stays in the upper cell.
    assert passages(encoder, Motion(0.5, 1.0), 0.0, 8, coulomb=Coulomb(1.0)) == ((1.0, 0.0), (1, 1, 2), [(1004, 0b11)])


def test_a_turn_between_two_clocks_shows_both_edges():
    encoder = Encoder(1.0, 4.0)
    # 8 m/s turned by -64 N after 1/8 s, 0.5 m on: past 1 m and back within one clock.
    motion, cell, edges = passages(encoder, Motion(0.75, 8.0), -64.0, 1)
    assert (motion, cell.number, edges) == ((0.75, -8.0), 0, [(1001, 0b11), (1001, 0b01)])


@pytest.mark.parametrize("clock_hz", [100.0, 48e6, 1e8])
def test_rounding_puts_no_edge_outside_its_interval(clock_hz):
    # Passages exactly at the end, where n / clock_hz * clock_hz may exceed n, and a passage exactly at the start.
    encoder = Encoder(8.0, clock_hz)
    exceeding = 0
    for clocks in range(1, 400):
        seconds = clocks / clock_hz
        exceeding += seconds * clock_hz > clocks
        for start, expected in ((Motion(8 - seconds, 1.0), 0b11), (Motion(np.nextafter(8 + seconds, 0), -1.0), 0b01)):
            _, _, edges = passages(encoder, start, 0.0, clocks)
            assert edges in ([], [(1000 + clocks, expected)])
    assert exceeding > 10
    assert passages(encoder, Motion(-5e-324, 8.0), 0.0, 1)[2] == [(1001, 0b01)]


def test_an_interval_without_edges_or_turns_is_quiet():
    cell, interval = Cell(0, 0.0, 1.0), Interval(span(UNIT, 1.0), 0, 1)

    def quietly(coulomb, motion, force):
        moment, quiet = advance_quietly(Rigid(UNIT, coulomb), Moment(motion, cell, 7), force, interval)
        assert moment[1:] == (cell, 7)
        return moment.motion, quiet

    for coulomb in (None, Coulomb(0.0), Coulomb(0.125)):
        assert quietly(coulomb, Motion(0.25, 0.5), 0.0)[1]
        assert quietly(coulomb, Motion(0.75, -0.5), 0.0)[1]
        assert not quietly(coulomb, Motion(0.75, 0.5), 0.0)[1]
    assert quietly(None, Motion(0.5, -0.5), 0.0) == ((0.0, -0.5), True)
    assert not quietly(None, Motion(0.5, 0.5), 0.0)[1]
    assert quietly(Coulomb(0.5), Motion(0.5, 0.0), -0.5) == ((0.5, 0.0), True)
    # Without friction, a turn may lie where no edge can be; with friction, a turn is an event.
    assert quietly(None, Motion(0.5, 0.25), -0.5) == ((0.5, -0.25), True)
    assert not quietly(None, Motion(0.5, 0.5), -0.5)[1]
    assert not quietly(Coulomb(0.0), Motion(0.5, 0.25), -0.5)[1]


@pytest.mark.parametrize("coulomb", [None, Coulomb(0.0)])
def test_full_arrays_are_reported_and_never_overrun(coulomb):
    encoder = Encoder(1.0, 4.0)
    # 8 edges up to the turn after 2 s, 8 back, in 16 clocks.
    plant, cell, interval = Rigid(UNIT, coulomb), locate(encoder, 0.5), Interval(span(UNIT, 4.0), 0, 16)
    for clocks_room, words_room in [(16, 16), (15, 15), (8, 8), (7, 9), (9, 3), (0, 0)]:
        stamps, words = np.full(32, -7), np.full(32, 77, np.uint8)
        room = min(clocks_room, words_room)
        edges = Edges(stamps[:clocks_room], words[:words_room])
        motion, _, n_edges = advance(plant, encoder, Moment(Motion(0.5, 8.0), cell, 0), -4.0, interval, edges)
        assert motion == (0.5, -8.0)
        assert n_edges == (16 if room == 16 else -1)
        assert (stamps[:room] > 0).all()
        assert (words[:room] < 4).all()
        if room < 16:  # the array stays full
            lost = Moment(Motion(0.5, 8.0), cell, -1)
            assert advance(plant, encoder, lost, -4.0, interval, edges).n_edges == -1
        assert (stamps[room:] == -7).all()
        assert (words[room:] == 77).all()


def test_edges_are_appended_to_those_already_there():
    encoder = Encoder(1.0, 4.0)
    edges = buffers(4)
    edges.clocks[:2] = 5, 9
    moment, interval = Moment(Motion(0.5, 1.0), locate(encoder, 0.5), 2), Interval(span(UNIT, 1.0), 10, 4)
    assert advance(Rigid(UNIT, None), encoder, moment, 0.0, interval, edges).n_edges == 3
    assert edges.clocks.tolist() == [5, 9, 12, 0]


@pytest.mark.parametrize(
    ("phase", "duty"), [(0.95, 0.0), (-0.95, 0.0), (0.0, 0.95), (0.0, -0.95), (-0.9, 1.8), ((0, 0.9, 0.1, 0), 0.0)]
)
def test_the_largest_errors_are_accepted(phase, duty):
    order = offsets(phase, duty)
    places = [kind + offset for kind, offset in enumerate(order)]
    assert np.diff([*places, places[0] + 4]).min() >= MARGIN - 4 * U


REFUSED = [(0.96, 0.0), (-0.96, 0.0), (0.0, 0.96), (0.0, -0.96), (0.5, 0.5), (0.5, -0.5)]
REFUSED += [((0, 0.5, -0.46, 0), 0.0), ((0, 0, 0, 1), 0.0), ((0, 0, 0), 0.0), (float("nan"), 0.0), (0.0, float("inf"))]


@pytest.mark.parametrize(("phase", "duty"), REFUSED)
def test_edges_out_of_order_are_refused(phase, duty):
    with pytest.raises(ValueError, match=r"phase_error_counts.* not \(.*\)$"):
        offsets(phase, duty)


def replay() -> str:
    """Return the exact outcome of a few hundred intervals with turns, sticking and shared clocks, as text."""
    rng = np.random.default_rng(13)
    lines = []
    for coulomb in (None, Coulomb(0.2)):
        for viscous in (0.0, 0.01, 3.0):
            handle, encoder = Handle(0.35, viscous), Encoder(0.003, CLOCK_HZ, offsets(0.2, 0.1))
            plant, length = Rigid(handle, coulomb), span(handle, 10 / CLOCK_HZ)
            motion, cell = Motion(0.1, 0.5), locate(encoder, 0.1)
            for clock in range(0, 400, 10):
                edges = stamps, words = buffers(1000)
                moment, interval = Moment(motion, cell, 0), Interval(length, clock, 10)
                motion, cell, n_edges = advance(plant, encoder, moment, float(rng.normal()), interval, edges)
                lines.append(
                    f"{[float(v).hex() for v in motion]} {int(cell.number)} {stamps[:n_edges]} {words[:n_edges]}"
                )
    return "\n".join(lines)


def test_plain_python_gives_the_same_bits():
    outcome = subprocess.run(
        [sys.executable, "-c", "from test_encoder import replay; print(replay())"],
        env={**os.environ, "NUMBA_DISABLE_JIT": "1", "PYTHONPATH": str(Path(__file__).parent.parent)},
        cwd=Path(__file__).parent,
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    assert outcome.strip() == replay()
