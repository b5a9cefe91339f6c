"""Every fault, in the order of the table."""

from . import of_encoder, of_host, of_line, of_motion, of_pins

FAULTS = (*of_encoder.FAULTS, *of_motion.FAULTS, *of_pins.FAULTS, *of_host.FAULTS, *of_line.FAULTS)
