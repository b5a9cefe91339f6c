"""Scenes: devices described in TOML, and what is built from them."""

from ...model.runtime.extras import need

need("sim")

from pathlib import Path

from ...model.checks import shown
from ...model.spec import AxisSpec
from .errors import SceneError
from .load import load as loaded

__all__ = ["SceneError", "spec"]


def spec(scene: str | Path) -> AxisSpec:
    """Return the specification of the axis of a scene, as its Verilog has it, gains included.

        spec("mhz")         # as `hardwall verilog mhz` generates it

    Args:
        scene: the name of a scene that comes with the project, or the path of a TOML file.

    Raises:
        TypeError: if the scene is neither a name nor a path.
        SceneError: if the scene is not valid, or has several axes; the message is one line: the fault, its place, and
            the accepted values.
    """
    if not isinstance(scene, str | Path):
        raise TypeError(f"scene must be a name or a path, not {shown(scene)}")
    return loaded(str(scene)).spec
