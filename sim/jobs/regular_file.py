"""Files that are read whole, as scenes and recordings take them: see `hardwall.model.runtime.regular_file`."""

from ...model.runtime.regular_file import content_of

__all__ = ["content_of"]
