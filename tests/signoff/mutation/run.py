"""The mutants of blocks drawn, tested, and where they survive, compared with the block; their fates are kept."""

import os
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import asdict
from pathlib import Path

from hardwall.testing import SEED
from hardwall.testing.harness import SEQUENCER
from signoff.covering.blocks import Block
from signoff.covering.origin import origin_of
from signoff.covering.sizes import Size, sizes_of
from signoff.covering.sources import means
from signoff.kept import Findings, digest_of
from signoff.reasons import reasons_for

from .equivalent import known_of
from .killing import killed
from .netlist import BLOCK, Netlist, mutated
from .outcomes import REASONS, Fate, Result

SAMPLES = 1000
"""The samples of the first campaign, which kills most mutants; what it leaves goes through a whole one."""
PROVING = ("solver.py", "by_state.py", "cutting.py", "equivalent.py")
"""The sources here that only what has survived comes to."""


def fates_of(size: Size, modules: tuple[str, ...], count: int, before: Sequence[Fate] = ()) -> list[Fate]:
    """Return what came of some mutants of a block in one size.

    Args:
        size: the size.
        modules: the block's modules.
        count: the mutants.
        before: what came of these mutants before, whose survivors alone are asked about; none to test them.

    Raises:
        RuntimeError: if the block's own tests fail without a mutant, or a tool fails.
    """
    netlist = mutated(size.component(), modules, count, SEED)
    if before:
        pairs = zip(netlist.mutants, before, strict=True)
        killed_by = {mutant.number: fate.killed_by for mutant, fate in pairs}
    else:
        killed_by = _killed(size, netlist)
    # A question to the solver takes longer than a campaign.
    alive = [mutant.number for mutant in netlist.mutants if killed_by[mutant.number] is None]
    known = known_of(netlist, alive) if alive else {}
    return [
        Fate(f"{size.name}: {mutant.change}", killed_by[mutant.number], known.get(mutant.number, ""))
        for mutant in netlist.mutants
    ]


def _killed(size: Size, netlist: Netlist) -> dict[int, str | None]:
    """Return which test killed each mutant; None for those that survived a whole campaign."""
    numbers = [mutant.number for mutant in netlist.mutants]
    killed_by = killed(size, netlist, numbers, SAMPLES)
    # A short campaign may be too short for what the tests demand of it.
    left = numbers if killed_by.pop(0) else [number for number in numbers if killed_by[number] is None]
    if left:
        killed_by |= killed(size, netlist, left)
        if unmutated := killed_by.pop(0):
            raise RuntimeError(f"the tests of {size.test.name} fail without a mutant: {unmutated}")
    return killed_by


def modules_of(block: Block) -> tuple[str, ...]:
    """Return the modules of a block, as its netlist names them."""
    return tuple(module.replace("component", BLOCK, 1) for module in block.modules)


def shares_of(count: int, sizes: int) -> list[int]:
    """Return how many of `count` mutants each of some sizes gets: from each as many, as far as they go."""
    return [count * (n + 1) // sizes - count * n // sizes for n in range(sizes)]


def _digest(block: Block, sizes: Sequence[Size], count: int) -> str:
    """Return a digest of all that a block's mutants, and whether its tests kill them, come from."""
    here = Path(__file__).parent
    killed_by = means(SEQUENCER, *sorted(file for file in here.glob("*.py") if file.name not in PROVING))
    return digest_of(origin_of(block, sizes), count, killed_by)


def run(
    blocks: Sequence[Block], count: int, ours: bool, done: Callable[[Result], None], findings: Findings
) -> list[Result]:
    """Return what came of `count` mutants of each block; `done` is called with each result as it comes.

    The mutants are drawn from all sizes of a block, from each as many. What is kept of a block is not tested again; if
    the proofs have changed since, what had survived is asked about again.

    Args:
        blocks: the blocks.
        count: the mutants of each.
        ours: whether these are the mutants that the reasons were written for.
        done: told every result.
        findings: what was found before; what is found is added.

    Raises:
        RuntimeError: if a block's own tests fail without a mutant, or a tool fails.
    """

    def result_of(block: Block, fates: list[Fate]) -> Result:
        result = Result(block.name, fates, reasons_for(block.name, REASONS), ours)
        done(result)
        return result

    # All sizes are taken first, for a run of pytest takes the standard streams and the environment to itself.
    sizes = {block: sizes_of(block.test) for block in blocks}
    digests = {block: _digest(block, sizes[block], count) for block in blocks}
    proven_by = digest_of(means(*(Path(__file__).with_name(name) for name in PROVING)))
    kept = {block: findings.of(block.name, digests[block]) or {"proven_by": "", "fates": []} for block in blocks}
    before = {block: [Fate(**each) for each in kept[block]["fates"]] for block in blocks}
    results = {block: result_of(block, before[block]) for block in blocks if kept[block]["proven_by"] == proven_by}
    waiting: dict[Block, list[Future[list[Fate]]]] = {}
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        for block in blocks:
            if block not in results:
                waiting[block] = [
                    pool.submit(fates_of, size, modules_of(block), share, _of_size(before[block], size))
                    for size, share in zip(sizes[block], shares_of(count, len(sizes[block])), strict=True)
                ]
        try:
            # While one block's last size is tested, the next block's first are, too.
            for block, futures in waiting.items():
                fates = [fate for future in futures for fate in future.result()]
                found = {"proven_by": proven_by, "fates": [asdict(fate) for fate in fates]}
                findings.keep(block.name, digests[block], found)
                results[block] = result_of(block, fates)
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
    return [results[block] for block in blocks]


def _of_size(fates: Sequence[Fate], size: Size) -> list[Fate]:
    return [fate for fate in fates if fate.mutant.startswith(f"{size.name}: ")]
