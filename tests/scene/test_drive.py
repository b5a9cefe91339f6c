"""The section `drive` of a scene: the stage that follows, newtons, and one line for what does not fit."""

import pytest

from hardwall.model.axis.registers import RegisterMap
from hardwall.model.axis.supervised import Design
from hardwall.model.drive import dac, pdm, pwm
from hardwall.sim.scene.build import output_step_n, world_of
from hardwall.sim.scene.drive import AMPLIFIER, NEEDED, DriveSection
from hardwall.sim.scene.errors import SceneError
from hardwall.sim.scene.load import load

VOLTS = {"drive.newtons_per_volt": 2.0, "drive.full_scale_v": 24.0}
AMPERES = {"drive.newtons_per_ampere": 8.0, "drive.full_scale_a": 6.0}
PDM = VOLTS | {"drive.stage": "pdm"}
PWM = VOLTS | {"drive.stage": "pwm", "drive.pwm_hz": 50_000, "drive.dead_time_s": 100e-9}
DAC = AMPERES | {"drive.stage": "dac", "drive.dac_bits": 12, "drive.dac_serial_hz": 25_000_000}


def test_without_the_section_the_board_has_pulses_of_its_force_format():
    scene = load("mhz")
    assert scene.spec.stage == pdm.Stage()
    assert "stage" not in scene.spec.facts
    assert scene.spec.drive.full_scale_n == pytest.approx(65.536)
    assert output_step_n(scene) == 0.0
    assert world_of(scene).converter is None


def test_the_stages_are_those_of_the_model():
    for changes, design, newtons in ((PDM, pdm.Design, 48.0), (PWM, pwm.Design, 48.0), (DAC, dac.Design, 48.0)):
        spec = load("mhz", changes).spec
        assert type(spec.drive) is design
        assert spec.drive.full_scale_n == newtons
        assert spec.facts["stage"] == spec.stage
    assert set(NEEDED) == {pdm.Stage.name, pwm.Stage.name, dac.Stage.name}


def test_every_key_of_a_dac_reaches_it():
    keys = {"coding": "twos-complement", "header_bits": 4, "header": 3, "trailing_bits": 2, "mode": 2}
    more = {f"drive.dac_{key}": value for key, value in keys.items()} | {"drive.dac_setup": [7, 8]}
    stage = load("mhz", DAC | more | {"drive.offset_a": -0.5, "drive.inverted": True}).spec.stage
    assert {key: getattr(stage, key) for key in keys} == keys
    assert stage.setup == (7, 8)
    assert (stage.amplifier.offset, stage.amplifier.inverted, stage.amplifier.unit) == (-0.5, True, "A")
    own = {name for name in DriveSection.model_fields if name.startswith("dac_")}
    assert own == {f"dac_{name}" for name in dac.Stage.__dataclass_fields__ if name not in ("amplifier", "name")}
    assert {key for keys in AMPLIFIER.values() for key in keys} < set(DriveSection.model_fields)


def test_the_stage_is_part_of_the_identity_and_its_polarity_is_the_reset_of_the_word():
    specs = [load("mhz", changes).spec for changes in ({}, PDM, PWM, DAC, PWM | {"drive.inverted": True})]
    assert len({RegisterMap(spec).identity for spec in specs}) == len(specs)
    resets = [{word.name: word.reset for word in Design(spec).live}["drive_invert"] for spec in specs]
    assert resets == [0, 0, 0, 0, 1]


def test_the_world_has_the_steps_of_the_stage():
    scene = load("mhz", DAC | {"drive.offset_a": 0.5})
    converter, step_n = world_of(scene).converter, 48 / 2**11
    assert converter.step_n == output_step_n(scene) == step_n
    # The offset of 0.5 A is 171 codes.
    assert (converter.lowest, converter.highest) == (171 - 2**11, 2**11 - 1 - 171)
    scene = load("mhz", PWM)
    assert world_of(scene).converter == (48 / 1000, -985, 985)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"drive.stage": "pwm"}, "drive must have newtons_per_volt and full_scale_v, or newtons_per_ampere and"),
        (
            PWM | AMPERES,
            "drive must have newtons_per_volt and full_scale_v, or newtons_per_ampere and full_scale_a, and",
        ),
        (DAC | {"drive.offset_v": 1.0}, "drive must have newtons_per_volt and full_scale_v, or"),
        (PWM | {"drive.pwm_hz": None}, "drive.pwm_hz is missing"),
        (DAC | {"drive.dac_bits": None}, "drive.dac_bits is missing"),
        (PDM | {"drive.dac_mode": 1}, "drive.dac_mode must be absent, because drive.stage is pdm, not dac"),
        (DAC | {"drive.dead_time_s": 1e-6}, "drive.dead_time_s must be absent, because drive.stage is dac, not pwm"),
        (PWM | {"drive.stage": "relay"}, "drive.stage must be one of pdm, pwm, dac, not 'relay'"),
        (PWM | {"drive.pwm_hz": 60_001}, "drive.pwm_hz must be clock_hz 50000000 divided by a whole number from 8,"),
        (
            PWM | {"drive.full_scale_v": 12.0},
            "controller.force_max_n must be at most 23.64 N, all that the drive stage",
        ),
        (PDM | {"drive.offset_v": 1.0}, "drive.offset_v must be 0 with pulses, not 1.0"),
        (DAC | {"drive.offset_a": 7.0}, "drive.offset_a must be -6 to 6, not 7.0"),
        (DAC | {"drive.dac_header": 1}, "drive.dac_header must be 0 to 0, not 1"),
        (DAC | {"drive.dac_serial_hz": 10**6}, "controller.actuation_hz must be at most 76923, for a frame of the DAC"),
        (DAC | {"drive.dac_setup": [1] * 9}, "drive.dac_setup must be a list of 1 to 8, each a whole number of 0 to"),
        (
            PDM | {"drive.full_scale_v": 1e5, "drive.newtons_per_volt": 1e3},
            "drive.full_scale_v must make a step of the",
        ),
        (PWM | {"output.full_scale_n": 40.0, "output.dac_bits": 8}, "output must be absent beside a section drive"),
    ],
)
def test_what_does_not_fit_is_one_line_with_the_key(changes, message):
    with pytest.raises(SceneError) as refusal:
        load("mhz", changes)
    assert str(refusal.value).startswith(f"mhz: {message}")
    assert "\n" not in str(refusal.value)
