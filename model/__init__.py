"""Bit-accurate reference of every hardware block: integers in, the same integers as the RTL out.

For studies: `velocity` and `velocity_of_edges` in one call, and both with the acceleration; `VelocityEstimator` and
`EdgeVelocityEstimator` with their `Motion` for a record in pieces; and `Sampler` for a loop of one's own. They are
loaded when they are first used; `__init__.pyi` has their types.
"""

from importlib import import_module
from typing import Any

_HOMES = {
    "EdgeVelocityEstimator": "edge_velocity_estimator",
    "Motion": "motion",
    "RecordWarning": "records",
    "Sampler": "sampler",
    "VelocityEstimator": "velocity_estimator",
    "velocity": "records",
    "velocity_and_acceleration": "records",
    "velocity_and_acceleration_of_edges": "records",
    "velocity_of_edges": "records",
}
__all__ = list(_HOMES)


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f".{_HOMES[name]}", __name__), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
