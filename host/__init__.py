"""What runs on the PC beside a board, real or virtual: `connect`, the axis in SI units, and what may go wrong."""

from ..model.runtime.extras import need

need("host")

from .axis import Axis
from .banks import Axes
from .connect import connect, connect_axes
from .errors import (
    ChangedError,
    ForeignError,
    HostError,
    LateError,
    NotReadyError,
    PortError,
    RefusedError,
    SilentError,
    TrippedError,
)
from .status import State, Status, Trip

__all__ = [
    "Axes",
    "Axis",
    "ChangedError",
    "ForeignError",
    "HostError",
    "LateError",
    "NotReadyError",
    "PortError",
    "RefusedError",
    "SilentError",
    "State",
    "Status",
    "Trip",
    "TrippedError",
    "connect",
    "connect_axes",
]
