"""Scenes with more parts than a handle: accepted keys, the devices that they make, and refused values."""

import numpy as np
import pytest

from hardwall.sim.jobs.store import sources
from hardwall.sim.scene.build import device_of, start_of, work_of, world_of
from hardwall.sim.scene.errors import SceneError
from hardwall.sim.scene.load import load, read
from hardwall.sim.walls import hit
from hardwall.sim.walls.hit_rows import row_of
from hardwall.sim.walls.mapping import verdict
from hardwall.sim.world.converter import AS_IT_IS, Converter, Pulse
from hardwall.sim.world.device import Device, Hand, Motor, Shunt, Transmission, train
from hardwall.sim.world.rigid import Rigid
from hardwall.sim.world.taylor import Train
from stimuli.hit_paths import path_of
from stimuli.scenes import AMPLIFIER, CABLE, DRIVE, HAND, ONE_SECOND, PULSES, SHUNT


def test_every_key_of_a_scene_reaches_the_device():
    limits = {"amplifier.current_limit_a": 15.0, "transmission.motor_viscous_n_s_per_m": 0.5}
    sides = {"transmission.encoder_at": "motor", "handle.viscous_n_s_per_m": 0.7}
    parts = AMPLIFIER | CABLE | HAND | DRIVE | SHUNT | PULSES | limits | sides
    assert device_of(load("seed-2011", parts)) == Device(
        mass_kg=0.35,
        viscous_n_s_per_m=0.7,
        coulomb_n=0.1,
        bandwidth_hz=400.0,
        force_limit_n=60.0,
        motor=Motor(2.0, 1e-3, 0.04, 24.0, 0.01),
        transmission=Transmission(2e5, 10.0, 0.05, 0.5),
        hand=Hand(0.2, 3.0, 10.0, 1e-3),
        encoder_at_motor=True,
        pulse=Pulse(50.0, 600, 2),
        shunt=Shunt(3.0, 2e-3),
    )
    alone = AMPLIFIER | DRIVE | {"motor.damping_resistance_ohm": 3.0}
    assert device_of(load("seed-2011", alone)).shunt == Shunt(3.0)
    assert device_of(load("seed-2011", AMPLIFIER | DRIVE)).shunt is None


@pytest.mark.parametrize(("parts", "more"), [({}, None), (SHUNT, None), (CABLE, None), (CABLE | SHUNT, (0.0, 0.0))])
def test_only_a_cable_with_a_damping_circuit_makes_a_state_of_more_parts(parts, more):
    """What a scene lacks is not in the compiled loop."""
    scene = load("seed-2011", AMPLIFIER | DRIVE | parts)
    world = world_of(scene)
    assert world.plant.tables.shape == ((9, 10, 9) if more else (9, 8, 7))
    assert start_of(scene, world).moment.motion.more == more


@pytest.mark.parametrize(
    "parts", [AMPLIFIER, CABLE, HAND, DRIVE, PULSES], ids=["amplifier", "cable", "hand", "motor", "pwm"]
)
def test_a_part_makes_a_device_and_nothing_else_does(parts):
    assert isinstance(world_of(load("seed-2011", parts)).plant, Train)
    plain = {"amplifier.delay_s": 2e-3, "output.full_scale_n": 50.0, "output.dac_bits": 10}
    assert device_of(load("seed-2011", plain)) is None
    assert isinstance(world_of(load("seed-2011", plain)).plant, Rigid)


def test_a_converter_s_codes_span_its_full_scale():
    scene = load("seed-2011", {"output.full_scale_n": 32.0, "output.dac_bits": 6})
    world = world_of(scene)
    assert world.converter == Converter(1.0, -32, 31)
    assert start_of(scene, world).force_n == 0.0, "the push is less than half a step"
    assert world_of(load("seed-2011", {})).converter is None


def test_pulses_begin_with_the_push():
    scene = load("seed-2011", PULSES | {"protocol.push_n": 25.0})
    world = world_of(scene)
    assert world.plant.pulse == Pulse(50.0, 600, 2)
    assert start_of(scene, world).moment.motion.width == 450
    assert device_of(load("seed-2011", AMPLIFIER)).pulse == AS_IT_IS


def test_coarse_steps_of_the_output_are_felt():
    """A push that a coarse converter rounds off moves nothing; fine steps move the handle as without a converter."""

    def start(changes):
        return path_of(load("seed-2011", ONE_SECOND | changes), "fixed")[0][:3000]

    exact = start({})
    assert np.ptp(start({"output.full_scale_n": 32.0, "output.dac_bits": 6})) == 0.0
    fine = start({"output.full_scale_n": 32.0, "output.dac_bits": 24})
    assert np.abs(fine - exact).max() < 2e-6 / 0.35 * 0.3**2 / 2  # half a step of force, integrated
    assert (fine != exact).any()


def test_pulses_push_as_their_mean_does():
    """Under a push of one step, the velocity is always within half a pulse's effect of that under the push alone."""
    push = {"handle.coulomb_n": None, "protocol.push_n": 100.0 / 300}
    scene = load("seed-2011", ONE_SECOND | push | PULSES)
    pulsed, handle = hit.run(scene, "float", traces=True).overview, scene.handle
    free = pulsed.time_s < 0.3
    assert pulsed.position_m[free].max() < -0.01, "not yet at the wall"
    b, m = handle.viscous_n_s_per_m, handle.mass_kg
    exact = scene.protocol.push_n / b * -np.expm1(-b / m * pulsed.time_s)
    apart = np.abs(pulsed.velocity_m_per_s - exact)[free]
    assert 0 < apart.max() < 50.0 / 0.35 * 25e-6 * 1.01


def test_a_handle_that_never_comes_to_the_wall_proves_no_wall_stable():
    """The converter rounds the push to nothing."""
    changes = ONE_SECOND | {"output.full_scale_n": 40.0, "output.dac_bits": 4}
    result = hit.run(load("seed-2011", changes), "fixed")
    assert result.rms_m < 1e-15
    assert not result.touched
    assert not result.stable
    assert ["verdict", "never touched"] in result.tables()[0].rows
    assert ["rms_mm", "-"] in result.tables()[0].rows
    assert row_of("a", result.report())[3:5] == ["never touched", "-"]
    job = {
        "scene": "seed-2011",
        "text": read("seed-2011"),
        "sources": sources(),
        "changes": changes,
        "backend": "fixed",
    }
    told = r"^the handle did not reach the wall: no verdict on the wall K 1000, B 10 with levant$"
    with pytest.raises(RuntimeError, match=told):
        verdict(**job, wall=(1e3, 10.0), start=None)


def test_a_chunk_shrinks_by_the_work_of_a_sample():
    """At 12 MHz, with 10 kHz samples and a 20 kHz carrier, both periods in a sample begin and end a pulse."""
    assert work_of(world_of(load("seed-2011", {}))) == 1
    legs = work_of(world_of(load("seed-2011", CABLE)))
    leg_s = train(device_of(load("seed-2011", CABLE)), 1e-4).leg_s
    assert legs == 1 + int(1e-4 / leg_s) > 1
    assert work_of(world_of(load("seed-2011", CABLE | PULSES))) == legs + 2 * 2
    assert work_of(world_of(load("seed-2011", CABLE | {"solver.step_s": 2e-6}))) == 1 + 50


REFUSED = {
    "amplifier.bandwidth_hz must be a number of 0.001 to 1e+09, not 0.0": {"amplifier.bandwidth_hz": 0.0},
    "amplifier.current_limit_a needs amplifier.bandwidth_hz and a section motor": {"amplifier.current_limit_a": 1.0},
    "motor.inductance_h is missing": {key: value for key, value in DRIVE.items() if "inductance" not in key},
    "motor.damping_resistance_ohm must be a number of 0.001 to 1e+06, not 0.0":
        AMPLIFIER | DRIVE | {"motor.damping_resistance_ohm": 0.0},
    "motor.damping_capacitance_f must be a number of 1e-12 to 1000, not 2000.0":
        AMPLIFIER | DRIVE | SHUNT | {"motor.damping_capacitance_f": 2e3},
    "motor.damping_capacitance_f needs motor.damping_resistance_ohm":
        AMPLIFIER | DRIVE | {"motor.damping_capacitance_f": 2e-3},
    "motor.damping_resistance_ohm needs amplifier.bandwidth_hz": DRIVE | SHUNT,
    "motor.damping_resistance_ohm needs amplifier.bandwidth_hz, a current loop":
        DRIVE | SHUNT | {"amplifier.delay_s": 1e-3},
    "transmission.stiffness_n_per_m must be a number of 1e-06 to 1e+10, not -1.0":
        CABLE | {"transmission.stiffness_n_per_m": -1.0},
    "transmission.encoder_at must be one of handle, motor, not 'wall'": CABLE | {"transmission.encoder_at": "wall"},
    "hand.mass_kg must be a number of 0 to 1000, not -0.1": HAND | {"hand.mass_kg": -0.1},
    "hand.stifness_n_per_m is not a key of a scene; did you mean stiffness": HAND | {"hand.stifness_n_per_m": 1.0},
    "output must have dac_bits, or pwm_carrier_hz and pwm_steps": {"output.full_scale_n": 40.0},
    "output must have dac_bits, or pwm_carrier_hz and pwm_steps, and not both": PULSES | {"output.dac_bits": 8},
    "output.dac_bits must be a whole number of 2 to 32, not 1": {"output.full_scale_n": 40.0, "output.dac_bits": 1},
    "output.pwm_carrier_hz must be controller.clock_hz 12000000 divided by": PULSES | {"output.pwm_carrier_hz": 7000},
    "output.full_scale_n must be at most 32 N with pulses, all that the amplifier's current":
        AMPLIFIER | DRIVE | PULSES | {"amplifier.current_limit_a": 8.0},
    "output.pwm_steps must divide the 600 clocks of a carrier's period, not 7": PULSES | {"output.pwm_steps": 7},
    "handle, amplifier, motor, transmission and hand must change at no more than 2.5e+08 1/s together":
        CABLE | {"transmission.motor_mass_kg": 1e-6, "transmission.damping_n_s_per_m": 1e4},
}  # fmt: skip


@pytest.mark.parametrize("message", REFUSED)
def test_what_cannot_be_is_refused_in_a_line(message):
    with pytest.raises(SceneError) as refusal:
        load("seed-2011", REFUSED[message])
    assert str(refusal.value).startswith(f"seed-2011: {message}")
    assert "\n" not in str(refusal.value)
