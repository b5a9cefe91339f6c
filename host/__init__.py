"""What runs on the PC beside a board, real or virtual: `connect`, the axis in SI units, and what may go wrong."""

from .axis import Axis
from .connect import connect
from .errors import (
    ChangedError,
    ForeignError,
    HostError,
    NotReadyError,
    PortError,
    RefusedError,
    SilentError,
    TrippedError,
)
from .status import State, Status, Trip

__all__ = [
    "Axis",
    "ChangedError",
    "ForeignError",
    "HostError",
    "NotReadyError",
    "PortError",
    "RefusedError",
    "SilentError",
    "State",
    "Status",
    "Trip",
    "TrippedError",
    "connect",
]
