"""The way from pytest into the simulator, and what both sides know of the run: its seed, length and parameters.

A test file is read twice. Under pytest, `simulate` builds the Verilog of a component, once for every content, and
starts the simulator, in which cocotb reads the file again and runs the tests that `cocotb.test` marks.
"""

import json
import os
import shlex
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, Literal, TypedDict

import numpy as np
from amaranth.lib import wiring

from hardwall.model.runtime.build_folder import build_dir

from .harness import SEQUENCER, Harness

SEED = int(os.environ.get("HARDWALL_SEED", "1"))
"""The seed of everything random, from `HARDWALL_SEED`."""
SAMPLES = int(os.environ.get("HARDWALL_SAMPLES", "100000"))
"""The number of samples in a random campaign, from `HARDWALL_SAMPLES`."""
TRACED = "HARDWALL_TRACED" in os.environ
"""Whether a failed campaign is run again to be traced."""
TRACED_SAMPLES = int(traced) if (traced := os.environ.get("HARDWALL_TRACED_SAMPLES")) else None
"""The sample at which a failed campaign ends when it is run again to be traced."""


class Timeout(TypedDict):
    """The arguments of `cocotb.test` that end a test which takes too long."""

    timeout_time: int
    timeout_unit: Literal["us"]


CAMPAIGN: Timeout = {"timeout_time": SAMPLES + 20_000, "timeout_unit": "us"}
"""The timeout of a campaign's `cocotb.test`, 100 clocks a sample: hardware that stops answering fails, not hangs."""


def simulate(test_file: str, make: Callable[..., wiring.Component], **parameters: Any) -> None:
    """Run the cocotb tests of `test_file` on the hardware that `make(**parameters)` returns.

    Built files go to `HARDWALL_BUILD`, else to `build/` of the checkout that contains the test, else to `build/` of the
    working directory. A failing test is run again with the same seed, up to the sample that is wrong, and leaves its
    waveform there.

    Args:
        test_file: the caller's `__file__`.
        make: the function that returns the component; the simulator's side may call it again.
        parameters: JSON values for `make`; the simulator's side reads them by the function `parameters`.

    Raises:
        RuntimeError: if a test fails or none runs; the message gives the fault, the seed, the waveform, and the
            command that runs the test again.
    """
    # What builds is not loaded where it is built already: in the simulator, whose start would take a third longer.
    from hardwall.sim.rtl import cocotb_runner  # noqa: PLC0415

    file, component = Path(test_file).absolute(), make(**parameters)
    name = type(component).__module__.rsplit(".", 1)[-1]
    job = cocotb_runner.Job(
        module=file.stem,
        folder=file.parent,
        environ={"HARDWALL_PARAMETERS": json.dumps(parameters)},
        seed=SEED,
        build=_build_dir(file),
        more=SEQUENCER.read_text(encoding="ascii"),
    )
    try:
        cocotb_runner.simulate(Harness(component), name, job)
    except cocotb_runner.CocotbFailedError as failed:
        waveform = cocotb_runner.trace(Harness(component), name, job, failed)
        where = f"waveform at {os.path.relpath(waveform)}" if waveform else "no waveform, for it passed when traced"
        raise RuntimeError(f"{failed}; seed {SEED}, {where}{_again()}") from None


def _build_dir(file: Path) -> Path:
    """Return the folder for the built files of a test file."""
    ours = build_dir()
    return ours if os.environ.get("HARDWALL_BUILD") or file.is_relative_to(ours.parent) else Path("build").absolute()


def _again() -> str:
    """Return the command that runs the current pytest test again, or nothing outside a test."""
    test = os.environ.get("PYTEST_CURRENT_TEST", "").rpartition(" ")[0]
    if not test:
        return ""
    given = [f"{name}={os.environ[name]}" for name in ("HARDWALL_SAMPLES",) if name in os.environ]
    python = os.path.relpath(sys.executable)
    return f", again: {' '.join([f'HARDWALL_SEED={SEED}', *given])} {python} -m pytest -n 0 {shlex.quote(test)}"


def parameters() -> dict[str, Any]:
    """Return, inside the simulator, the parameters that `simulate` was called with."""
    return json.loads(os.environ["HARDWALL_PARAMETERS"])


def rng() -> np.random.Generator:
    """Return a generator seeded from `HARDWALL_SEED`."""
    return np.random.default_rng(SEED)
