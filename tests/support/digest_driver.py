"""What the cases of `digests` share: how the program is run, how its output becomes entries, how entries are compared.

**Equal everywhere.** Words of hardware and of the bit-accurate model, verdicts, flags, texts and netlists.

**Equal on one kind of machine.** Results of float arithmetic are recorded in full, and must be equal to the last bit
where the processor and the versions of the libraries are those of the recording (`machine`). Elsewhere sums are
vectorised differently, and the C library and LAPACK choose other kernels; last bits differ, and the differences grow
along the computation. There numbers are compared within `TOLERANCE`, and digests of arrays of floats (`float64 ...`)
are not compared.

**Not recorded.** Times. A key that a report gains later is ignored; a key that disappears is a failure.
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
import tempfile
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any
from unittest import mock

import llvmlite.binding
import numpy as np
from numba.core import config

from support import netlists

FILE = Path(__file__).with_name("digests.json")
ROOT = next(folder for folder in FILE.parents if (folder / "pyproject.toml").exists())
TIMES = {"seconds", "samples_per_s"}
TOLERANCE = 1e-6
"""The relative tolerance between machines: errors of 1e-16 grow by some digits in a hit; a change of code is larger."""
LEAST = 1e-12
"""The absolute tolerance: numbers as small as this (in mm, N ...) are rounding errors themselves."""
FLOATS = "float64 "
"""The beginning of every digest of an array of floats."""


# ---- running the program --------------------------------------------------------------------------------------------


def program(*arguments: str) -> str:
    """Return what `hardwall ARGUMENTS` prints on stdout, run in this process.

    Raises:
        RuntimeError: if the command fails, with what it prints on stderr.
    """
    main = importlib.metadata.entry_points(group="console_scripts", name="hardwall")["hardwall"].load()
    try:
        with (
            contextlib.redirect_stdout(io.StringIO()) as out,
            contextlib.redirect_stderr(io.StringIO()) as err,
            mock.patch("sys.argv", ["hardwall", *arguments]),
            mock.patch("hardwall.model.runtime.termination.hear_signals"),  # the signals are those of the process
        ):
            main()
    except SystemExit:
        raise RuntimeError(f"hardwall {' '.join(arguments)}: {err.getvalue()}") from None
    return out.getvalue()


@cache
def _build() -> Path:
    """Return a folder for generated files that contains the earlier compiled files and no results.

    It lasts as long as the process, because compiled modules are cached under the path that was set at their import.
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
    """Change to a new folder that holds only the recording `recording.csv`, and hide the results of earlier runs."""
    with (
        tempfile.TemporaryDirectory() as folder,
        contextlib.chdir(folder),
        mock.patch.dict(os.environ, HARDWALL_BUILD=str(_build())),
    ):
        Path("recording.csv").write_text("\n".join(["counts", *map(str, recorded_counts())]) + "\n", encoding="utf-8")
        yield


def recorded_counts() -> list[int]:
    """Return 3 s of counts at 1 kHz: a parabola up and down, a rest and a ramp, with a tremor on all of them."""
    smooth = [k * (1000 - k) // 40 for k in range(1000)] + [0] * 700 + [-9 * k for k in range(1300)]
    return [count + 7 * k * k % 11 for k, count in enumerate(smooth)]


# ---- making entries of its output -----------------------------------------------------------------------------------


def timeless(value: Any) -> Any:
    """Return a report without its times."""
    if isinstance(value, dict):
        return {key: timeless(each) for key, each in value.items() if key not in TIMES}
    return [timeless(each) for each in value] if isinstance(value, list) else value


def whole(text: str) -> dict[str, Any]:
    """Return a report as one entry."""
    return {"": timeless(json.loads(text))}


def parts(text: str) -> dict[str, Any]:
    """Return a report as one entry for its plain values, and one for every item of its lists and tables."""
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
    """Return every row of `accuracy` as an entry."""
    return {f"{row['output']}/{row['signal']}/{row['sample_hz']:g}": row for row in timeless(json.loads(text)["rows"])}


def digest_of(array: np.ndarray) -> dict[str, Any]:
    """Return a summary of an array: its length, its digest to the last bit, and its RMS and mean."""
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
    """Return the digest of the axis that was written, and that of the tables of ports without their prose."""
    table = [line.rsplit(" | ", 1)[0] for line in Path("ports.md").read_text("utf-8").splitlines() if line[:1] == "|"]
    return {
        "circuit": netlists.digest(Path("axis.v"), "axis"),
        "ports": hashlib.sha256("\n".join(table).encode()).hexdigest(),
    }


def board_netlist(text: str) -> dict[str, Any]:
    """Return the digest of the board that was written."""
    return {"": netlists.digest(Path("board.v"), "board")}


# ---- comparing entries ----------------------------------------------------------------------------------------------


def machine() -> dict[str, str]:
    """Return what float arithmetic may depend on: the kind of processor, and the versions of numerical libraries."""
    kind = config.CPU_NAME or llvmlite.binding.get_host_cpu_name()
    versions = {name: importlib.metadata.version(name) for name in ("llvmlite", "numba", "numpy", "scipy")}
    python = ".".join(platform.python_version_tuple()[:2])
    return {
        "processor": f"{platform.machine()} {kind}",
        "libc": " ".join(platform.libc_ver()),
        "python": python,
    } | versions


def differences(recorded: Any, found: Any, exact: bool, place: str = "") -> list[str]:
    """Return one line for every difference between a recorded report and a new one.

    Args:
        recorded, found: the recorded and the new report; keys that only `found` has are ignored.
        exact: whether floats must be equal; otherwise they must agree within `TOLERANCE`.
        place: the beginning of every line.
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
    # Compared as text, infinities and NaN equal themselves, and 1 differs from true.
    same = same or json.dumps(recorded) == json.dumps(found)
    return [] if same else [f"{place}: was {recorded!r}, is {found!r}"]


def belongs(entry: str, case: str) -> bool:
    """Return whether an entry belongs to the case of that name."""
    return f"{entry}/".startswith(f"{case}/")


# ---- the file -------------------------------------------------------------------------------------------------------


def load() -> dict[str, Any]:
    """Return the contents of the file: the `machine`, and the `entries` by name."""
    return json.loads(FILE.read_text(encoding="utf-8")) if FILE.exists() else {"machine": {}, "entries": {}}


def save(entries: dict[str, Any]) -> None:
    """Write the file with one entry a line, sorted by name."""
    lines = [f"{json.dumps(name)}: {json.dumps(entries[name])}" for name in sorted(entries)]
    text = f'{{\n"machine": {json.dumps(machine())},\n"entries": {{\n' + ",\n".join(lines) + "\n}\n}\n"
    FILE.write_text(text, encoding="utf-8")
