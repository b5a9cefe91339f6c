"""The drive stages, by the name used in scenes; one line each here and in `hdl/drive/registry.py`."""

from ..requirements import AxisRequirements
from . import dac, pdm, pwm
from .stage import Stage, StageDesign

STAGES: dict[str, type[StageDesign]] = {
    "pdm": pdm.Design,
    "pwm": pwm.Design,
    "dac": dac.Design,
}


def design_of(axis: AxisRequirements, stage: Stage) -> StageDesign:
    """Return the design of a stage for an axis.

    Raises:
        TypeError: if a field of the stage is of the wrong type.
        ValueError: if the axis and the stage do not fit; the message names the field.
    """
    return STAGES[stage.name](axis, stage)
