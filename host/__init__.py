"""The PC side of a board, real or virtual: `connect`, the axis in SI units, and the errors."""

from ..model.runtime.extras import need

need("host")

from .axis import Axis
from .banks import Axes
from .config import Config, Difference
from .connect import connect, connect_axes, share
from .errors import (
    ChangedError,
    ConfigError,
    ForeignError,
    HeldError,
    HostError,
    LateError,
    NotReadyError,
    PortError,
    RefusedError,
    SilentError,
    TrippedError,
)
from .relay import Relay
from .sample_file import SampleFile
from .samples import Gap, Sample, Samples
from .status import State, Status, Trip

__all__ = [
    "Axes",
    "Axis",
    "ChangedError",
    "Config",
    "ConfigError",
    "Difference",
    "ForeignError",
    "Gap",
    "HeldError",
    "HostError",
    "LateError",
    "NotReadyError",
    "PortError",
    "RefusedError",
    "Relay",
    "Sample",
    "SampleFile",
    "Samples",
    "SilentError",
    "State",
    "Status",
    "Trip",
    "TrippedError",
    "connect",
    "connect_axes",
    "share",
]
