"""Every fault, in the order of the table."""

from . import of_axes, of_encoder, of_host, of_line, of_motion, of_pins, of_stages
from .fault import Fault
from .staged import DEVICES, SEVERAL, STAGED

FAULTS: dict[str, tuple[Fault, ...]] = {
    name: (
        *of_encoder.FAULTS,
        *of_motion.FAULTS,
        *of_pins.FAULTS,
        *of_stages.faults(stage),
        *of_host.FAULTS,
        *of_line.FAULTS,
    )
    for name, stage in STAGED.items()
} | {name: of_axes.FAULTS for name, device in DEVICES.items() if device is SEVERAL}
"""The faults by the name of the drive stage that they are injected with; and those of several axes."""
