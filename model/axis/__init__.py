"""One axis; its names here are those that stay."""

from .axis import Axis, step

__all__ = ["Axis", "step"]
