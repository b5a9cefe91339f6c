"""From an axis to a bitstream on a board, with what its user needs beside it: one folder, whole or not at all."""

import hashlib
import json
import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from ...model import register_header, register_texts
from ...model.axes.axis import AxesSpec
from ...model.runtime.result import text_of
from ...model.spec import AxisSpec
from ..boards.description import Description
from ..boards.picture import picture
from ..boards.wiring import wiring, wiring_of_axes
from ..jobs.named_folder import write_folder
from . import flow, tools
from .flow import Design, Files
from .readback import check
from .synthesis import Placed, placed, summary

PICTURE = "wiring.svg"


class TimingError(RuntimeError):
    """No seed reached the clock; the message is one line with this clock and the highest one reached."""


@dataclass(frozen=True)
class Order:
    """The order for a bitstream.

    Attributes:
        board: the board.
        scene: the name of the scene, for the report.
        spec: its axis, or several with its requirements.
        glitch_clocks: the decoder's glitch filter, which is part of the latency.
        seeds: the most seeds that are tried until one reaches the clock.
    """

    board: Description
    scene: str
    spec: AxisSpec | AxesSpec
    glitch_clocks: int
    seeds: int


def build(order: Order, folder: Path) -> dict:
    """Build the bitstream of an axis on a board, and put it with all that belongs to it into a folder.

    Args:
        order: what to build.
        folder: the folder, which may be replaced: see `named_folder.foreign`.

    Returns:
        The result of `summary` for the packed seed, and: board, scene: as ordered. seeds, fmax_mhz_seeds: the tried
        seeds, and the highest clock with each; seed: the last one, which is packed. oscillator_mhz, pll: the board's
        oscillator, and the dividers that make the clock of it; none without a PLL. stage, full_scale_n: the drive
        stage, and the force of its full scale, of pulses that never pause for example. baud, identity: the rate of the
        serial line, and the identity of the registers, which a host reads. bitstream, sha256: the name of the
        bitstream's file, and its digest.

    Raises:
        FieldError: if the board has no pins for so many axes.
        ClockError: if the board cannot make the clock.
        TimingError: if no seed reaches the clock.
        DoesNotFitError: if the part has too few cells.
        SynthesisError: if a tool is missing or fails, or a bitstream is not what was placed.
        OSError: if the folder cannot be written.
    """
    design = flow.synthesised(order.board, order.spec)
    runs = list(_until_met(design, order.seeds))
    if not _meets(design, runs[-1]):
        best = max(runs, key=lambda run: run.fmax_mhz)
        raise TimingError(
            f"{order.board.name} misses the clock of {order.spec.clock_hz / 1e6:g} MHz: the highest of {len(runs)} "
            f"seeds is {best.fmax_mhz:.2f} MHz ({best.path}, {best.longest:.1f} ns)"
        )
    report: dict = {}
    write_folder(folder, partial(_fill, order, design, runs, report))
    return report


def _meets(design: Design, run: Placed) -> bool:
    return run.fmax_mhz * 1e6 >= design.top.spec.clock_hz


def _until_met(design: Design, most: int) -> Iterator[Placed]:
    """Yield placements with one seed after the other, up to the first that reaches the clock."""
    for seed in range(1, most + 1):
        run = placed(design, seed)
        yield run
        if _meets(design, run):
            return


def _fill(order: Order, design: Design, runs: list[Placed], report: dict, work: Path) -> None:
    """Write every file of a board's folder, and what there is to report."""
    board, names = design.board, Files.of(design.board)
    for name in ("board.v", "top.v", names.pins):
        shutil.copyfile(design.folder / name, work / name)
    pack(board, runs[-1].folder, work)
    report |= _report(order, design, runs, (work / names.bitstream).read_bytes())
    registers = design.top.registers
    texts = {
        "registers.md": register_texts.markdown(registers),
        "registers.h": register_header.header(registers),
        "registers.json": register_texts.as_json(registers),
        **pages(board, order.spec),
        "report.json": json.dumps(report, indent=2) + "\n",
        "report.txt": "".join(f"{key}: {text_of(value)}\n" for key, value in report.items()),
    }
    for name, text in texts.items():
        (work / name).write_text(text, encoding="utf-8", newline="\n")


def pages(board: Description, spec: AxisSpec | AxesSpec) -> dict[str, str]:
    """Return the wiring instructions: a page, and for a single axis a picture."""
    if isinstance(spec, AxesSpec):
        return {"WIRING.md": wiring_of_axes(board, spec)}
    return {"WIRING.md": wiring(board, spec, PICTURE), PICTURE: picture(board, spec.stage.name)}


def pack(board: Description, run: Path, work: Path) -> None:
    """Pack what nextpnr wrote into the folder `run`, and put the bitstream into `work`; read it back, and compare.

    Raises:
        SynthesisError: if a tool is missing or fails, or the bitstream is not what was placed.
    """
    names, part = Files.of(board), board.part
    # Some tools see nothing but the folder that they run in.
    shutil.copyfile(run / names.routed, work / names.routed)
    unpacked = work / f"unpacked{part.suffixes.unpacked}"
    log = work / "pack.log"
    for command in (part.pack, part.unpack):
        filled = names.fill(command, unpacked.name)
        tools.run(work, log, filled, f"{filled[0]} for {board.name}")
    check(board, work / names.routed, unpacked, work / names.bitstream)
    for path in (work / names.routed, unpacked, log):
        path.unlink()


def _report(order: Order, design: Design, runs: list[Placed], bitstream: bytes) -> dict:
    board, top = design.board, design.top
    setting = board.setting(order.spec.clock_hz)
    return {
        "board": board.name,
        "scene": order.scene,
        **summary(design, runs[-1:], order.glitch_clocks),
        "seeds": [run.seed for run in runs],
        "fmax_mhz_seeds": [round(run.fmax_mhz, 2) for run in runs],
        "seed": runs[-1].seed,
        "oscillator_mhz": board.oscillator_hz / 1e6,
        "pll": dict(setting.dividers) if setting else {},
        "stage": order.spec.stage.name,
        "full_scale_n": order.spec.drive.full_scale_n,
        "baud": top.link.baud,
        "identity": top.registers.identity,
        "bitstream": Files.of(board).bitstream,
        "sha256": hashlib.sha256(bitstream).hexdigest(),
    }
