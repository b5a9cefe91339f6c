"""The Verilog of an axis as files, for those who take it into a flow of their own."""

from pathlib import Path

from ...hdl import export
from ...model.spec import AxisSpec


def write_verilog(spec: AxisSpec, folder: Path) -> list[Path]:
    """Write `axis.v`, `board.v` and `ports.md` of an axis into a folder that is there; return their paths.

    Raises:
        OSError: if they cannot be written.
    """
    return export.write(spec, folder)
