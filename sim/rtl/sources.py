"""The Verilog of an axis, or of several, as files, for use in another tool flow."""

from pathlib import Path

from ...hdl import export
from ...model.axes.axis import AxesSpec
from ...model.spec import AxisSpec


def write_verilog(spec: AxisSpec | AxesSpec, folder: Path) -> list[Path]:
    """Write the Verilog of one axis or several, its ports and its registers into an existing folder; return the paths.

    Raises:
        OSError: if the files cannot be written.
    """
    return export.write(spec, folder)
