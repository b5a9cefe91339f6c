"""A virtual board as a process of its own, and orders to it."""

import re
import subprocess
from collections.abc import Iterator, Mapping
from contextlib import contextmanager

from .processes import HARDWALL

SCENE = {"controller.clock_hz": 1_000_000, "encoder.count_m": 10e-6, "protocol.start_m": -1e-3, "handle.coulomb_n": 0.0}
"""Changes of `seed-2011` to few clocks: a part of a core at real time. Without friction a contact has one position."""
ACCELERATED = SCENE | {"controller.estimator": "kalman", "virtual_mass.most_kg": 0.2}
"""Changes to an estimator with an acceleration, and to a force law that uses it."""
SMALL = {"controller.estimator": "fdm"}
"""Changes besides, for a netlist that is soon made."""
PACE = 0.2
"""What hosts are told of boards on a machine that others use, too."""
PORTS = re.compile(r"serial port: (?P<path>/dev/\S+)\n(?:tcp port: (?P<tcp>127\.0\.0\.1:\d+)\n)?orders: hold MM, .*\n")
"""What the command prints before a host can come."""


def command(changes: Mapping[str, object], *arguments: str) -> list[str]:
    """Return the words of the command for the scene `seed-2011` with changes."""
    changed = [word for key, value in changes.items() for word in ("--set", f"{key}={value}")]
    return [str(HARDWALL), "virtual", "seed-2011", *changed, *arguments]


class VirtualBoard:
    """A virtual board that runs.

    Attributes:
        process: its process.
        path: its pseudo-terminal; tcp: its port of the network as a host names it, or None.
    """

    def __init__(self, process: subprocess.Popen, said: re.Match[str]):
        self.process, self.path = process, said["path"]
        self.tcp = said["tcp"] and f"tcp://{said['tcp']}"

    def order(self, *orders: str) -> None:
        """Give orders, which the board obeys in their order, soon."""
        self.process.stdin.write("".join(f"{order}\n" for order in orders))
        self.process.stdin.flush()


@contextmanager
def running(changes: Mapping[str, object], *arguments: str) -> Iterator[VirtualBoard]:
    """Start a virtual board; yield it when a host can come; end it."""
    pipes = dict.fromkeys(("stdin", "stdout", "stderr"), subprocess.PIPE)
    with subprocess.Popen(command(changes, *arguments), **pipes, text=True) as process:
        try:
            lines = ""
            while not (said := PORTS.fullmatch(lines)):
                line = process.stdout.readline()
                assert line, process.stderr.read()
                lines += line
            yield VirtualBoard(process, said)
        finally:
            process.kill()
