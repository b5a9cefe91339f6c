"""What the program computes, as digests in `digests.json`: recorded by `make digests`, held by `test_digests`.

The program is driven through its command line alone, so that its files may move and its functions may change their
names. Every entry has a name of its own and a line of its own in the file: a diff shows what changed.

**What is equal everywhere.** Words of hardware and of the bit-accurate model, verdicts, flags, texts and netlists.

**What is equal on one kind of machine.** Results of float arithmetic are recorded in full, and must be equal to the
last bit where the processor and the versions of the libraries are those of the recording (`machine`). Elsewhere sums
are vectorised otherwise, and the C library and LAPACK choose other kernels; last bits differ, and grow on the way.
There numbers are compared within `TOLERANCE`, and digests of arrays of floats (`float64 ...`) are not compared.

**What is not recorded.** Times. What is added to a report later is of no interest; what is gone is a failure.

    make digests                    record everything anew, and say what changed
    make digests ONLY=hit/mhz       only those cases whose names begin so
"""

import atexit
import contextlib
import csv
import hashlib
import importlib.metadata
import io
import json
import math
import os
import platform
import shutil
import signal
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any
from unittest import mock

import llvmlite.binding
import netlists
import numpy as np
from numba.core import config

FILE = Path(__file__).with_name("digests.json")
ROOT = next(folder for folder in FILE.parents if (folder / "pyproject.toml").exists())
TIMES = {"seconds", "samples_per_s"}
TOLERANCE = 1e-6
"""Relative, between machines: errors of 1e-16 grow by some digits in a hit, and a change of the code is larger."""
LEAST = 1e-12
"""Numbers that are this small (in mm, N ...) are rounding errors themselves."""
FLOATS = "float64 "

OUTPUTS = {
    "fdm": ("u",),
    "levant": ("u", "u1"),
    "butterworth": ("u",),
    "kalman": ("u",),
    "period": ("u",),
    "period-count": ("u",),
    "levant-edge": ("u",),
    "levant-semi-implicit": ("u", "u1"),
    "levant-implicit": ("u", "u1"),
    "levant-adaptive": ("u", "u1"),
    "window": ("u",),
    "foaw": ("end-fit", "best-fit"),
}
SCENES = ("seed-2011", "fit-2011", "drive-2011", "mhz", "desktop-arm", "maglev")
FEW = ("levant", "kalman", "period", "foaw")
"""Estimators of every kind: count or stamps, scalars or arrays for a state."""


def setting(section: str, **values: Any) -> list[str]:
    """Return the options that change keys of a section."""
    return [word for key, value in values.items() for word in ("--set", f"{section}.{key}={value}")]


SHORT = setting("protocol", start_m=-0.002, settle_s=0.3, mean_s=0.05, measure_s=0.1)
SHORTEST = setting("protocol", start_m=-0.001, settle_s=0.2, mean_s=0.03, measure_s=0.05, threshold_mm=0.02)
# Walls that are stable, and walls that are not, before the handle has quite come to rest.
MAPPED = setting("protocol", start_m=-0.002, settle_s=0.5, mean_s=0.05, measure_s=0.1, threshold_mm=0.02)
GRID = setting(
    "zwidth",
    stiffness_step_n_per_m=5e3,
    stiffness_to_n_per_m=80e3,
    damping_from_n_s_per_m=20.0,
    damping_to_n_s_per_m=180.0,
    damping_step_n_s_per_m=40.0,
)
# Parts of a device that no scene of the project's own has.
VARIANTS = {
    "euler": ("drive-2011", setting("solver", step_s=2e-5)),
    "euler-rigid": ("seed-2011", setting("solver", step_s=2e-5)),
    "hand": ("seed-2011", setting("hand", mass_kg=0.1, damping_n_s_per_m=2.0, stiffness_n_per_m=50.0, rest_m=1e-3)),
    "encoder-errors": ("seed-2011", setting("encoder", phase_error_counts=0.3, duty_error_counts=0.1)),
    "encoder-at-motor": ("drive-2011", setting("transmission", encoder_at='"motor"')),
    "voltage": ("drive-2011", setting("amplifier", bandwidth_hz="", current_limit_a="")),
    "pwm": ("mhz", setting("output", full_scale_n=40.0, pwm_carrier_hz=50_000, pwm_steps=1000)),
    "dac": ("seed-2011", setting("output", full_scale_n=40.0, dac_bits=10)),
    "guards": ("seed-2011", [*setting("wall", forbid_pull="true"), *setting("controller", slew_limit_n_per_s=500.0)]),
}


@dataclass(frozen=True)
class Case:
    """One call of the program.

    Attributes:
        name: how the names of its entries begin.
        arguments: of the command line.
        entries: what it makes of the words on stdout: entries by the rest of their name, or by "" for the only one.
        short: whether it is held by every `make test`.
    """

    name: str
    arguments: tuple[str, ...]
    entries: Callable[[str], dict[str, Any]]
    short: bool = False

    def run(self) -> dict[str, Any]:
        """Return what the program computes now, by the names of entries."""
        with working_folder():
            found = self.entries(program(*self.arguments))
        return {f"{self.name}/{rest}".rstrip("/"): value for rest, value in found.items()}


# ---- how the program is driven --------------------------------------------------------------------------------------


def program(*arguments: str) -> str:
    """Return what `hardwall ARGUMENTS` prints on stdout, run in this process.

    Raises:
        RuntimeError: with what it says on stderr if it fails.
    """
    main = importlib.metadata.entry_points(group="console_scripts", name="hardwall")["hardwall"].load()
    handler = signal.getsignal(signal.SIGINT)
    try:
        with (
            contextlib.redirect_stdout(io.StringIO()) as out,
            contextlib.redirect_stderr(io.StringIO()) as err,
            mock.patch("sys.argv", ["hardwall", *arguments]),
        ):
            main()
    except SystemExit:
        raise RuntimeError(f"hardwall {' '.join(arguments)}: {err.getvalue()}") from None
    finally:
        signal.signal(signal.SIGINT, handler)
    return out.getvalue()


@cache
def _build() -> Path:
    """Return a folder for generated files that has what was compiled before, and no results.

    It lasts as long as the process: what is compiled is kept by the path that was known when it was imported.
    """
    kept = Path(os.environ.get("HARDWALL_BUILD", ROOT / "build")).absolute()
    folder = Path(tempfile.mkdtemp(prefix="digests-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    for name in ("numba", "rtl", "ccache"):
        (kept / name).mkdir(parents=True, exist_ok=True)
        (folder / name).symlink_to(kept / name)
    return folder


@contextlib.contextmanager
def working_folder() -> Iterator[None]:
    """Be in an empty folder, with the recording `recording.csv`, where no result of an earlier run is known."""
    with (
        tempfile.TemporaryDirectory() as folder,
        contextlib.chdir(folder),
        mock.patch.dict(os.environ, HARDWALL_BUILD=str(_build())),
    ):
        Path("recording.csv").write_text("\n".join(["counts", *map(str, recorded_counts())]) + "\n", encoding="utf-8")
        yield


def recorded_counts() -> list[int]:
    """Return 3 s of counts at 1 kHz, in whole numbers: a parabola up and down, a rest, a ramp, and a tremor on all."""
    smooth = [k * (1000 - k) // 40 for k in range(1000)] + [0] * 700 + [-9 * k for k in range(1300)]
    return [count + 7 * k * k % 11 for k, count in enumerate(smooth)]


# ---- what is made of its words --------------------------------------------------------------------------------------


def timeless(value: Any) -> Any:
    """Return a report without its times."""
    if isinstance(value, dict):
        return {key: timeless(each) for key, each in value.items() if key not in TIMES}
    return [timeless(each) for each in value] if isinstance(value, list) else value


def whole(text: str) -> dict[str, Any]:
    """Return a report as one entry."""
    return {"": timeless(json.loads(text))}


def parts(text: str) -> dict[str, Any]:
    """Return a report as an entry for what it says itself, and one for each part of its lists and of its tables."""
    return _parts(timeless(json.loads(text)), "")


def _parts(report: dict, name: str) -> dict[str, Any]:
    own, entries = {}, {}
    for key, value in report.items():
        inner = {}
        if isinstance(value, list) and value and isinstance(value[0], dict):
            inner = {f"{number:02}": each for number, each in enumerate(value)}
        elif isinstance(value, dict) and not name:
            inner = value
        for each, part in inner.items():
            entries |= _parts(part, f"{name}{key}/{each}/")
        if not inner:
            own[key] = value
    return {name.rstrip("/"): own} | entries


def rows(text: str) -> dict[str, Any]:
    """Return the rows of `accuracy`, each an entry."""
    return {f"{row['output']}/{row['signal']}/{row['sample_hz']:g}": row for row in timeless(json.loads(text))}


def digest_of(array: np.ndarray) -> dict[str, Any]:
    """Return what an array holds: its length, its digest to the last bit, and two figures that round."""
    digest = hashlib.sha256(array.astype("<f8").tobytes()).hexdigest()
    figures = {"rms": float(np.sqrt(np.mean(array**2))), "mean": float(np.mean(array))} if len(array) else {}
    return {"length": len(array), "digest": FLOATS + digest} | figures


def traced(text: str) -> dict[str, Any]:
    """Return the report of a hit, and the arrays of its `trace.npz`."""
    with np.load("trace.npz") as arrays:
        kept = {name: digest_of(array) for name, array in arrays.items() if array.dtype == np.float64}
    return whole(text) | kept


def replayed(text: str) -> dict[str, Any]:
    """Return the report of a replay, and the columns of its `out.csv`."""
    with Path("out.csv").open(encoding="utf-8", newline="") as file:
        lines = list(csv.DictReader(file))
    return whole(text) | {name: digest_of(np.array([float(line[name]) for line in lines])) for name in lines[0]}


def axis_netlist(text: str) -> dict[str, Any]:
    """Return the digest of the axis that was written, and of the tables of ports but for their prose."""
    table = [line.rsplit(" | ", 1)[0] for line in Path("ports.md").read_text("utf-8").splitlines() if line[:1] == "|"]
    return {
        "circuit": netlists.digest(Path("axis.v"), "axis"),
        "ports": hashlib.sha256("\n".join(table).encode()).hexdigest(),
    }


def board_netlist(text: str) -> dict[str, Any]:
    """Return the digest of the board that was written."""
    return {"": netlists.digest(Path("board.v"), "board")}


# ---- the cases ------------------------------------------------------------------------------------------------------


def cases() -> list[Case]:
    """Return every case."""
    return [*_hits(), *_traces(), *_estimates(), *_walls(), *_netlists()]


def _hit(scene: str, estimator: str, output: str, backend: str) -> tuple[str, ...]:
    return ("hit", scene, "--estimator", estimator, "--output", output, "--backend", backend, "--json")


def _hits() -> Iterator[Case]:
    for scene in SCENES:
        for estimator, output in ((name, output) for name, outputs in OUTPUTS.items() for output in outputs):
            for backend in ("float", "fixed", "rtl"):
                if backend == "rtl" and scene != "seed-2011" and (estimator, output) != ("levant", "u"):
                    continue  # each would be a build of its own, and the words are those of `fixed`
                own = scene == "seed-2011" and (backend == "fixed" or (estimator in FEW and backend == "float"))
                short = own or (estimator, output, backend) == ("levant", "u", "fixed")
                short = short or (scene, estimator, output, backend) == ("seed-2011", "levant", "u", "rtl")
                name = f"hit/{scene}/{estimator}:{output}/{backend}"
                yield Case(name, (*_hit(scene, estimator, output, backend), *SHORT), whole, short)
    for variant, (scene, options) in VARIANTS.items():
        for backend in ("float", "fixed"):
            arguments = (*_hit(scene, "levant", "u", backend), *SHORT, *options)
            yield Case(f"hit/{scene}, {variant}/levant:u/{backend}", arguments, whole, backend == "fixed")


def _traces() -> Iterator[Case]:
    for scene in ("seed-2011", "drive-2011", "mhz"):
        for backend in ("float", "fixed", "rtl"):
            arguments = (*_hit(scene, "levant", "u", backend), *SHORT, "--trace", "trace.npz")
            yield Case(f"trace/{scene}/{backend}", arguments, traced, scene == "seed-2011" or backend == "fixed")


def _estimates() -> Iterator[Case]:
    for estimator in OUTPUTS:
        for backend in ("float", "fixed"):
            arguments = ("accuracy", "--estimators", estimator, "--rates", "1e4,1e5", "--backend", backend)
            arguments += ("--signal", "stop", "--signal", "flicker", "--workers", "1", "--json")
            yield Case(f"accuracy/{estimator}/{backend}", arguments, rows, estimator in FEW)
    for estimator in FEW:
        for backend in ("float", "fixed", "rtl"):
            arguments = ("replay", "recording.csv", "--column", "counts", "--rate", "1000", "--coarsen", "4")
            arguments += ("--estimator", estimator, "--backend", backend, "--out", "out.csv", "--json")
            yield Case(f"replay/{estimator}/{backend}", arguments, replayed, backend != "rtl" or estimator == "levant")


def _walls() -> Iterator[Case]:
    workers = ("--workers", "1", "--json")
    for scene in ("seed-2011", "drive-2011"):
        short = scene == "seed-2011"
        yield Case(f"lipschitz/{scene}", ("lipschitz", scene, *SHORT, "--json"), whole, short)
        for backend in ("float", "fixed"):
            options = ("--backend", backend, *MAPPED, *GRID, *workers)
            yield Case(f"zwidth/{scene}/{backend}", ("zwidth", scene, *options), parts, short and backend == "fixed")
    yield Case("cutoff/seed-2011", ("cutoff", "seed-2011", *MAPPED, *GRID, *workers), parts, short=True)
    yield Case("drop/seed-2011", ("drop", "seed-2011", *SHORTEST, *GRID, *workers), parts, short=True)


def _netlists() -> Iterator[Case]:
    for estimator in OUTPUTS:
        arguments = ("verilog", "mhz", "--estimator", estimator)
        yield Case(f"axis/{estimator}", arguments, axis_netlist, short=True)
        yield Case(f"board/{estimator}", arguments, board_netlist, estimator == "levant")


# ---- what is held against what --------------------------------------------------------------------------------------


def machine() -> dict[str, str]:
    """Return what float arithmetic may depend on: the kind of processor, and the versions of what computes."""
    kind = config.CPU_NAME or llvmlite.binding.get_host_cpu_name()
    versions = {name: importlib.metadata.version(name) for name in ("llvmlite", "numba", "numpy", "scipy")}
    python = ".".join(platform.python_version_tuple()[:2])
    return {
        "processor": f"{platform.machine()} {kind}",
        "libc": " ".join(platform.libc_ver()),
        "python": python,
    } | versions


def differences(recorded: Any, found: Any, exact: bool, place: str = "") -> list[str]:
    """Return where what is found differs from what was recorded, a line each.

    Args:
        recorded, found: reports; keys that only `found` has are of no interest.
        exact: whether floats are to be equal, or within `TOLERANCE`.
        place: how the lines begin.
    """
    if isinstance(recorded, dict) and isinstance(found, dict):
        lines = [f"{place}.{key}: is gone" for key in recorded if key not in found]
        both = [key for key in recorded if key in found]
        return lines + [
            line for key in both for line in differences(recorded[key], found[key], exact, f"{place}.{key}")
        ]
    if isinstance(recorded, list) and isinstance(found, list) and len(recorded) == len(found):
        pairs = enumerate(zip(recorded, found, strict=True))
        return [line for number, pair in pairs for line in differences(*pair, exact, f"{place}[{number}]")]
    if not exact and isinstance(recorded, str) and recorded.startswith(FLOATS) and isinstance(found, str):
        return []
    if not exact and isinstance(recorded, float) and isinstance(found, float):
        same = math.isclose(recorded, found, rel_tol=TOLERANCE, abs_tol=LEAST)
    else:
        same = False
    # As text, an infinity and a number that is none are equal to themselves, and 1 is not true.
    same = same or json.dumps(recorded) == json.dumps(found)
    return [] if same else [f"{place}: was {recorded!r}, is {found!r}"]


def belongs(entry: str, case: str) -> bool:
    """Return whether an entry is of the case of that name."""
    return f"{entry}/".startswith(f"{case}/")


# ---- recording ------------------------------------------------------------------------------------------------------


def load() -> dict[str, Any]:
    """Return what is in the file: the `machine`, and the `entries` by name."""
    return json.loads(FILE.read_text(encoding="utf-8")) if FILE.exists() else {"machine": {}, "entries": {}}


def save(entries: dict[str, Any]) -> None:
    """Write the file, an entry a line, sorted by name."""
    lines = [f"{json.dumps(name)}: {json.dumps(entries[name])}" for name in sorted(entries)]
    text = f'{{\n"machine": {json.dumps(machine())},\n"entries": {{\n' + ",\n".join(lines) + "\n}\n}\n"
    FILE.write_text(text, encoding="utf-8")


def record(only: str) -> None:
    """Record the cases whose names begin with `only`, and print which entries changed, came and went."""
    before = load()
    if only and before["machine"] != machine():
        sys.exit("digests.json is of another kind of machine: record everything, without ONLY")
    chosen = [case for case in cases() if case.name.startswith(only)]
    if not chosen:
        sys.exit(
            f"no case begins with {only!r}; they are of {', '.join(sorted({c.name.split('/')[0] for c in cases()}))}"
        )
    found: dict[str, Any] = {}
    for number, case in enumerate(chosen, 1):
        print(f"\r\033[K{number} of {len(chosen)}: {case.name}", end="", file=sys.stderr, flush=True)
        found |= case.run()
    print("\r\033[K", end="", file=sys.stderr)
    old = before["entries"]
    touched = {name for name in old if not only or any(belongs(name, case.name) for case in chosen)}
    for name in sorted(touched | set(found)):
        if name not in found:
            print(f"gone: {name}")
        elif name not in old:
            print(f"new: {name}")
        elif old[name] != found[name]:
            print(f"changed: {name}", *differences(old[name], found[name], True), sep="\n  ")
    save({name: value for name, value in old.items() if name not in touched} | found)
    print(f"{len(found)} entries of {len(chosen)} cases recorded in {FILE.name}")


if __name__ == "__main__":
    record(sys.argv[1] if len(sys.argv) > 1 else "")
