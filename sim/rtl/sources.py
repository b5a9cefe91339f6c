"""The Verilog of an axis as files, for use in another tool flow."""

from pathlib import Path

from ...hdl import export
from ...model.spec import AxisSpec


def write_verilog(spec: AxisSpec, folder: Path) -> list[Path]:
    """Write `axis.v`, `board.v` and `ports.md` of an axis into an existing folder; return their paths.

    Raises:
        OSError: if the files cannot be written.
    """
    return export.write(spec, folder)
