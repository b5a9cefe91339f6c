"""One axis, as near to its pins as can be: what it takes of the decoder comes out of the drive soonest."""
