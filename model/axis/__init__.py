"""One axis. The names that this package exports keep their meaning: see *Limits* in the documentation."""

from .axis import Axis, step

__all__ = ["Axis", "step"]
