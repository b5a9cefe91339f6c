"""The section `presliding` of a scene: the plant that follows, a line for what does not fit, and starts of a hit."""

import math

import pytest

from hardwall.model.stamped import room_for
from hardwall.sim.scene.build import start_of, sweep_of, work_of, world_of
from hardwall.sim.scene.errors import SceneError
from hardwall.sim.scene.load import load
from hardwall.sim.scene.presliding_section import OF_LUGRE
from hardwall.sim.walls import hit
from hardwall.sim.walls.starts import start
from hardwall.sim.world.advance import Interval, Moment, advance
from hardwall.sim.world.bristles import Bristled
from hardwall.sim.world.rigid import Rigid, span
from stimuli.bristles import DAHL_KEYS, LUGRE_KEYS
from stimuli.scenes import AMPLIFIER, CABLE, DRIVE, HAND, PULSES


def test_without_the_section_the_plant_is_the_rigid_handle():
    assert type(world_of(load("seed-2011")).plant) is Rigid
    assert load("seed-2011").sticking_n == 0.1


def test_the_plant_has_the_keys():
    plant = world_of(load("seed-2011", DAHL_KEYS)).plant
    assert (plant.handle.mass_kg, plant.coulomb_n, plant.stiffness_n_per_m) == (0.35, 0.1, 1e5)
    assert (plant.damping_n_s_per_m, plant.stribeck) == (0.0, None)
    scene = load("seed-2011", LUGRE_KEYS)
    plant = world_of(scene).plant
    assert (plant.damping_n_s_per_m, plant.stribeck.static_n, plant.stribeck.speed_m_per_s) == (300.0, 0.15, 1e-3)
    assert plant.full_m == pytest.approx(1e-6)
    assert scene.sticking_n == 0.15
    # At the free speed the level is Coulomb's to half of a unit in its last place.
    excess = 0.05 * math.exp(-((plant.stribeck.free_m_per_s / 1e-3) ** 2))
    assert excess == pytest.approx(2.0**-53 * 0.1, rel=1e-9)
    assert world_of(load("seed-2011", LUGRE_KEYS | {"presliding.static_n": 0.1})).plant.stribeck is None
    assert type(plant) is Bristled


def test_bristles_are_never_swept_and_take_a_few_steps():
    scene = load("seed-2011", LUGRE_KEYS)
    world = world_of(scene)
    assert sweep_of(scene, world, None) is None
    assert 2 <= work_of(world) <= 4
    assert work_of(world_of(load("seed-2011", DAHL_KEYS | {"presliding.stiffness_n_per_m": 1e10}))) > 10


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        (DAHL_KEYS | {"handle.coulomb_n": None}, "presliding needs handle.coulomb_n above 0, the level at which the"),
        (DAHL_KEYS | {"handle.coulomb_n": 0.0}, "presliding needs handle.coulomb_n above 0, the level at which the"),
        (LUGRE_KEYS | {"presliding.static_n": 0.09}, "presliding.static_n must be at least handle.coulomb_n, 0.1, "),
        (DAHL_KEYS | {"presliding.model": "stribeck"}, "presliding.model must be one of dahl, lugre, not 'stribeck'"),
        ({"presliding.stiffness_n_per_m": 1e5}, "presliding.model is missing"),
        ({"presliding.model": "dahl"}, "presliding.stiffness_n_per_m is missing"),
        (DAHL_KEYS | {"presliding.stiffness_n_per_m": 0.0}, "presliding.stiffness_n_per_m must be a number of "),
        (DAHL_KEYS | {"presliding.bristles": 1}, "presliding.bristles is not a key of a scene; its section has model"),
        *((LUGRE_KEYS | {f"presliding.{key}": None}, f"presliding.{key} is missing") for key in OF_LUGRE),
        *(
            (DAHL_KEYS | {f"presliding.{key}": 1.0}, f"presliding.{key} must be absent, because presliding.model is ")
            for key in OF_LUGRE
        ),
        *(
            (DAHL_KEYS | parts, "presliding must be absent beside amplifier.bandwidth_hz, motor, transmission, hand, ")
            for parts in (AMPLIFIER, CABLE, HAND, DRIVE, PULSES, {"solver.step_s": 2e-5})
        ),
        (
            DAHL_KEYS | {"presliding.stiffness_n_per_m": 1e10, "handle.mass_kg": 1e-6, "controller.sample_hz": 1000},
            "presliding and handle must change at no more than 2.5e+07 1/s together, 25000 steps of the solver a ",
        ),
        (
            LUGRE_KEYS | {"presliding.stribeck_m_per_s": 1e5},
            "presliding and handle must change at no more than 2.5e+08 1/s together, 25000 steps of the solver ",
        ),
    ],
)  # fmt: skip
def test_what_does_not_fit_is_refused_in_one_line(changes, told):
    with pytest.raises(SceneError) as refusal:
        load("seed-2011", changes)
    assert str(refusal.value).startswith(f"seed-2011: {told}")
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize("keys", [DAHL_KEYS, LUGRE_KEYS], ids=["dahl", "lugre"])
@pytest.mark.parametrize("number", [None, 0, 1, 2, 3])
def test_every_start_is_at_its_place_and_has_been_pushed_from_rest(keys, number):
    """A start with a phase moves as a handle that began at rest, with straight bristles, so much earlier."""
    scene, chosen = load("seed-2011", keys), None if number is None else start(number)
    if chosen:
        scene = scene.hitting(10e3, 20.0, chosen)
    world = world_of(scene)
    begun = start_of(scene, world)
    motion, cell = begun.moment.motion, begun.moment.cell
    assert cell.lower_m <= motion.position_m < cell.upper_m
    if not chosen:
        assert motion == (scene.protocol.start_m, 0.0, 0.0)
        return
    assert (motion.position_m - cell.lower_m) / (cell.upper_m - cell.lower_m) == pytest.approx(chosen.counts, abs=1e-6)
    clocks = round(chosen.periods * scene.spec.clock_hz / scene.spec.actuation_hz)
    rest, length = type(motion)(0.0, 0.0, 0.0), span(world.plant.handle, clocks / scene.spec.clock_hz)
    moment = Moment(rest, begun.moment.cell._replace(lower_m=-1.0, upper_m=1.0), 0)
    pushed = advance(world.plant, world.encoder, moment, begun.force_n, Interval(length, 0, clocks), room_for(1)).motion
    assert motion[1:] == pushed[1:]
    assert motion.velocity_m_per_s > 0
    assert 0 < motion.bend_m <= world.plant.full_m


def test_a_wall_holds_a_handle_up_to_its_static_friction_in_place():
    """Whether a handle rests where its spring alone would hold it is asked with what friction holds at rest."""
    scene = load("seed-2011", LUGRE_KEYS)
    stiffness, push = scene.wall.stiffness_n_per_m, scene.protocol.push_n
    for held_n, in_place in ((0.14, True), (-0.14, True), (0.4, False)):
        found = hit.Hit(
            scene, "fixed", 1, 1.0, mean_m=(push + held_n) / stiffness, rms_m=0.0, offset_m=0.0, drift_m_per_s=0.0,
            judged="stable", touched=True, max_force_n=1.0, flags=[], force_sha256=None,
        )  # fmt: skip
        assert found.in_place == in_place, held_n
