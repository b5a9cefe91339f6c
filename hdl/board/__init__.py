"""The parts of a board around its axes: clocks, their monitor, and the way to the pins."""
