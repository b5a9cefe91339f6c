"""Inside the simulator: a block's own cocotb tests on every mutant, each in a copy of this process.

The copy is made before the first clock. So every mutant begins at power-up whatever the one before it did, and nothing
is started or loaded anew. The copy chooses its mutant, runs the tests and ends at the first that fails.

A mutant may hang. Every test has a wall of simulated time, some times what it takes without a mutant; and since a
mutant that oscillates makes no clock at all, every copy has a wall of the processor's time, too.
"""

import json
import os
import resource
import sys
import traceback
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import Any

import cocotb
from cocotb.regression import Test, TestGenerator
from cocotb.simtime import get_sim_time
from cocotb.triggers import Timer

GIVEN = json.loads(os.environ["HARDWALL_MUTATION"])
TIMES, GRACE_NS, GRACE_S = 3, 100_000, 60
"""The walls: as many times what the tests take without a mutant, and more, of simulated time and of the processor's."""


@dataclass
class Copy:
    """What this process is.

    Attributes:
        told: the pipe to the process that made this copy; None in that process itself, which runs no tests.
        took: what every test took of simulated time.
    """

    told: int | None = None
    took: dict[str, float] = field(default_factory=dict)

    def end(self, killed_by: str | None) -> None:
        """Tell what came of the mutant, and end this copy."""
        said = {"killed_by": killed_by, "took": self.took, "cpu": resource.getrusage(resource.RUSAGE_SELF).ru_utime}
        os.write(self.told, json.dumps(said).encode())
        os._exit(0)


COPY = Copy()


def judged(test: Test) -> Test:
    """Return a cocotb test that runs in copies only, and ends its copy if it fails."""
    run = test.func

    async def in_copy(dut: Any, *args: Any, **named: Any) -> None:
        if COPY.told is None:
            return
        begun = get_sim_time("ns")
        try:
            await run(dut, *args, **named)
        except BaseException as failure:
            # Cocotb cancels a test that passes its wall, and one of whose tasks failed.
            COPY.end(f"{test.name}: {type(failure).__name__}: {str(failure).partition(chr(10))[0]}"[:300])
        COPY.took[test.name] = get_sim_time("ns") - begun

    test.func = in_copy
    return test


def outcome_of(number: int, walls: dict[str, float], cpu_s: int) -> dict | None:
    """Return what came of a mutant; None in the copy that is to run its tests."""
    hear, tell = os.pipe()
    sys.stdout.flush()
    child = os.fork()
    if not child:
        os.close(hear)
        COPY.told = tell
        resource.setrlimit(resource.RLIMIT_CPU, (cpu_s, cpu_s))
        for name, wall in walls.items():
            TESTS[name].timeout = (wall, "ns")
        return None
    os.close(tell)
    with os.fdopen(hear, "rb") as pipe:
        said = pipe.read()
    _, status = os.waitpid(child, 0)
    if said:
        return json.loads(said)
    if os.WIFSIGNALED(status):
        return {"killed_by": f"no clock: signal {os.WTERMSIG(status)}"}
    raise RuntimeError(f"the copy of mutant {number} ended with {status} and said nothing")


async def choose(selector: Any, number: int) -> None:
    """Choose a mutant in this copy; a copy that cannot must not run the tests without one."""
    try:
        selector.value = number
        await Timer(1, "ns")
        assert int(selector.value) == number
    except BaseException:
        traceback.print_exc()
        os._exit(1)


@cocotb.test()
async def every_mutant(dut):
    assert TESTS, f"{GIVEN['test']} has no test"
    outcomes, walls, cpu_s = {}, {}, resource.RLIM_INFINITY
    for number in (0, *GIVEN["numbers"]):
        found = outcome_of(number, walls, cpu_s)
        if found is None:
            await choose(dut.component.choice.mutant, number)
            return
        outcomes[number] = found["killed_by"]
        if number == 0:
            if outcomes[0]:
                break
            walls = {name: TIMES * took + GRACE_NS for name, took in found["took"].items()}
            cpu_s = TIMES * int(found["cpu"]) + GRACE_S
    Path(GIVEN["report"]).write_text(json.dumps(outcomes), encoding="utf-8")


def tests_of(file: Path) -> dict[str, Test]:
    """Return the cocotb tests of a file, each judged."""
    sys.path.insert(0, str(file.parent))
    generators = [each for each in vars(import_module(file.stem)).values() if isinstance(each, TestGenerator)]
    return {test.name: judged(test) for generator in generators for test in generator.generate_tests()}


TESTS = tests_of(Path(GIVEN["test"]))
globals().update(TESTS)


@cocotb.test()
async def the_mutant_survived(dut):
    if COPY.told is not None:
        COPY.end(None)
