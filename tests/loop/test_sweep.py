"""Samples that are swept, against the same samples edge by edge: equal to the bit, in every state that is left."""

import numpy as np
import pytest

from hardwall.model.axis.design import change_of
from hardwall.model.encoder import quadrature
from hardwall.model.stamped import room_for
from hardwall.sim.loop import loop
from hardwall.sim.loop.backends import number_of, opened
from hardwall.sim.loop.sweep import sweep
from hardwall.sim.loop.values import EDGE_CAPACITY, Memory, Progress
from hardwall.sim.scene.build import start_of, sweep_of, world_of
from hardwall.sim.scene.load import load
from hardwall.sim.walls import hit
from hardwall.sim.world.advance import Moment
from hardwall.sim.world.encoder import edge, level, locate
from hardwall.sim.world.rigid import Motion
from hardwall.testing import SEED
from stimuli.lengths import LONG
from stimuli.outputs import EVERY_OUTPUT
from stimuli.scenes import HAND, ONE_SECOND

HISTORY = {"stamp_a_rise", "stamp_b_rise", "stamp_a_fall", "stamp_b_fall", "edge", "down", "run"}
"""What a decoder that was left at rest does not know of the edges before: no estimator that is swept looks at it."""
NEAR = {"protocol.start_m": -2e-3} | ONE_SECOND
"""A way of 2000 counts to the wall, and what comes of it."""


def parts(value, name: str = ""):
    """Yield (name, value) of every part of nested tuples that a swept sample must leave as it would be."""
    if isinstance(value, tuple):
        for key, part in zip(getattr(value, "_fields", range(len(value))), value, strict=True):
            if not (isinstance(value, quadrature.State) and key in HISTORY):
                yield from parts(part, f"{name}.{key}")
    else:
        yield name, value


class Run:
    """The loop of a scene on a model, in pieces."""

    def __init__(self, scene, backend: str, swept: bool):
        self.world, self.scene = world_of(scene), scene
        self.at = start_of(scene, self.world)
        with opened(scene.spec, backend, scene.parameters, int(level(self.at.moment.cell.number))) as axis:
            self.controller, self.state, _ = axis
        constants = sweep_of(scene, self.world, self.controller)
        assert constants is not None
        self.world = self.world._replace(sweep=constants if swept else None)
        number = number_of(backend)
        delay = np.zeros(scene.delay_samples, number) if scene.delay_samples else None
        room = np.zeros(scene.samples), np.zeros(scene.samples, number)
        self.memory = Memory(room_for(EDGE_CAPACITY), delay, None, None, *room)

    def to(self, until: int) -> None:
        """Go on to a sample, and keep what was between in the arrays."""
        first = self.at.sample
        rest = self.memory._replace(positions=self.memory.positions[first:], drives=self.memory.drives[first:])
        self.state, self.at = loop.run(self.world, self.controller, self.state, self.at, rest, until)

    def left(self) -> list[tuple]:
        """Return all that the run leaves, by name."""
        edges = [tuple(array[: max(self.at.moment.n_edges, 0)]) for array in self.memory.edges]
        return [*parts((self.state, self.at, tuple(edges)))]


def assert_equal(swept: Run, by_edges: Run) -> None:
    for (name, one), (_, other) in zip(swept.left(), by_edges.left(), strict=True):
        assert np.array_equal(one, other), name
    end = swept.at.sample
    for array in ("positions", "drives"):
        assert np.array_equal(getattr(swept.memory, array)[:end], getattr(by_edges.memory, array)[:end]), array


def compare(scene, backend: str, ends: list[int]) -> Run:
    """Run a scene both ways, in pieces that end there; compare them at each end; return the run that was swept."""
    swept, by_edges = (Run(scene, backend, way) for way in (True, False))
    for until in ends:
        swept.to(until)
        by_edges.to(until)
        assert_equal(swept, by_edges)
    return swept


NO_STAMPS = [
    (name, output)
    for name, output in EVERY_OUTPUT
    if not load("seed-2011", {"controller.estimator": name}).spec.design.estimator.uses_stamps()
]
EVERY = [(*estimator, backend) for estimator in NO_STAMPS for backend in ("fixed", "float")]
FEW = [("levant", "u1", "fixed"), ("levant", "u1", "float")]


@pytest.mark.parametrize(("estimator", "output", "backend"), EVERY if LONG else FEW)
def test_a_hit_is_the_same(estimator, output, backend):
    scene = load("seed-2011", NEAR | {"controller.estimator": estimator, "controller.output": output})
    compare(scene, backend, [scene.samples])


def drawn(random: np.random.Generator) -> dict:
    """Return changes of `seed-2011` for a hit with sweeps of many kinds."""
    clocks = int(random.integers(60, 3000))
    sample_hz = int(random.choice([2_000, 10_000, 40_000]))
    return {
        "controller.clock_hz": clocks * sample_hz,
        "controller.sample_hz": sample_hz,
        "controller.actuation_hz": sample_hz // int(random.choice([1, 2, 10])),
        "controller.glitch_clocks": int(random.integers(0, 4)),
        "controller.speed_max_m_per_s": 0.05,
        "encoder.count_m": float(random.choice([1e-6, 3e-7, 5e-6])),
        "encoder.phase_error_counts": float(random.uniform(-0.4, 0.4)),
        "encoder.duty_error_counts": float(random.uniform(-0.15, 0.15)),
        "handle.coulomb_n": float(random.choice([0.02, 0.1])),
        "handle.viscous_n_s_per_m": float(random.choice([0.0, 1.0, 10.0])),
        "protocol.start_m": -float(random.uniform(2e-4, 5e-3)),
        "protocol.push_n": float(random.choice([0.4, 2.0, 8.0])),
        "wall.stiffness_n_per_m": float(random.choice([300.0, 10e3, 60e3])),
        "wall.damping_n_s_per_m": float(random.choice([0.0, 20.0, 150.0])),
        "amplifier.delay_s": float(random.choice([0.0, 1.0])) / sample_hz,
    }


@pytest.mark.parametrize("number", range(60 if LONG else 12))
def test_whatever_the_hit(number):
    """Light and heavy pushes, soft walls that throw the handle back, poor encoders, and calls that end anywhere."""
    random = np.random.default_rng([SEED, number])
    scene = load("seed-2011", ONE_SECOND | drawn(random))
    ends = sorted({*(int(each) for each in random.integers(1, scene.samples, 40)), scene.samples})
    compare(scene, "fixed", ends)


ON_A_POOR_SCALE = {
    "edges of their own": {"encoder.edge_error_counts": 0.1},
    "cycles": {"encoder.cycles": [{"edges": 16, "error_counts": 0.2}, {"edges": 3, "error_counts": 0.1}]},
    "a disk out of its centre": {"encoder.counts_per_turn": 400, "encoder.eccentricity_counts": 12.0},
    "all": {
        "encoder.edge_error_counts": 0.05,
        "encoder.cycles": [{"edges": 16, "error_counts": 0.1, "phase": 0.3}],
        "encoder.counts_per_turn": 4000,
        "encoder.eccentricity_counts": 10.0,
        "encoder.phase_error_counts": 0.1,
    },
}


@pytest.mark.parametrize("name", ON_A_POOR_SCALE)
def test_a_hit_on_a_scale_with_errors_is_the_same(name):
    scene = load("seed-2011", NEAR | ON_A_POOR_SCALE[name] | {"protocol.push_n": 2.0})
    compare(scene, "fixed", [700, scene.samples])


FREE = {"wall.stiffness_n_per_m": 0.0, "protocol.push_n": 2.0}


def moving(changes: dict | None = None) -> Run:
    """Return a run whose handle moves freely, faster than a count a sample."""
    run = Run(load("seed-2011", FREE | (changes or {})), "fixed", True)
    run.to(300)
    assert run.at.moment.motion.velocity_m_per_s > 2 * run.world.sweep.least_m_per_s
    return run


def swept_from(run: Run, position_m: float, velocity_m_per_s: float, force_n: float, samples: int = 1) -> int:
    """Return how many samples are swept from a motion at the change of the drive after the run's last sample."""
    first = run.at.sample - 1
    changed = change_of(run.world.timing, first)
    state = run.state._replace(clock=changed)
    moment = Moment(Motion(position_m, velocity_m_per_s), locate(run.world.encoder, position_m), 0)
    at = Progress(first, moment, force_n, (moment.motion,))
    _, end = sweep(run.world.sweep, run.world, run.controller, state, at, run.memory, first, first + 1 + samples)
    return end.sample - first


def test_a_free_handle_is_swept_to_the_end_of_the_call():
    run = moving()
    assert swept_from(run, -0.03, 0.1, 0.2, 200) == 200


def test_a_handle_that_turns_is_not_swept():
    run = moving()
    mass_kg, sample_s = run.scene.handle.mass_kg, 1 / run.scene.spec.sample_hz
    braked_n = -mass_kg * 0.02 / sample_s
    assert swept_from(run, -0.03, 0.02, braked_n, 1) == 0
    assert swept_from(run, -0.03, 0.021, braked_n, 1) == 1
    assert swept_from(run, -0.03, 0.0, 0.0, 1) == 0


def test_a_handle_near_the_decoders_limit_is_not_swept():
    run = moving()
    most = run.world.sweep.most_m_per_s
    assert swept_from(run, -0.03, 0.99 * most, 0.2) == 1
    assert swept_from(run, -0.03, 1.001 * most, 0.2) == 0
    # It is accelerated beyond the limit within the sample.
    assert swept_from(run, -0.03, 0.999 * most, 40.0, 1000) < 1000


@pytest.mark.parametrize("phase_error", [0.0, 0.3])
def test_a_position_that_is_counted_close_to_an_edge_is_not(phase_error):
    run = moving({"encoder.phase_error_counts": phase_error})
    count_m, constants = run.scene.spec.count_m, run.world.sweep
    velocity, travel_m = 0.1, 0.1 * constants.until_counted.coast_s
    friction_n = run.scene.handle.coulomb_n
    for number in range(-30_000, -29_996):
        at_edge_m = edge(run.world.encoder, number)
        for counts, swept in ((0.0, 0), (3e-7, 0), (-3e-7, 0), (1e-5, 1), (-1e-5, 1)):
            assert swept_from(run, at_edge_m - travel_m + counts * count_m, velocity, friction_n) == swept, counts


def test_far_from_zero_rounding_counts_too():
    """At 10^9 counts a position has 20 bits behind the point."""
    run = moving()
    at_edge_m, count_m = edge(run.world.encoder, 10**9), run.scene.spec.count_m
    velocity, travel_m = 0.1, 0.1 * run.world.sweep.until_counted.coast_s
    for counts, swept in ((5e-6, 0), (1e-4, 1)):
        start_m = at_edge_m - travel_m + counts * count_m
        assert swept_from(run, start_m, velocity, run.scene.handle.coulomb_n) == swept, counts


BOTH_AT_ONCE = ((-1, 1), (-1, 3))
"""Both channels in one clock, which is illegal; as the clock relative to the changed drive, and the pins that moved."""
SHORT_PULSE = ((-1, 1), (0, 3), (1, 2))
"""A pulse of A that a filter of two clocks rejects, with an edge of B in it: the edges came too fast."""
ONE_BY_ONE = ((-11, 1), (-1, 3))


@pytest.mark.parametrize("before", [0, 1])
@pytest.mark.parametrize(("edges", "swept"), [(BOTH_AT_ONCE, 0), (SHORT_PULSE, 0), (ONE_BY_ONE, 8)])
def test_a_fault_that_is_under_way_is_raised_before_anything_is_swept(edges, swept, before):
    """Edges which the decoder has not all counted when the drive changes, and a slow handle behind them.

    A second illegal change raises no flag that is not up already, but it is counted.
    """
    run = moving()
    assert run.controller.glitch_clocks == 2
    first = run.at.sample - 1
    changed = change_of(run.world.timing, first)
    motion = Motion(-0.03, 0.1)
    moment = Moment(motion, locate(run.world.encoder, -0.03), len(edges))
    for place, (clock, moved) in enumerate(edges):
        run.memory.edges.clocks[place], run.memory.edges.levels[place] = changed + clock, run.state.level ^ moved
    rest = quadrature.resting(run.controller.decoder, run.state.decoder, 0, run.state.level, 1)
    rest = rest._replace(illegal=before, illegal_count=before)
    state = run.state._replace(decoder=rest, clock=changed - 20)
    at = Progress(first, moment, 0.2, (motion,))
    _, end = sweep(run.world.sweep, run.world, run.controller, state, at, run.memory, first, first + 9)
    assert end.sample - first == swept


def test_what_would_be_lost_edge_by_edge_is_not_swept():
    slow = {"controller.clock_hz": 100_000_000, "controller.sample_hz": 1000, "controller.actuation_hz": 1000}
    fine = {"encoder.count_m": 1e-7, "controller.glitch_clocks": 0, "controller.speed_max_m_per_s": 1.0}
    run = Run(load("seed-2011", slow | fine), "fixed", True)
    assert run.world.sweep.most_m_per_s / 1e-7 / 1000 < EDGE_CAPACITY / 3


def test_the_speed_at_the_limit_leaves_edges_apart():
    """Just below it, on a poor encoder, every edge is decoded by itself: the same state as edge by edge."""
    for phase_error in (-0.45, 0.0, 0.45):
        errors = {"encoder.phase_error_counts": phase_error, "encoder.duty_error_counts": 0.08}
        quick = {"controller.speed_max_m_per_s": 0.05, "handle.viscous_n_s_per_m": 0.0}
        scene = load("seed-2011", FREE | errors | ONE_SECOND | quick)
        swept, by_edges = (Run(scene, "fixed", way) for way in (True, False))
        motion = Motion(-0.03, 0.999 * swept.world.sweep.most_m_per_s)
        for run in (swept, by_edges):
            cell = locate(run.world.encoder, motion.position_m)
            count = quadrature.wrap(cell.number, run.controller.decoder.count_width)
            pins = int(level(cell.number))
            decoder = quadrature.resting(run.controller.decoder, run.state.decoder, count, pins, 1)
            run.state = run.state._replace(decoder=decoder, level=pins)
            run.at = Progress(0, Moment(motion, cell, 0), run.scene.handle.coulomb_n, (motion,))
            run.to(50)
        assert_equal(swept, by_edges)


@pytest.mark.parametrize("invert", [0, 1])
def test_a_count_that_wraps_and_one_that_counts_the_other_way(invert):
    scene = load("seed-2011", FREE | ONE_SECOND | {"controller.travel_m": 1e-3, "protocol.start_m": -1e-3})
    swept, by_edges = (Run(scene, "fixed", way) for way in (True, False))
    for run in (swept, by_edges):
        run.controller = run.controller._replace(invert=invert)
        run.to(4000)
    assert abs(swept.at.moment.cell.number) > 2 << swept.controller.decoder.count_width
    assert_equal(swept, by_edges)


def test_what_cannot_be_swept_has_no_sweep():
    def constants(changes: dict, backend: str = "fixed"):
        scene = load("seed-2011", changes)
        with opened(scene.spec, "fixed", scene.parameters, 0) as axis:
            return sweep_of(scene, world_of(scene), axis.controller if backend == "fixed" else object())

    assert constants({}) is not None
    assert constants({}, "rtl") is None
    assert constants({"controller.estimator": "levant-edge"}) is None
    assert constants(HAND) is None
    # The pins are not those of the place: the way there, or the time, counts.
    assert constants({"encoder.edge_error_counts": 0.05}) is not None
    for keys in (
        {"hysteresis_counts": 0.2},
        {"jitter_s": 1e-8},
        {"glitches_hz": 1.0, "glitch_s": 1e-6},
        {"dead": "a", "dead_s": 3.0},
    ):
        assert constants({f"encoder.{key}": value for key, value in keys.items()}) is None
    close = {"controller.sample_hz": 100_000, "controller.actuation_hz": 100_000, "controller.glitch_clocks": 2}
    close |= {"controller.speed_max_m_per_s": 0.1}
    latency = load("seed-2011", close | {"controller.clock_hz": 4_000_000}).spec.design.latency_to_drive
    tight = (latency + quadrature.LATENCY + 2) * 100_000
    assert constants(close | {"controller.clock_hz": tight}) is None


def test_a_hit_ends_like_its_samples_by_edges(monkeypatch):
    scene = load("seed-2011", NEAR)
    swept = hit.run(scene, "fixed", traces=True)
    monkeypatch.setattr(hit, "sweep_of", lambda *_: None)
    by_edges = hit.run(scene, "fixed", traces=True)
    for trace in ("overview", "detail"):
        for name, values in vars(getattr(swept, trace)).items():
            assert np.array_equal(values, getattr(getattr(by_edges, trace), name)), name
    assert swept.report() | {"seconds": 0, "samples_per_s": 0} == by_edges.report() | {"seconds": 0, "samples_per_s": 0}
