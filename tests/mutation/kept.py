"""What came of a block's mutants, kept: a run that was ended goes on where it was.

It is of no use any more where something that it came from has changed: the block's Verilog in a size, its own tests
and what these import, what draws and tests mutants, the seed, or the number of mutants or of samples.
"""

import hashlib
import json
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

from covering.blocks import Block

from hardwall.hdl.export import to_verilog
from hardwall.model.build_folder import build_dir
from hardwall.testing import SAMPLES, SEED
from hardwall.testing.harness import SEQUENCER

from .fates import Fate
from .netlist import BLOCK
from .sizes import Size
from .sources import TREE, sources_of

OWN = Path(__file__).parent


def digest_of(block: Block, sizes: Sequence[Size], count: int) -> str:
    """Return a digest of all that a block's mutants and their fates come from."""
    sources = {str(file): (TREE / file).read_bytes() for file in sources_of(block.test)}
    means = [file.read_bytes() for file in (SEQUENCER, *sorted(OWN.glob("*.py")))]
    verilog = [to_verilog(size.component(), BLOCK) for size in sizes]
    parts = [block.modules, [size.name for size in sizes], SEED, SAMPLES, count, verilog, sources, means]
    return hashlib.sha256(repr(parts).encode()).hexdigest()


def _file(block: Block) -> Path:
    return build_dir() / "mutate" / f"{block.name.replace('/', '-')}.json"


def kept_of(block: Block, digest: str) -> list[Fate] | None:
    """Return what is kept of a block; None if nothing is, or not of this digest."""
    try:
        kept = json.loads(_file(block).read_text(encoding="utf-8"))
    except FileNotFoundError:
        return None
    return [Fate(**fate) for fate in kept["fates"]] if kept["digest"] == digest else None


def keep(block: Block, digest: str, fates: Sequence[Fate]) -> None:
    """Keep what came of a block's mutants in a file, which people may read, too."""
    text = json.dumps({"digest": digest, "fates": [asdict(fate) for fate in fates]}, indent=1)
    file = _file(block)
    file.parent.mkdir(parents=True, exist_ok=True)
    # A run that is ended meanwhile leaves no half of it.
    unfinished = file.with_suffix(".new")
    unfinished.write_text(text + "\n", encoding="utf-8")
    unfinished.replace(file)
