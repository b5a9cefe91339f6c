"""Waveforms: Verilator's VCD, converted to the compact FST for GTKWave and Surfer.

Verilator writes one declaration or change a line, so the VCD is read line by line. Signals with a name that Yosys had
to invent (it begins with `$`) mean nothing to a reader and are left out.
"""

from itertools import islice
from pathlib import Path

import pylibfst

from ...model.runtime.whole_file import whole_file

_LIB, _FFI = pylibfst.lib, pylibfst.ffi
_EXPONENTS = {"1s": 0, "1ms": -3, "1us": -6, "1ns": -9, "1ps": -12, "1fs": -15}


def vcd_to_fst(vcd: Path, fst: Path, most: int | None = None) -> int:
    """Write the named signals in the first `most` lines of `vcd` as `fst`; return the number of value changes.

    Raises:
        OSError: if `fst` cannot be created.
    """
    # The library would put its file in the place of a link.
    with whole_file(fst) as part:
        writer = _LIB.fstWriterCreate(bytes(part), 1)
        if writer == _FFI.NULL:
            raise OSError("it cannot be created")
        try:
            with vcd.open(encoding="ascii") as lines:
                handles = _declare(writer, lines)
                return sum(_change(writer, handles, line.rstrip()) for line in islice(lines, most))
        finally:
            _LIB.fstWriterClose(writer)


def _declare(writer, lines) -> dict[str, tuple[int, int]]:
    """Declare scopes and signals; return the handle and width of every signal by its code in the VCD."""
    handles: dict[str, tuple[int, int]] = {}
    for line in lines:
        match line.split():
            case ["$timescale", scale, "$end"]:
                _LIB.fstWriterSetTimescale(writer, _EXPONENTS[scale])
            case ["$scope", _, name, "$end"]:
                _LIB.fstWriterSetScope(writer, _LIB.FST_ST_VCD_MODULE, name.encode(), _FFI.NULL)
            case ["$upscope", "$end"]:
                _LIB.fstWriterSetUpscope(writer)
            case ["$var", _, width, code, *name, "$end"] if not name[0].startswith("$"):
                # A port and the net behind it share a code, and therefore a handle.
                same = handles.get(code, (0, 0))[0]
                text = " ".join(name).encode()
                wire, implicit = _LIB.FST_VT_VCD_WIRE, _LIB.FST_VD_IMPLICIT
                handle = _LIB.fstWriterCreateVar(writer, wire, implicit, int(width), text, same)
                handles.setdefault(code, (handle, int(width)))
            case ["$enddefinitions", "$end"]:
                break
    return handles


def _change(writer, handles: dict[str, tuple[int, int]], line: str) -> int:
    """Write one line of the VCD's body; return the number of changes in it, 0 or 1."""
    if line.startswith("#"):
        _LIB.fstWriterEmitTimeChange(writer, int(line[1:]))
        return 0
    if line.startswith("b"):
        bits, _, code = line[1:].partition(" ")
    else:
        bits, code = line[:1], line[1:]
    if code not in handles:
        return 0
    handle, width = handles[code]
    _LIB.fstWriterEmitValueChange(writer, handle, bits.rjust(width, "0").encode())
    return 1
