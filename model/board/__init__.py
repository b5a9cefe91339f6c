"""The parts of a board around its axes."""
