"""The command `panel`."""

import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager, suppress
from pathlib import Path
from typing import Annotated

import typer

from ...host import Axis, PortError, connect
from ...host.panel.driver import Driver
from ...host.panel.estimates import Estimates
from ...host.panel.hand import Hand
from ...host.panel.live import Bench
from ...host.panel.serving import LOCAL, AddressError, PanelServer, listen
from ...host.port import BAUD, BAUD_MAX
from ...model import supervisor
from ...model.checks import shown
from ..jobs import ending
from ..scene.load import parse, read
from ..scene.schema import Scene
from .errors import BadInput
from .options import EstimatorOption, SetOption, changes_of, within
from .port import IdentityOption, PaceOption, SecondsOption, check_pace
from .terminal import log
from .virtual import COUNTS

VIRTUAL = "virtual"
"""The word for a board in simulation."""
SCENE, CLOCK, CLOCK_HZ = "seed-2011", "controller.clock_hz", 4_000_000
"""The scene of such a board, and its clock: at this one it runs at about the pace of the real one."""
WALL = {"wall_stiffness": 2000.0, "wall_damping": 10.0, "wall_position": 5e-3, "supervisor_force_limit": 20.0}
"""What is written to it at the beginning, so that there is a wall to be felt."""
GAINS = {"levant_lambda": 3.5, "levant_alpha": 13.2, "levant_output": 1.0}
"""So too, where its estimator is Levant's: gains for accelerations of a hand, 12 m/s^2, and the smooth output. The
paper's, for its walls, are larger."""
LOSS = 1 << supervisor.names(supervisor.ALL).index("encoder_loss")
PORT_LINE = "serial port: "


def command(
    port: Annotated[
        str, typer.Argument(metavar="PORT|virtual", help="a port, as of `hardwall connect`; or a board in simulation")
    ],
    scene: Annotated[
        str | None,
        typer.Argument(metavar="SCENE", help="the scene of that", show_default=f"{SCENE}, with a clock of 4 MHz"),
    ] = None,
    estimator: EstimatorOption = None,
    set_: SetOption = None,
    baud: Annotated[
        int | None, typer.Option(min=1, max=BAUD_MAX, help="the board's rate", show_default=f"{BAUD}")
    ] = None,
    identity: IdentityOption = None,
    pace: PaceOption = None,
    host: Annotated[str, typer.Option(metavar="ADDRESS", help="the address at which the page is served")] = LOCAL,
    http: Annotated[int, typer.Option(min=0, max=65535, metavar="PORT", help="its port; 0 for any that is free")] = 0,
    seconds: SecondsOption = None,
) -> None:
    if seconds is not None:
        within(seconds, "--seconds", 0.0, 1e6, "s")
    check_pace(pace)
    if port == VIRTUAL:
        if baud is not None or pace is not None:
            raise BadInput("--baud and --pace are for a board at a port, not for `hardwall panel virtual`")
        name = scene or SCENE
        changes = changes_of(set_, controller__estimator=estimator)
        words = [*_options("--set", set_ or []), *_options("--estimator", [estimator] if estimator else [])]
        if scene is None and CLOCK not in changes:
            changes[CLOCK] = CLOCK_HZ
            words += ["--set", f"{CLOCK}={CLOCK_HZ}"]
        text = read(name)
        of = parse(name, text, changes)
        with _scene_file(of, text) as file, VirtualBench([str(file), *words], of, identity) as board:
            try:
                _serve(board.connect, board, f"{name}, virtual", (host, http), seconds)
            except PortError:
                # A board that ended has said why.
                sys.exit(board.code or 1)
    elif scene or estimator or set_:
        raise BadInput("SCENE, --estimator and --set are for `hardwall panel virtual`, not for a board at a port")
    else:
        _serve(lambda: connect(port, baud or BAUD, identity=identity, pace=pace), None, port, (host, http), seconds)


@contextmanager
def _scene_file(scene: Scene, text: str) -> Iterator[Path]:
    """Provide a file with the text of a scene, so that a board that starts later, or anew, runs what was read here."""
    folder = tempfile.TemporaryDirectory(prefix="hardwall-")
    with ending.undone(folder.cleanup):
        file = Path(folder.name) / f"{scene.name}.toml"
        file.write_text(text, encoding="utf-8")
        yield file


class VirtualBench:
    """A virtual board as a process of its own, which is started anew when it has ended. A context manager that ends it.

    Args:
        words: the scene and the options of the command `virtual`.
        scene: the scene that they make.
        identity: the identity that the board must have; None for any.

    Attributes:
        bench: the hand at it, and the estimators beside it.
        code: the exit code of a process that did not start; None if none did so.
    """

    def __init__(self, words: list[str], scene: Scene, identity: str | None):
        program = "from hardwall.sim.commands.app import main; main()"
        self._words = [sys.executable, "-c", program, VIRTUAL, *words, "--counts"]
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


def _options(name: str, values: list[str]) -> list[str]:
    return [word for value in values for word in (name, value)]


def _serve(
    open_axis: Callable[[], Axis],
    board: VirtualBench | None,
    title: str,
    address: tuple[str, int],
    seconds: float | None,
) -> None:
    """Serve the page of a board, until it is interrupted or the time has passed."""
    try:
        at = listen(*address)
    except AddressError:
        raise BadInput(f"--host must be an address of this machine, not {shown(address[0])}") from None
    # The address is had before a board is started.
    with closing(at.socket), _driver(open_axis, board) as driver:
        bench = board.bench if board else None
        with PanelServer(driver, bench, title, at) as server:
            print(f"page: {server.url}", flush=True)
            log.print("Open that page in a browser. Whoever has its address may arm the board.")
            until = None if seconds is None else time.monotonic() + seconds
            while until is None or time.monotonic() < until:
                time.sleep(0.05 if seconds else 0.5)


@contextmanager
def _driver(open_axis: Callable[[], Axis], board: VirtualBench | None) -> Iterator[Driver]:
    """Yield what polls a board; in the end, or before a signal ends the process, disarm it."""

    def end() -> None:
        if driver:
            driver.close()
        if board:
            board.end()

    driver = None
    with ending.undone(end):
        driver = Driver(open_axis)
        yield driver
