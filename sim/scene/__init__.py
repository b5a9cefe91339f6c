"""Scenes: devices described in TOML, and what is built from them."""

from ...model.runtime.extras import need

need("sim")

from ...model.spec import AxisSpec
from .load import load


def spec(scene: str) -> AxisSpec:
    """Return the specification of the axis of a scene: that of its Verilog, gains included.

        spec("mhz")         # as `hardwall verilog mhz` generates it

    Args:
        scene: the name of a scene that comes with the project, or the path of a TOML file.

    Raises:
        SceneError: if the scene is not valid; the message is one line on what is wrong, where, and what is accepted.
    """
    return load(scene).spec
