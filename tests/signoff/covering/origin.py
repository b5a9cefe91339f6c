"""All that the tests of a block come from: by a digest of it, what they have found is kept."""

from collections.abc import Sequence

from hardwall.hdl.export import to_verilog
from hardwall.testing import SAMPLES, SEED

from .blocks import Block
from .sizes import Size
from .sources import code_of_all


def origin_of(block: Block, sizes: Sequence[Size]) -> tuple[object, ...]:
    """Return the block's modules, its Verilog in every size, its tests and what these import, and how long they are.

    Args:
        block: the block.
        sizes: those that its tests simulate.
    """
    verilog = [(size.name, to_verilog(size.component(), "block")) for size in sizes]
    return block.modules, verilog, code_of_all(block.test), SEED, SAMPLES
