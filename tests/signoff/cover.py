"""The coverage of the hardware: lines, branches and toggles of every block that its own tests reach under Verilator.

    make coverage                   every block
    make coverage ONLY=link/        only the blocks whose names begin so

A block's campaigns are short at first, and whole if these do not cover it. What its tests cover is kept, until
something changes that it comes from: see `kept.py`.

Prints a table in percent, a line for every point that is missed without a reason, and one last line for a script;
exits with 1 if a block falls short of a goal: lines 100 %, branches and toggles 98 %, of which points that have their
reason in `covering/reasons.toml` are taken as reached. `covering/points.py` says which points count.

This file is not called `coverage`, because Numba imports a package of that name where it finds one.
"""

import os
import shutil
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path

from hardwall.model.runtime.build_folder import build_dir
from hardwall.model.runtime.result import Table
from hardwall.sim.rtl import cocotb_build, cocotb_runner
from hardwall.sim.rtl.cocotb_runner import COVERAGE
from hardwall.testing import SAMPLES
from signoff.covering import points
from signoff.covering.blocks import BLOCKS, Block
from signoff.covering.origin import origin_of
from signoff.covering.points import Point, merged
from signoff.covering.report import REASONS, Coverage
from signoff.covering.sizes import sizes_of
from signoff.covering.sources import means
from signoff.kept import Findings, digest_of, findings_of
from signoff.reasons import reasons_for
from signoff.targets import conclude
from stimuli.lengths import EVERY_SIZE

COLUMNS = {
    "block": "left",
    "lines, %": "right",
    "branches, %": "right",
    "toggles, %": "right",
    "missed with a reason": "right",
    "without": "right",
    "result": "left",
}
SHORT = 20_000
"""The samples of the first campaigns."""
LONGEST_TEST_S = 3600
"""The longest that a test may take: it counts every point, which must be compiled, too, perhaps beside other work."""


def origin_digest(block: Block) -> str:
    """Return a digest of all that a block's coverage comes from: what its tests do, and what counts points."""
    counted_by = means(__file__, points.__file__, cocotb_build.__file__, cocotb_runner.__file__)
    return digest_of(origin_of(block, sizes_of(block.test)), counted_by)


def measure(block: Block, digest: str, findings: Findings) -> Coverage | None:
    """Return what the tests of a block cover, as they were run or as it is kept; None if they fail."""
    reasons, kept = reasons_for(block.name, REASONS), findings.of(block.name, digest)
    if kept is not None:
        missed = [Point(kind, name, tuple(place)) for kind, name, place in kept["missed"]]
        return Coverage(block.name, kept["points"], missed, reasons)
    found = None
    for counts in _counted(block, build_dir() / "coverage" / block.name.replace("/", "-")):
        found = counts and Coverage.of(block.name, counts, reasons)
        if found and found.ok:
            break
    if found:
        missed = [[*vars(point).values()] for point in found.missed]
        findings.keep(block.name, digest, {"points": found.points, "missed": missed})
    return found


def _counted(block: Block, folder: Path) -> Iterator[Counter[Point] | None]:
    """Yield how often the tests of a block reach every point, with short campaigns and then with whole ones as well.

    Yields None at the end if the whole ones fail. That short ones do says nothing: they may be too short for the tests.
    """
    shutil.rmtree(folder, ignore_errors=True)
    for samples in sorted({min(SHORT, SAMPLES), SAMPLES}):
        reports = folder / str(samples)
        reports.mkdir(parents=True)
        command = [sys.executable, "-m", "pytest", "-q", "-n", "0", "-m", "rtl", str(block.test)]
        # The suite's own limit ends the process of a test that takes longer, as if it had crashed.
        command += ["-o", f"faulthandler_timeout={LONGEST_TEST_S}"]
        environ = {**os.environ, COVERAGE: str(reports), "HARDWALL_SAMPLES": str(samples), EVERY_SIZE: "1"}
        done = subprocess.run(command, env=environ, capture_output=True, text=True, check=False)
        if done.returncode == 0:
            yield merged(sorted(folder.glob("*/*.dat")), block.modules)
        elif samples == SAMPLES:
            print(done.stdout, done.stderr, sep="", end="", file=sys.stderr)
            yield None


def main(begins: str) -> int:
    """Measure the blocks whose names begin so; return the exit code."""
    chosen = [block for block in BLOCKS if block.name.startswith(begins)]
    digests, findings = {block: origin_digest(block) for block in chosen}, findings_of("coverage")
    # The last blocks have the longest tests, so they are begun first.
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        futures = {pool.submit(measure, block, digests[block], findings): block for block in reversed(chosen)}
        for number, future in enumerate(as_completed(futures), 1):
            print(f"{number} of {len(chosen)}: {futures[future].name}", file=sys.stderr, flush=True)
    found = [coverage for coverage in (future.result() for future in reversed(futures)) if coverage]
    table, short = Table(COLUMNS, [coverage.row for coverage in found]), (each.explanation for each in found)
    good = sum(coverage.ok for coverage in found)
    return conclude(table, short, "coverage: {} blocks, {} covered", len(chosen), good)


if __name__ == "__main__":
    sys.exit(main(" ".join(sys.argv[1:])))
