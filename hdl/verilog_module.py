"""A module of existing Verilog as a component of Amaranth."""

import re
from collections.abc import Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Any

from amaranth.hdl import ClockSignal, Instance, Module, ResetSignal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Member

from .wires import ports

_INCLUDE = re.compile(r'^[ \t]*`include[ \t]+"([^"\n]+)".*$', re.MULTILINE)


class VerilogModule(wiring.Component):
    """A module of existing Verilog: the test bench tests it as any component, and designs can contain it.

    Clock and reset come from its domain. The files come into the Verilog of the design as they are, with what they
    include from beside them.

    Parameters
    ----------
    name : str
        The module's name in the Verilog.
    ports : Mapping[str, Member]
        All ports but clock and reset, by the names in the Verilog, for instance `{"sample": In(signed(16))}`.
    files : Sequence[str | PathLike]
        The Verilog or SystemVerilog files of the module and of all below it, in UTF-8.
    clock, reset : str | None
        The names of its clock (rising edge) and of its reset (high, synchronous); None where it has none.
    **parameters : int | str
        The module's parameters, by name.

    Raises
    ------
    OSError
        If a file cannot be read.
    ValueError If a port has the name of the clock or of the reset; if two files have one name; if a file is no UTF-8,
        or includes itself.
    """

    def __init__(
        self,
        name: str,
        ports: Mapping[str, Member],
        files: Sequence[str | PathLike[str]],
        *,
        clock: str | None = "clk",
        reset: str | None = "rst",
        **parameters: int | str,
    ):
        self._module, self._parameters = name, parameters
        self._controls = {pin: signal for pin, signal in ((clock, ClockSignal), (reset, ResetSignal)) if pin}
        for pin in self._controls:
            if pin in ports:
                raise ValueError(f"ports of {name} must not have its clock or its reset, {pin!r}")
        self._files: dict[str, str] = {}
        for file in map(Path, files):
            if file.name in self._files:
                raise ValueError(f"files of {name} must have different names, not {file.name!r} twice")
            self._files[file.name] = _whole(file, ())
        super().__init__(dict(ports))

    def elaborate(self, platform: Any) -> Module:
        m = Module()
        for file, text in self._files.items():
            platform.add_file(file, text)
        given: dict[str, Any] = {f"p_{name}": value for name, value in self._parameters.items()}
        given |= {f"i_{pin}": signal() for pin, signal in self._controls.items()}
        for name, value in ports(self).items():
            given[f"{'i' if self.signature.members[name].flow == In else 'o'}_{name}"] = value
        m.submodules[self._module] = Instance(self._module, **given)
        return m


def _whole(file: Path, above: tuple[Path, ...]) -> str:
    """Return a file's text with its included files; an include of a file that is not beside it is left to the tool."""
    try:
        text = file.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise ValueError(f"{file} must be UTF-8: byte {error.start} is not") from None
    if file in above:
        raise ValueError(f"{file} includes itself")

    def included(found: re.Match[str]) -> str:
        other = file.parent / found[1]
        if not other.is_file():
            return found[0]
        line = text.count("\n", 0, found.start()) + 1
        inside = _whole(other, (*above, file)).rstrip()
        return f'`line 1 "added/{other.name}" 1\n{inside}\n`line {line + 1} "added/{file.name}" 2'

    return _INCLUDE.sub(included, text)
