"""The errors of a scale against geometry: places of edges, their distances, waves along it, and hysteresis."""

import math

import numpy as np
import pytest
import scipy

from hardwall.model.stamped import Edges
from hardwall.sim.estimates import motions
from hardwall.sim.world.advance import Interval, Moment, advance
from hardwall.sim.world.device import Device, train
from hardwall.sim.world.encoder import Encoder, edge, level, locate, next_cell, number_at, numbers_from, offsets
from hardwall.sim.world.euler import stepped
from hardwall.sim.world.linear import State
from hardwall.sim.world.rigid import Handle, Motion, Rigid, span
from hardwall.sim.world.scale import CUT_SIGMAS, MOST_COUNTS, WAVES, Scale, Wave, cut_of, spread

COUNT_M, CLOCK_HZ = 1e-6, 1e6
NONE = Wave()
UPWARDS = [0b00, 0b01, 0b11, 0b10]


def scale(sigma=0.0, waves=(), hysteresis=0.0, seed=1) -> Scale:
    cut = cut_of(sigma, sum(map(spread, waves)))
    return Scale(sigma, cut, (*waves, *[NONE] * WAVES)[:WAVES], hysteresis, seed)


def encoder(errors: Scale, four=(0.0, 0.0, 0.0, 0.0)) -> Encoder:
    return Encoder(COUNT_M, CLOCK_HZ, four, errors)


def places(of: Encoder, first: int, number: int) -> np.ndarray:
    """Return the places of edges in counts."""
    return np.array([edge(of, n) for n in range(first, first + number)]) / of.count_m


def displacements(errors: Scale, first: int, number: int) -> np.ndarray:
    return places(encoder(errors), first, number) - np.arange(first, first + number)


@pytest.mark.parametrize("sigma", [0.002, 0.05, 0.1])
def test_single_edges_are_displaced_normally_by_sigma(sigma):
    moved = displacements(scale(sigma), -10_000, 20_000)
    assert moved.std() == pytest.approx(sigma, rel=0.02)
    assert abs(moved.mean()) < 4 * sigma / 20_000**0.5
    assert scipy.stats.kstest(moved / sigma, "norm").pvalue > 1e-3
    assert abs(np.corrcoef(moved[1:], moved[:-1])[0, 1]) < 0.03
    assert abs(np.corrcoef(moved[4:], moved[:-4])[0, 1]) < 0.03
    assert np.abs(moved).max() <= CUT_SIGMAS * sigma + 1e-9


def test_a_scale_is_the_same_again_and_another_with_another_seed():
    first, again, other = (displacements(scale(0.05, seed=seed), 0, 2000) for seed in (1, 1, 2))
    assert (first == again).all()
    assert abs(np.corrcoef(first, other)[0, 1]) < 0.1
    assert displacements(scale(0.05), 1700, 300) == pytest.approx(first[1700:], abs=1e-9)


def test_the_cut_is_4_sigma_or_what_other_errors_leave():
    assert cut_of(0.1, 0.0) == pytest.approx(0.4)
    assert cut_of(0.1, 0.2) == pytest.approx(MOST_COUNTS - 0.2)
    wide = scale(0.2, (Wave(4, 0.2, 0.0),))
    moved = displacements(wide, 0, 40_000) - 0.2 * np.sin(math.tau * np.arange(40_000) / 4)
    assert np.abs(moved).max() == pytest.approx(wide.cut, abs=1e-9)


WORST = [
    (scale(0.2375), offsets()),
    (scale(0.1), offsets(0.2, 0.1)),
    (scale(0.12, (Wave(16, 0.3, 0.2), Wave(5, 0.08, 0.7))), offsets()),
    (scale(0.0, (Wave(4000, 40.0, 0.1), Wave(3, 0.2, 0.4), Wave(2, 0.1, 0.25))), offsets(0.1)),
]


@pytest.mark.parametrize(("errors", "four"), WORST)
def test_edges_keep_their_order_and_the_distance_that_is_promised(errors, four):
    cut = min(errors.cut, MOST_COUNTS - max(map(abs, four)) - sum(map(spread, errors.waves)))
    errors = errors._replace(cut=cut)
    together = max(map(abs, four)) + sum(map(spread, errors.waves)) + cut
    at = places(encoder(errors, four), -30_000, 60_000)
    assert np.diff(at).min() >= 1 - 2 * together - 1e-9
    assert (at[2:] - at[:-2]).min() >= 2 - 2 * together - 1e-9
    assert np.diff(at).min() >= 0.05 - 1e-9


@pytest.mark.parametrize("edges", [2, 3, 4, 16, 20, 77, 4000])
def test_the_spread_of_a_wave_is_half_of_what_any_level_or_distance_changes_by(edges):
    moved = np.array([[0.3 * np.sin(math.tau * (n / edges + phase)) for n in range(edges + 2)] for phase in PHASES])
    one, two = np.abs(np.diff(moved)).max(), np.abs(moved[:, 2:] - moved[:, :-2]).max()
    assert max(one, two) / 2 == pytest.approx(spread(Wave(edges, 0.3, 0.0)), rel=2e-3)


PHASES = np.arange(0, 1, 1 / 128)


@pytest.mark.parametrize(("edges", "counts", "phase"), [(16, 0.1, 0.0), (20, 0.05, 0.25), (7, 0.2, 0.9)])
def test_a_cycle_repeats_after_its_edges_with_its_amplitude(edges, counts, phase):
    moved = displacements(scale(waves=(Wave(edges, counts, phase),)), -edges * 20, edges * 40)
    assert moved[edges:] == pytest.approx(moved[:-edges], abs=1e-8)
    lines = np.fft.rfft(moved) / len(moved) * 2
    largest = int(np.argmax(np.abs(lines)))
    assert largest == 40
    assert abs(lines[40]) == pytest.approx(counts, rel=1e-6)
    # The transform's phase is that of a cosine, and the record begins at a whole number of cycles.
    assert math.cos(np.angle(lines[40]) + math.tau * (0.25 - phase)) == pytest.approx(1, abs=1e-9)
    assert np.abs(np.delete(lines, 40)).max() < 1e-8


def test_eccentricity_is_a_sine_once_a_turn():
    """A disk of radius r whose centre is e off shows angle a at about a - (e / r) sin a: 10 counts of 4000."""
    turn = 4000
    moved = displacements(scale(waves=(Wave(turn, 10.0, 0.0),)), 0, 3 * turn)
    radius = turn / math.tau
    angle = np.arange(3 * turn) / radius
    exact = radius * np.arctan2(np.sin(angle), np.cos(angle) - 10.0 / radius)
    shown = np.unwrap(exact / radius) * radius - np.arange(3 * turn)
    # The sine is the disk's first order; the rest is of the order of e^2 / r.
    assert np.abs(moved - shown).max() < 10.0**2 / radius
    assert moved[1000] == pytest.approx(10.0)
    assert moved[3000] == pytest.approx(-10.0)
    assert moved[[0, 2000, 4000]] == pytest.approx(0.0, abs=1e-8)


def test_errors_add_up():
    four, waves = offsets(0.1, 0.06), (Wave(16, 0.05, 0.3), Wave(400, 2.0, 0.5))
    whole = places(encoder(scale(0.02, waves), four), -500, 1000) - np.arange(-500, 500)
    parts = np.array(four)[np.arange(-500, 500) % 4] + displacements(scale(0.02), -500, 1000)
    parts += sum(displacements(scale(waves=(wave,)), -500, 1000) for wave in waves)
    assert whole == pytest.approx(parts, abs=1e-8)


FAR = [0, 10**6, -(10**6), 2**40]


@pytest.mark.parametrize("start", FAR)
@pytest.mark.parametrize(
    "waves", [(), (Wave(16, 0.2, 0.1),), (Wave(4000, 100.0, 0.2),), (Wave(10**9, 5e7, 0.3), Wave(5, 0.1, 0.0))]
)
def test_positions_are_found_among_the_edges_however_far_they_are_displaced(start, waves):
    of = encoder(scale(0.03, waves), offsets(0.1))
    first = locate(of, start * COUNT_M).number
    numbers = np.arange(first - 60, first + 61)
    at = np.array([edge(of, int(n)) for n in numbers])
    assert (np.diff(at) > 0).all()
    for position in (at[:-1] + np.random.default_rng(1).random(120) * np.diff(at)).tolist():
        cell = locate(of, position)
        assert cell.number == numbers[np.searchsorted(at, position, side="right") - 1]
        assert (cell.lower_m, cell.upper_m) == (edge(of, cell.number), edge(of, cell.number + 1))
        assert next_cell(of, cell, True) == locate(of, cell.upper_m)


def walked(of: Encoder, positions: np.ndarray, number: int) -> list[int]:
    """Return the numbers of cells along a way of small steps, by the rule of hysteresis alone."""
    h, found = of.scale.hysteresis * of.count_m, []
    for position in positions.tolist():
        while position >= edge(of, number + 1) + h / 2:
            number += 1
        while position < edge(of, number) - h / 2:
            number -= 1
        found.append(number)
    return found


@pytest.mark.parametrize("hysteresis", [0.2, 1.0, 3.5])
def test_hysteresis_holds_a_cell_until_its_edge_is_passed_by_half_of_it(hysteresis):
    of = encoder(scale(0.05, (Wave(16, 0.1, 0.0),), hysteresis))
    times = np.linspace(0, 1, 20_001)
    positions = COUNT_M * (8 * np.sin(9 * times) + 5 * np.sin(23 * times) + 0.3)
    start = locate(of, positions[0])
    assert number_at(of, positions).tolist() == walked(of, positions, start.number)
    halves = [numbers_from(of, start, positions[:9000])]
    held = start
    while held.number != halves[0][-1]:
        held = next_cell(of, held, held.number < halves[0][-1])
    halves.append(numbers_from(of, held, positions[9000:]))
    assert np.concatenate(halves).tolist() == walked(of, positions, start.number)


def test_a_turn_within_the_hysteresis_shows_no_edge():
    """Up over one edge, and back by less than the dead band: the pins stay; by more, they go back."""
    of = encoder(scale(hysteresis=0.4))
    up, back, farther = (COUNT_M * x for x in (1.25, 0.85, 0.79))
    assert number_at(of, np.array([0.5 * COUNT_M, up, back])).tolist() == [0, 1, 1]
    assert number_at(of, np.array([0.5 * COUNT_M, up, farther])).tolist() == [0, 1, 0]
    assert number_at(of, np.array([0.5 * COUNT_M, 1.19 * COUNT_M])).tolist() == [0, 0]


FULL = scale(0.04, (Wave(16, 0.1, 0.2), Wave(400, 3.0, 0.1)), 0.3)
PATHS = {
    "decaying": motions.DecayingSine(0.2e-3, 30.0, 97.3),
    "sweep": motions.Sweep(1e-4, 20.0, 80.0),
    "stop": motions.Stop(0.02013, 0.0101, 1.97),
}


@pytest.mark.parametrize("name", PATHS)
def test_the_pins_of_a_known_motion_show_the_cells_at_every_clock(name):
    path, of, seconds = PATHS[name], encoder(FULL, offsets(0.05)), 0.03
    found = motions.encoded(path, of, seconds, 2e-4, 0)
    clocks = np.arange(int(seconds * CLOCK_HZ))
    cells = walked(of, np.array([motions.position(path, n / CLOCK_HZ) for n in clocks]), found.start_cell)
    shown = np.concatenate([[found.start_level], found.edges.levels])
    shown = shown[np.searchsorted(found.edges.clocks, clocks, side="right")]
    assert np.flatnonzero(shown != [level(cell) for cell in cells]).tolist() == []
    assert len(found.edges.clocks) > 60


def plants(seconds: float) -> dict:
    """Return a mass of 1 kg in the form of every solver, with its start and the length of an interval."""
    handle = Handle(1.0, 0.0)
    free = train(Device(1.0, bandwidth_hz=1e6), seconds)
    plain = Device(1.0)
    state = State(0.3e-6, 0.02, (0.0, 0.0, 0.0), 0)
    lagging = state._replace(others=(-4.0, 0.0, 0.0))
    return {
        "rigid": (Rigid(handle, None), Motion(0.3e-6, 0.02), span(handle, seconds)),
        "taylor": (free, lagging, seconds),
        "euler": (stepped(train(plain, seconds), plain, 1e-8), state, seconds),
    }


@pytest.mark.parametrize("solver", ["rigid", "taylor", "euler"])
def test_every_solver_passes_the_edges_up_and_back_at_their_times(solver):
    """Braked from 20 mm/s at 4 m/s^2 and thrown back: each edge is passed half the hysteresis beyond its place."""
    clocks, a, v, x0 = 9000, 4.0, 0.02, 0.3e-6
    of = encoder(FULL, offsets(0.05))
    plant, start, length = plants(clocks / CLOCK_HZ)[solver]
    buffers = Edges(np.zeros(1000, np.int64), np.zeros(1000, np.int64))
    first = locate(of, x0)
    moment = advance(plant, of, Moment(start, first, 0), -a, Interval(length, 100, clocks), buffers)
    h, top = FULL.hysteresis * COUNT_M, x0 + v * v / (2 * a)
    upper = [n for n in range(first.number + 1, first.number + 200) if edge(of, n) + h / 2 <= top]
    ups = [(v - math.sqrt(v * v - 2 * a * (edge(of, n) + h / 2 - x0))) / a for n in upper]
    end = x0 + v * clocks / CLOCK_HZ - a * (clocks / CLOCK_HZ) ** 2 / 2
    lower = [n for n in range(upper[-1], first.number - 400, -1) if edge(of, n) - h / 2 > end]
    downs = [(v + math.sqrt(v * v - 2 * a * (edge(of, n) - h / 2 - x0))) / a for n in lower]
    expected = [100 + t * CLOCK_HZ for t in (*ups, *downs)]
    stamps = buffers.clocks[: moment.n_edges]
    assert len(stamps) == len(expected) >= 80
    # A clock sees an edge up to one clock after its passage; Euler's steps are 1e-8 s.
    slack = 0.05 if solver == "euler" else 1e-6
    late = stamps - np.array(expected)
    assert late.min() >= -slack
    assert late.max() <= 1 + slack
    words = [level(first.number), *buffers.levels[: moment.n_edges].tolist()]
    steps = np.diff([UPWARDS.index(word) for word in words]) % 4
    assert steps.tolist() == [1] * len(ups) + [3] * len(downs)
