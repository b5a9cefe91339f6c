"""The registries of drive stages: every stage of the model has its hardware, and each promises its safe pins."""

import pytest

from hardwall.hdl.drive import registry as hardware
from hardwall.model.drive import registry
from stimuli.stages import STAGES, axis


def test_a_stage_has_a_design_and_a_component_under_its_name():
    assert list(registry.STAGES) == list(hardware.STAGES)
    assert [design.stage_class.name for design in registry.STAGES.values()] == list(registry.STAGES)


@pytest.mark.parametrize("name", STAGES)
def test_a_design_is_that_of_its_stage(name):
    spec = axis(name)
    block = hardware.block_of(spec.drive)
    assert type(spec.drive) is registry.STAGES[spec.stage.name]
    assert type(block) is hardware.STAGES[spec.stage.name]
    assert block.latency == spec.drive.latency
    assert {pin for pin, member in block.signature.members.items() if member.flow.name == "Out"} == set(spec.drive.pins)
    assert spec.drive.safe_latency == 1
    assert any(pin in spec.drive.safe or "all" in spec.drive.safe for pin in spec.drive.pins)
