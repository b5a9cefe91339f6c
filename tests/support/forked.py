"""The command line in a forked child: the real `main`, with nothing to import or compile anew.

A call that is accepted may be a day's work, so the child ends, with the exit code `BEGAN`, where the work of a study, a
build or a synthesis would begin; runs of a hit, a replay and of accuracy at low rates are real, and kept short by a
lower limit on the samples of a scene.
"""

import faulthandler
import os
import pkgutil
import resource
import signal
import sys
import traceback
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple, NoReturn

import scipy

from hardwall.cli import app, board, synth, virtual_bench
from hardwall.cli.group import COMMANDS
from hardwall.sim import pictures
from hardwall.sim.estimates.accuracy import measure
from hardwall.sim.jobs import cluster, parallel, store
from hardwall.sim.rtl import shared_library
from hardwall.sim.scene import checks
from hardwall.sim.studies import bench
from hardwall.sim.walls import mapping

LOADED = (
    *(scipy.linalg, scipy.optimize, scipy.signal),
    *(import_module(f"hardwall.cli.{name}") for name in COMMANDS),
    *(import_module(f"hardwall.sim.pictures.{name}") for _, name, _ in pkgutil.iter_modules(pictures.__path__)),
)
"""What is otherwise loaded when it is used: here once, and not in every child."""
LIMIT_S = 300
"""The time after which a child counts as hung; it prints where, and ends. A loaded machine needs most of it."""
SAMPLES_MAX = 50_000
STEPS_MAX = 100
TIMEOUT_S = 0.5
RATE_MAX_HZ = 20_000
FILE_BYTES_MAX = 100 << 20
CRASHED, BEGAN = 70, 71


class Ended(NamedTuple):
    """How a child ended: its exit code, negative for a signal (SIGALRM if it hung), and what it printed."""

    code: int
    out: str
    err: str


class _Began(BaseException):
    """The work of an accepted call would begin here."""


def _begin(*_: Any, **__: Any) -> NoReturn:
    raise _Began


def _short(run: Callable) -> Callable:
    """Return `parallel.run` that does the work only if it is short."""

    def short(function: Callable, jobs: list[dict], *rest: Any, **more: Any) -> list[Any]:
        if jobs and (function is not measure or max(job["sample_hz"] for job in jobs) > RATE_MAX_HZ or len(jobs) > 4):
            raise _Began
        return run(function, jobs, *rest, **more)

    return short


def _shorten(folder: Path) -> None:
    """End this process where long work begins, and keep results in `folder`."""
    checks.SAMPLES_MAX, checks.STEPS_MAX, cluster.TIMEOUT_S = SAMPLES_MAX, STEPS_MAX, TIMEOUT_S
    parallel.run = _short(parallel.run)
    bench.study = mapping.run = shared_library.build = synth.synthesise = board.build = board.load_into = _begin
    virtual_bench.VirtualBench.connect = _begin
    store.build_dir = lambda: folder / "build"


def _child(arguments: tuple[str, ...], folder: Path) -> int:
    """Run the command line in this process; return its exit code."""
    for number, name in ((1, "stdout"), (2, "stderr")):
        os.dup2(os.open(folder / name, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600), number)
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    sys.stdout, sys.stderr = (open(number, "w", encoding="utf-8", closefd=False) for number in (1, 2))  # noqa: SIM115
    # `dump_traceback_later` would wait for a thread of pytest's own limit, which the fork does not have.
    faulthandler.register(signal.SIGALRM, file=2, chain=True)
    signal.alarm(LIMIT_S)
    resource.setrlimit(resource.RLIMIT_FSIZE, (FILE_BYTES_MAX, FILE_BYTES_MAX))
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)  # a file that is too large is then an error of writing
    work = folder / "work"
    os.chdir(work)
    _shorten(folder)
    sys.argv = ["hardwall", *arguments]
    try:
        app.main()
    except _Began:
        return BEGAN
    except SystemExit as exit_:
        return exit_.code if isinstance(exit_.code, int) else int(exit_.code is not None)
    except BaseException:
        traceback.print_exc()
        return CRASHED
    return 0


def run(arguments: tuple[str, ...], folder: Path, environ: dict[str, str]) -> Ended:
    """Return how `hardwall ARGUMENTS` ends in the folder `work` of an otherwise empty `folder`, with more variables."""
    child = os.fork()
    if not child:
        code = CRASHED
        try:
            os.environ.update(environ)
            code = _child(arguments, folder)
            sys.stdout.flush()
            sys.stderr.flush()
        finally:
            os._exit(code)
    _, status = os.waitpid(child, 0)
    out, err = ((folder / name).read_text(encoding="utf-8", errors="replace") for name in ("stdout", "stderr"))
    return Ended(os.waitstatus_to_exitcode(status), out, err)
