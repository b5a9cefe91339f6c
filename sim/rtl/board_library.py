"""The Verilated board with what is around it, as a shared library: clocks, the other end of its line, an amplifier.

A board has the pins of packages; behind its line is a host of bytes, and behind its drive an amplifier for its stage.
They, and the faults of wires, are in `around_board.v`, `amplifiers.v` and `board_library.cpp`. The board is its
Verilog, or the netlist that Yosys maps it to, with models of the cells of a family of FPGAs.
"""

import ctypes
import functools
import logging
from pathlib import Path
from typing import Literal, get_args

import numpy as np

from ...hdl.axis.board import Board
from ...hdl.export import to_netlist, to_verilog
from ...hdl.link.link import Link
from ...model.axis.registers import RegisterMap
from ...model.drive import dac
from ...model.spec import AxisSpec
from . import board_ports, board_resting, netlist, shared_library
from .board_resting import BoardResting
from .families import FAMILIES
from .resting import RestsNotError
from .shared_library import Recipe
from .verilated import Rtl, RtlState

AROUND, AMPLIFIERS, SHIM, RESTING = (
    Path(__file__).with_name(name)
    for name in ("around_board.v", "amplifiers.v", "board_library.cpp", "board_resting.h")
)
logger = logging.getLogger(__name__)
OSCILLATOR_HZ = 2.4e6
"""About the frequency of the oscillator beside the clock; the clock has a whole number of it in every half period."""
ROOM = 1024
"""Bytes from the board that are kept until they are taken."""

Wire = Literal["a", "b", "a_n", "b_n"]
Level = Literal["sound", "low", "high", "inverted"]
Switch = Literal["drive_enable", "external_fault", "emergency_stop", "clock"]
WIRES: tuple[Wire, ...] = get_args(Wire)
LEVELS: tuple[Level, ...] = get_args(Level)
SWITCHES: tuple[Switch, ...] = get_args(Switch)


@functools.lru_cache(maxsize=1 << 3)
def _board(spec: AxisSpec, baud: int | None) -> tuple[Board, str]:
    board = Board(spec, None if baud is None else Link(RegisterMap(spec), baud))
    return board, to_verilog(board, "board")


def build(spec: AxisSpec, baud: int | None = None, family: str | None = None) -> Path:
    """Return the shared library of the board, with a serial line of that rate; build it first if it is missing.

    Args:
        spec: the axis.
        baud: the rate of the serial line; None for the board's own.
        family: the family of FPGAs whose netlist is the board, one of `FAMILIES`; None for the board's Verilog.

    Raises:
        BuildError: if the build fails.
        SynthesisError: if Yosys is missing or fails.
    """
    board, verilog = _board(spec, baud)
    around = {
        "BIT_PARTS": round(256 * spec.clock_hz / board.link.baud),
        "OSCILLATOR_CLOCKS": max(round(spec.clock_hz / OSCILLATOR_HZ / 2), 1),
    }
    around |= of_dac(spec)
    options = ("--top-module", "around_board", *(f"-G{name}={value}" for name, value in around.items()))
    options += (f"-DSTAGE_{spec.stage.name.upper()}",)
    rest = None
    if family is None:
        rest = _resting(board)
    else:
        mapped = netlist.mapped(board, FAMILIES[family], "board")
        verilog, options = f"{mapped.gates}\n{mapped.models}", (*options, *netlist.OPTIONS)
    header = board_ports.header(spec, rest, around["OSCILLATOR_CLOCKS"])
    files = {"board.v": verilog, board_ports.HEADER: header}
    files |= {path.name: path.read_text(encoding="utf-8") for path in (AROUND, AMPLIFIERS, SHIM, RESTING)}
    options += board_ports.options(rest)
    return shared_library.build(Recipe(files, SHIM.name, "Vboard", options, members=board_ports.members(rest)))


def _resting(board: Board) -> BoardResting | None:
    """Return how a board rests; None, with a warning, if none of its clocks can be left out."""
    try:
        return board_resting.check(to_netlist(board, "board"))
    except RestsNotError as error:
        logger.warning(f"the virtual board runs every clock, for {error}")
    return None


def of_dac(spec: AxisSpec) -> dict[str, int]:
    """Return what the simulated DAC is to know of its frames, by parameters of `around_board`; nothing without one."""
    stage, design = spec.stage, spec.drive
    if not isinstance(stage, dac.Stage) or not isinstance(design, dac.Design):
        return {}
    return {
        "DAC_BITS": stage.bits,
        "DAC_HEADER_BITS": stage.header_bits,
        "DAC_HEADER": stage.header,
        "DAC_TRAILING_BITS": stage.trailing_bits,
        "DAC_FLIP": int(stage.coding == "offset-binary"),
        "DAC_TAKES": int(stage.mode in (0, 3)),
        "DAC_OFFSET": design.offset,
        "DAC_NEEDS": len(stage.setup),
        "DAC_SETUP": stage.setup[-1] if stage.setup else 0,
    }


class BoardHardware:
    """A reset board, simulated clock by clock; a context manager that frees it.

    Args:
        spec: the axis.
        number: the handle's count at the start.
        turn_counts: counts between two pulses of the encoder's index.
        baud: the rate of the serial line; None for the board's own.
        family: the family of FPGAs whose netlist is the board, one of `FAMILIES`; None for the board's Verilog.

    Attributes:
        given_n: the mean force over a sample, N, of the amplifier's drive 1.
    """

    def __init__(
        self, spec: AxisSpec, number: int, turn_counts: int, baud: int | None = None, family: str | None = None
    ):
        board, _ = _board(spec, baud)
        self._library_at = functools.partial(build, spec, baud, family)
        self._spec, self._board, self._number, self._turn = spec, board, number, turn_counts
        # A bridge, or pulses, have one step; and the amplifier behind an inverted stage turns the sign back.
        codes = spec.drive.steps if isinstance(spec.drive, dac.Design) else 1
        sign = -1 if spec.stage.inverted else 1
        self.given_n = sign * spec.drive.full_scale_n / codes / spec.clocks_per_sample

    def __enter__(self) -> "BoardHardware":
        self._library = library = ctypes.CDLL(str(self._library_at()))
        library.board_open.restype = ctypes.c_void_p
        library.board_open.argtypes = [ctypes.c_int64, ctypes.c_int64, ctypes.c_double]
        library.board_take.restype = library.board_waiting.restype = library.board_evaluated.restype = ctypes.c_int64
        library.board_checked.restype, library.board_checked.argtypes = (
            ctypes.c_int64,
            [ctypes.c_void_p, ctypes.c_int64],
        )
        library.board_waiting.argtypes = [ctypes.c_void_p]
        for name in ("board_send", "board_take"):
            getattr(library, name).argtypes = [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int64]
        for name in ("board_wire", "board_switch"):
            getattr(library, name).argtypes = [ctypes.c_void_p, ctypes.c_int64, ctypes.c_int64]
        bit_clocks = self._spec.clock_hz / self._board.link.baud
        self._context = library.board_open(self._number, self._turn, bit_clocks)
        self._heard = np.zeros(ROOM, np.uint8)
        return self

    def __exit__(self, *_) -> None:
        self._library.board_close(ctypes.c_void_p(self._context))

    def send(self, data: bytes) -> None:
        """Give the host's bytes to the line, which takes them one after the other at its rate."""
        self._library.board_send(self._context, data, len(data))

    @property
    def waiting(self) -> int:
        """The host's bytes that the line has not taken yet."""
        return self._library.board_waiting(self._context)

    def take(self) -> bytes:
        """Return what the board has sent since the last call."""
        count = self._library.board_take(self._context, self._heard.ctypes.data, ROOM)
        return self._heard[:count].tobytes()

    def skip_nothing(self) -> None:
        """Evaluate every clock from here on."""
        self._library.board_skip_nothing(ctypes.c_void_p(self._context))

    def check_skips(self) -> tuple[int, int]:
        """Compare each skip with its clocks from here on; return how many were compared, and how many differed."""
        checked = self._library.board_checked
        return checked(ctypes.c_void_p(self._context), 0), checked(ctypes.c_void_p(self._context), 1)

    @property
    def evaluated(self) -> int:
        """How many clocks were evaluated since it was opened; the others were skipped."""
        return self._library.board_evaluated(ctypes.c_void_p(self._context))

    @property
    def shot(self) -> bool:
        """Whether both gates of a leg of the bridge have been on together."""
        return bool(self._library.board_shot(ctypes.c_void_p(self._context)))

    def wire(self, name: Wire, level: Level) -> None:
        """Say what becomes of a wire of the encoder on its way to the board."""
        self._library.board_wire(self._context, WIRES.index(name), LEVELS.index(level))

    def switch(self, name: Switch, on: bool) -> None:
        """Close or open a loop, or let the clock go on or stand."""
        self._library.board_switch(self._context, SWITCHES.index(name), on)

    @property
    def controller(self) -> Rtl:
        """The addresses by which the compiled loop calls the hardware; its drive is the sum of a sample's steps."""

        def address(name: str) -> int:
            return ctypes.cast(getattr(self._library, name), ctypes.c_void_p).value

        # A host moves the surface of a board's wall over its link.
        calls = address("board_advance"), address("board_read"), 0
        return Rtl(*calls, self._context, self._spec.design.latency_to_drive)

    start = RtlState(0, 0, 0)
