"""What the Verilated board is told of how the board rests: names of Verilator's members, and signals inside the board.

Without a way to rest no clock is left out. So it is, too, where Verilator keeps a register by none of these names.
"""

import math
import re
from collections.abc import Iterable

from ...model.board import clock_monitor
from ...model.spec import AxisSpec
from . import board_resting
from .board_resting import BoardResting

HEADER = "board_ports.h"
MONITOR = "around_board__DOT__board__DOT__clock_monitor__DOT__", "around_board__DOT__oscillator", "until_change"
"""Parts of the names of the members that are of the monitor of the clock and of its own clock."""
RESTLESS = BoardResting((), (), (), (), 0, ())


def members(rest: BoardResting | None) -> str:
    """Return a regular expression of the members that go round with the monitor of the clock."""
    watched = (member(name) for names in (rest or RESTLESS).watched for name in names)
    return "|".join([*MONITOR, *watched])


def options(rest: BoardResting | None) -> tuple[str, ...]:
    """Return the options of Verilator that lead signals inside the board to `around_board.v`."""
    guards = [f"board.{name}" for name in (rest or RESTLESS).guards]
    permitted = (f"-DPERMITTED=board.{board_resting.PERMITTED}",) if rest and rest.sum_bits else ()
    return f"-DGUARDED={' || '.join(guards) or 0}", *permitted


def header(spec: AxisSpec, rest: BoardResting | None, oscillator_clocks: int) -> str:
    """Return the header of a board.

    Args:
        spec: its axis.
        rest: how it rests; None if no clock is left out.
        oscillator_clocks: its clocks in half a period of the oscillator.
    """
    found = rest or RESTLESS
    counters = [
        (number, name, (1 << counter.width) - 1, counter.stops)
        for number, counter in enumerate(found.counters)
        for name in _kept(counter.names)
    ]
    exits = [(number, member(name)) for number, names in enumerate(found.exits) for name in names]
    memories = [member(name) for name in found.memories]
    registers = [*(name for _, name, *_ in counters), *(name for _, name in exits), *_kept([board_resting.SUM])]
    names = dict.fromkeys([*registers, *memories])
    # The beat comes again in two of its levels, the oscillator in two of its own.
    beat = 2 * clock_monitor.Design(spec.clock_hz).beat_clocks
    lists = {
        "SKIPS": [int(rest is not None)],
        "COUNTER_COUNT": [len(found.counters)],
        "SUM_BITS": [found.sum_bits],
        "ROUND": [math.lcm(beat, 2 * oscillator_clocks)],
        "NAMES": [f"FOUND({name})" for name in names],
        "COUNTERS": [f"COUNTER({number}, {name}, {mask})" for number, name, mask, _ in counters],
        "STOPS": [
            f"STOP({number}, {name}, {mask}, {stop})" for number, name, mask, stops in counters for stop in stops
        ],
        "EXIT_COUNT": [len(found.exits)],
        "EXITS": [f"EXIT({number}, {name})" for number, name in exits],
        "MEMORIES": [f"MEMORY({name})" for name in memories],
    }
    return "".join(f"#define {name} {' '.join(map(str, items))}\n" for name, items in lists.items())


def member(name: str) -> str:
    """Return Verilator's name for a signal of the board: what is no letter, and a second underscore, by its code."""
    inside = re.sub(r"(?<=_)_|[^\w.]", lambda letter: f"__0{ord(letter[0]):02X}", name)
    return f"around_board__DOT__board__DOT__{inside.replace('.', '__DOT__')}"


def _kept(names: Iterable[str]) -> list[str]:
    """Return the members of a register, with those that have its next value until it is taken."""
    return [f"{prefix}{member(name)}" for name in names for prefix in ("", "__Vdly__")]
