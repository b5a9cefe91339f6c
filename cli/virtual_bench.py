"""A virtual board in a process of its own, for the page of `hardwall panel virtual`."""

import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from ..host import Axis, PortError, connect
from ..host.panel.estimates import Estimates
from ..host.panel.hand import Hand
from ..host.panel.live import Bench
from ..model.axis import supervisor
from ..model.runtime import termination
from ..sim.scene.load import parse, read
from ..sim.scene.schema import Scene
from .scenes import changes_of
from .virtual import COUNTS

WALL = {"wall_stiffness": 2000.0, "wall_damping": 10.0, "wall_position": 5e-3, "supervisor_force_limit": 20.0}
"""The words written to it at the beginning: a wall to feel."""
GAINS = {"levant_lambda": 3.5, "levant_alpha": 13.2, "levant_output": 1.0}
"""So too, where its estimator is Levant's: gains for accelerations of a hand, 12 m/s^2, and the smooth output. The
paper's, for its walls, are larger."""
LOSS = 1 << supervisor.names(supervisor.ALL).index("encoder_loss")
PORT_LINE = "serial port: "


@contextmanager
def bench_of(
    scene: str, estimator: str | None, set_: list[str] | None, identity: str | None
) -> Iterator["VirtualBench"]:
    """Provide the virtual board of a scene; it does not run yet.

    Args:
        scene: name or file of the scene.
        estimator, set_: the options of these names.
        identity: the identity that the board must have; None for any.
    """
    changes = changes_of(set_, controller__estimator=estimator)
    words = [*_options("--set", set_ or []), *_options("--estimator", [estimator] if estimator else [])]
    text = read(scene)
    of = parse(scene, text, changes)
    with _scene_file(of, text) as file, VirtualBench(scene, [str(file), *words], of, identity) as board:
        yield board


def _options(name: str, values: list[str]) -> list[str]:
    return [word for value in values for word in (name, value)]


@contextmanager
def _scene_file(scene: Scene, text: str) -> Iterator[Path]:
    """Provide a file with the text of a scene, so that a board that starts later, or again, runs the scene as read
    here."""
    folder = tempfile.TemporaryDirectory(prefix="hardwall-")
    with termination.undone(folder.cleanup):
        file = Path(folder.name) / f"{scene.name}.toml"
        file.write_text(text, encoding="utf-8")
        yield file


class VirtualBench:
    """A virtual board as a process of its own, which is started anew when it has ended. A context manager that ends it.

    Args:
        name: the scene's, as it was given.
        words: the scene and the options of the command `virtual`.
        scene: the scene that they make.
        identity: the identity that the board must have; None for any.

    Attributes:
        name: the scene's, as it was given.
        bench: the hand at it, and the estimators beside it.
        code: the exit code of a process that did not start; None if none did so.
    """

    def __init__(self, name: str, words: list[str], scene: Scene, identity: str | None):
        program = "from hardwall.cli.app import main; main()"
        self.name = name
        self._words = [sys.executable, "-c", program, "virtual", *words, "--counts"]
        self._identity, self._port, self.code = identity, "", None
        self._process: subprocess.Popen[str] | None = None
        estimates = None if scene.spec.design.estimator.uses_stamps() else Estimates(scene.spec)
        travel_m = scene.spec.travel_m
        self.bench = Bench(Hand(self._order, scene.protocol.start_m, travel_m), estimates)

    def __enter__(self) -> "VirtualBench":
        return self

    def __exit__(self, *_: object) -> None:
        self.end()

    def end(self) -> None:
        """End the process."""
        if self._process:
            self._process.kill()
            self._process.wait()

    def connect(self) -> Axis:
        """Start the process unless it runs; return its axis, with a wall."""
        if self._process is None or self._process.poll() is not None:
            self._start()
        axis = connect(self._port, identity=self._identity)
        causes = int(axis.get("supervisor_causes")) | LOSS
        gains = {name: value for name, value in GAINS.items() if name in axis.names}
        axis.set(**WALL, **gains, supervisor_causes=causes)
        return axis

    def _start(self) -> None:
        # A signal from the terminal is for this process, which ends the other one.
        pipe = subprocess.PIPE
        self._process = process = subprocess.Popen(
            self._words, stdin=pipe, stdout=pipe, text=True, start_new_session=True
        )
        self.bench.hand.broken.clear()
        lines = iter(process.stdout)
        self._port = next((line.removeprefix(PORT_LINE).strip() for line in lines if line.startswith(PORT_LINE)), "")
        if not self._port:
            self.code = process.wait()
            raise PortError("the virtual board does not start")
        threading.Thread(target=self._hear, args=[process], name="hardwall-counts", daemon=True).start()

    def _hear(self, process: "subprocess.Popen[str]") -> None:
        """Carry the counts of the encoder to the estimators, until the process ends."""
        estimates = self.bench.estimates
        for line in process.stdout:
            if estimates and line.startswith(COUNTS):
                estimates.feed([int(word) for word in line.split()[1:]])

    def _order(self, text: str) -> None:
        with suppress(OSError, ValueError):
            self._process.stdin.write(f"{text}\n")
            self._process.stdin.flush()
