"""Every property, in the order of the path of data."""

from . import (
    of_arithmetic,
    of_axes,
    of_axis,
    of_banked_file,
    of_capture,
    of_drive,
    of_line,
    of_output,
    of_quadrature,
    of_register_file,
    of_server,
    of_supervised,
    of_supervised_axes,
    of_supervisor,
    of_wall,
    of_widths,
)

PROPERTIES = [
    *of_quadrature.PROPERTIES,
    *of_arithmetic.PROPERTIES,
    *of_wall.PROPERTIES,
    *of_output.PROPERTIES,
    *of_supervisor.PROPERTIES,
    *of_axis.PROPERTIES,
    *of_axes.PROPERTIES,
    *of_supervised.PROPERTIES,
    *of_supervised_axes.PROPERTIES,
    *of_drive.PROPERTIES,
    *of_capture.PROPERTIES,
    *of_line.PROPERTIES,
    *of_server.PROPERTIES,
    *of_register_file.PROPERTIES,
    *of_banked_file.PROPERTIES,
    *of_widths.PROPERTIES,
]
