"""The world around the axis: scenes, plant, encoder, the closed loop and the command line."""

import time

BEGAN_NS = time.time_ns()
"""The time, in ns since 1970, at which this process began to read the project's sources."""
