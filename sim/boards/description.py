"""Descriptions of boards, a TOML file each in this folder: the only place that has their pins and oscillators.

A file describes a board and its variants, which differ in the part alone:

    title, sources: the board's name for people, and where pins and levels are taken from.
    oscillator_hz: the frequency of the pin `clk`.
    loader, loads: the name by which openFPGALoader knows it, and where that can put a bitstream: sram, flash.
    power_up: what the pins do until the part is configured.
    notes: what else to know before anything is connected.
    [parts]: the part of every variant, by the variant's name, which `hardwall board` takes.
    [axes]: the pairs of pins that several axes have, if the board has room for them.
    [scene]: the scene that the board runs if none is given, and the changes of its keys.
    [serial]: which of the USB bridge's serial ports is the line; its name in /dev/serial/by-id; the bridge's USB ids.
    [pins.SIGNAL]: for each of `EVERY` the FPGA's pin (`site`), where that is (`at`: the header and the position, or
        words), and the pull inside the part. Drive stages share pins, for a board has one of them.
    [[headers]]: the headers that are drawn: name, title, and rows of positions as they lie side by side.
"""

import tomllib
from dataclasses import dataclass, field, replace
from importlib.resources import files
from typing import Any, Literal

from ...model.checks import FieldError
from .parts import PARTS, Part
from .pll import Setting
from .signals import EVERY, OF_AXIS, SHARED_LOOPS

Pull = Literal["up", "down", "none"]
Memory = Literal["sram", "flash"]


@dataclass(frozen=True)
class Pin:
    """A pin of the FPGA: its name, where it can be reached, and the pull inside the part."""

    site: str
    at: str
    pull: Pull = "none"


@dataclass(frozen=True)
class Header:
    """A header: its name, a title for people, and its positions as they lie, row by row; an empty one is a gap."""

    name: str
    title: str
    rows: tuple[tuple[str, ...], ...]


@dataclass(frozen=True)
class Serial:
    """The serial port of a board's own USB bridge.

    Attributes:
        port: which of the bridge's ports is the line, counted from 0.
        ports: how many it has.
        by_id: the port's name in /dev/serial/by-id, with a `*` for what differs from board to board.
        vendor, product: the bridge's USB ids, hexadecimal.
        latency: whether the bridge has the latency timer of FTDI.
    """

    port: int
    ports: int
    by_id: str
    vendor: str
    product: str
    latency: bool


@dataclass(frozen=True)
class Description:
    """A board with one of its parts; the attributes are the keys of its file."""

    name: str
    family: str
    device: str
    title: str
    sources: tuple[str, ...]
    oscillator_hz: int
    loader: str
    loads: tuple[Memory, ...]
    power_up: str
    notes: tuple[str, ...]
    scene: str
    changes: dict[str, Any] = field(hash=False)
    serial: Serial
    pins: dict[str, Pin] = field(hash=False)
    headers: tuple[Header, ...]
    pairs: tuple[tuple[str, str, str], ...] = ()

    @property
    def most_axes(self) -> int:
        """The most axes that it has pins for; 0 if it has pins for one axis only."""
        return max((2 * len(self.pairs) - len(SHARED_LOOPS)) // len(OF_AXIS), 0)

    def of_axes(self, axes: int) -> "Description":
        """Return the board with the pins of several axes: six for each, in pairs, and the loops behind the last.

        Raises:
            FieldError: if it has no pins for so many.
        """
        if axes > self.most_axes:
            has_none = f"absent on {self.name} (its pins are those of a single axis)"
            most = f"at most {self.most_axes} on {self.name}" if self.most_axes else has_none
            raise FieldError("axes", f"must be {most}, not {axes!r}")
        free = iter(
            [(f"{at}{sign}", site) for at, *sites in self.pairs for sign, site in zip("+-", sites, strict=True)]
        )
        names = [(f"{name}_{axis}", name) for axis in range(axes) for name in OF_AXIS]
        pins = {name: self.pins[name] for name in ("clk", "rst", "uart_rx", "uart_tx")}
        for name, alone in (*names, *((loop, loop) for loop in SHARED_LOOPS)):
            at, site = next(free)
            pins[name] = Pin(site, at, self.pins[alone].pull)
        return replace(self, pins=pins)

    @property
    def part(self) -> Part:
        """The part."""
        return PARTS[self.device]

    def setting(self, clock_hz: int) -> Setting | None:
        """Return how the PLL makes a clock; None for the oscillator's own, which needs no PLL.

        Raises:
            ClockError: if the board cannot make it.
        """
        return None if clock_hz == self.oscillator_hz else self.part.pll.setting(self.oscillator_hz, clock_hz)


def _read(family: str, text: str) -> dict[str, Description]:
    """Return the variants of a board from the text of its file."""
    table = tomllib.loads(text)
    pairs = table.pop("axes", {"pairs": []})["pairs"]
    parts, scene = table.pop("parts"), table.pop("scene")
    common = {
        **table,
        **{key: tuple(table[key]) for key in ("sources", "loads", "notes")},
        "pairs": tuple(map(tuple, pairs)),
        "scene": scene["name"],
        "changes": scene["changes"],
        "serial": Serial(**table["serial"]),
        "pins": {signal.name: Pin(**table["pins"].pop(signal.name)) for signal in EVERY},
        "headers": tuple(
            Header(each["name"], each["title"], tuple(map(tuple, each["rows"]))) for each in table["headers"]
        ),
    }
    if table["pins"]:
        raise ValueError(f"{family}: pins must be of {', '.join(each.name for each in EVERY)}, not {table['pins']}")
    return {name: Description(name=name, family=family, device=device, **common) for name, device in parts.items()}


def _all() -> dict[str, Description]:
    """Return every variant of every board whose file is in this folder, by name."""
    folder = files(__package__)
    names = sorted(path.name for path in folder.iterdir() if path.name.endswith(".toml"))
    found = [_read(name.removesuffix(".toml"), (folder / name).read_text(encoding="utf-8")) for name in names]
    return {name: board for boards in found for name, board in boards.items()}


BOARDS = _all()
"""Every board with every part that it comes with, by name."""


def board_of(device: str) -> Description:
    """Return the board that stands for a part: the only one with it."""
    return next(board for board in BOARDS.values() if board.device == device)
