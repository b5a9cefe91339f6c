"""The Verilog of an axis as files, for use in another tool flow."""

from pathlib import Path

from ...hdl import export
from ...model.spec import AxisSpec


def write_verilog(spec: AxisSpec, folder: Path) -> list[Path]:
    """Write the Verilog of an axis, its ports and its registers into an existing folder; return the paths.

    Raises:
        OSError: if the files cannot be written.
    """
    return export.write(spec, folder)
