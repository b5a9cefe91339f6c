"""Several axes in one pipeline: their shared parts, and the differences from a single axis."""
