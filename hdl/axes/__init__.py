"""Several axes in one pipeline, an axis a clock: the equations of one axis, in a fraction of its logic for each."""
