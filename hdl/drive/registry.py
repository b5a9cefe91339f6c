"""The components of the drive stages, by the names of `hardwall.model.drive.registry`; one line each."""

from hardwall.model.drive.stage import StageDesign

from ..block import Block
from . import dac, pdm, pwm

STAGES: dict[str, type[Block]] = {
    "pdm": pdm.Pdm,
    "pwm": pwm.Pwm,
    "dac": dac.Dac,
}


def block_of(design: StageDesign) -> Block:
    """Return the component of a design."""
    return STAGES[design.stage.name](design)
