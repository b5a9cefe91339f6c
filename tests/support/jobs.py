"""Jobs that wait for a tool or fail, and a program that runs them for ever."""

import subprocess
from pathlib import Path

from hardwall.model.runtime import termination
from hardwall.sim.jobs import children, parallel
from hardwall.sim.jobs.store import Store


def wait_with_a_tool(number: int) -> int:
    """Wait for a tool that has a child of its own; the job number 0 returns at once."""
    if number:
        Path(f"begun-{number}").touch()
        children.run(["sh", "-c", "sleep 600 & sleep 600"])
    return number


def fail_beside_a_long_job(number: int) -> int:
    """Fail as soon as the other job is under way, which never ends."""
    if number:
        return wait_with_a_tool(number)
    while not Path("begun-1").exists():
        subprocess.run(["sleep", "0.05"], check=True)
    raise ValueError("this job fails")


def run_for_ever() -> None:
    """Run jobs on two threads, of which all but the first wait."""
    termination.hear_signals()
    parallel.run(wait_with_a_tool, [{"number": number} for number in range(3)], Store("waits"), 2)


if __name__ == "__main__":
    run_for_ever()
