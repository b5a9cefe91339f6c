"""The requests of a server to a register file, and the answers."""

from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from hardwall.model.axis.register_file import CELL_BITS, Operation
from hardwall.model.axis.registers import SPACE

ADDRESS_BITS = SPACE.bit_length()


class Requests(wiring.Signature):
    """The way from a server to a register file, as the server sees it.

    Members
    -------
    start : Out(1)
        High until `done`: do `operation`. What follows holds as long.
    operation : Out(range(7))
        A `model.link.register_file.Operation`.
    address : Out(17)
        The register; 65536 and above is none.
    first, last : Out(1)
        For a check: the register is the first, the last of a frame.
    value : Out(16)
        For a write and its check: the register's new value.
    clear : Out(1)
        Pulse: `absent`, `outside` and `refused` fall.
    done : In(1)
        High for one clock.
    data : In(16)
        With `done` of a READ: the register.
    absent, outside, refused : In(1)
        A check since `clear` has found no register, half of a value, a value out of range, or a refused pulse.
    """

    def __init__(self):
        super().__init__(
            {
                "start": Out(1),
                "operation": Out(range(len(Operation))),
                "address": Out(ADDRESS_BITS),
                "first": Out(1),
                "last": Out(1),
                "value": Out(CELL_BITS),
                "clear": Out(1),
                "done": In(1),
                "data": In(CELL_BITS),
                "absent": In(1),
                "outside": In(1),
                "refused": In(1),
            }
        )
