"""The waveform of a failure as a table: one line a signal, one column a clock."""

import re
from pathlib import Path

CLOCK = 10
"""Time units of a clock in the solver's waveforms."""
ROOM = 110
"""Characters of a line; of a longer failure the last clocks are shown."""
UNSEEN = {"clk", "smt_step", "smt_clock"}


def values_by_clock(vcd: str) -> dict[str, list[int]]:
    """Return the values of every signal of a waveform at every clock, unsigned, by the signal's path."""
    names: dict[str, list[str]] = {}
    path, now, states = [], {}, []
    for line in vcd.splitlines():
        match line.split():
            case ["$scope", _, scope, *_]:
                path.append(scope)
            case ["$upscope", *_]:
                path.pop()
            case ["$var", _, _, code, name, *_]:
                names.setdefault(code, []).append(".".join([*path, name]))
            case [word] if word.startswith("#") and int(word[1:]) % CLOCK == 0:
                states.append(now := dict(now))
            case [bits, code] if bits.startswith("b") and code in names and states:
                states[-1][code] = int(bits[1:].replace("x", "0"), 2)
    every = [(code, name) for code, of_code in names.items() for name in of_code]
    return {
        name: [state.get(code, 0) for state in states] for code, name in every if name.rpartition(".")[2] not in UNSEEN
    }


def _depth(signal: tuple[str, list[int]]) -> int:
    return signal[0].count(".")


def table(trace: Path, rtlil: str) -> str:
    """Return the waveform as text: the top's signals, then those of the blocks inside that the top does not show.

    Args:
        trace: the waveform.
        rtlil: the module that was proven, which says what is signed.
    """
    found = re.findall(r"^ *wire width (\d+) .*\bsigned\b.* \\(\S+)$", rtlil, re.M)
    widths = {name: int(width) for width, name in found}
    lines, shown = [], {}
    for path, values in sorted(values_by_clock(trace.read_text(encoding="utf-8")).items(), key=_depth):
        name = path.rpartition(".")[2]
        if not set("$/") & set(path) and "_witness_" not in path and shown.get(name) != values:
            shown[name] = values
            half = 1 << widths.get(name, 64) - 1
            lines.append((path.removeprefix("top."), [str((value + half) % (2 * half) - half) for value in values]))
    head = ("clock", [str(clock) for clock in range(max((len(values) for _, values in lines), default=0))])
    label = max((len(name) for name, _ in lines), default=0)
    columns = [
        max(len(cell) for cell in column) for column in zip(*(cells for _, cells in [head, *lines]), strict=True)
    ]
    while columns and label + sum(width + 1 for width in columns) > ROOM:
        columns.pop(0)
    rows = []
    for name, cells in [head, *lines]:
        shown = cells[len(cells) - len(columns) :]
        rows.append(
            " ".join([name.ljust(label), *(cell.rjust(width) for cell, width in zip(shown, columns, strict=True))])
        )
    return "\n".join(rows) + "\n"
