"""Several axes: what they share, and what differs from an axis alone."""
