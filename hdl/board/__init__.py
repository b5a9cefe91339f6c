"""What a board has around its axes: clocks, their monitor, and the way to the pins."""
