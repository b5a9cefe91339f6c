"""The platform of the written Verilog: no vendor's part; its attributes and files suit the tools of several vendors."""

import re
from typing import IO

from amaranth.hdl import Module, Signal
from amaranth.lib.cdc import FFSynchronizer

SYNCHRONISER = {"ASYNC_REG": "TRUE", "keep": "true"}
"""Attributes of every stage of a synchroniser: place the stages side by side, and neither merge nor move them."""
ADDED = "added/"
"""The names of others' files for the tools: messages name `added/FILE`, and rules for our own text skip these."""


class AnyPart:
    """A platform of Amaranth without a part. Its synchronisers have the attributes that the tools of several vendors
    read.

    Attributes:
        files: the texts that components have added, by name.
    """

    def __init__(self) -> None:
        self.files: dict[str, str] = {}

    def add_file(self, filename: str, content: str | bytes | IO[str] | IO[bytes]) -> None:
        """Add a file of Verilog that an `Instance` in the design needs, as Amaranth's own platforms do.

        Raises:
            ValueError: if another text of that name was added, or its bytes are no UTF-8.
        """
        text = content if isinstance(content, str | bytes) else content.read()
        if isinstance(text, bytes):
            text = text.decode("utf-8")
        if self.files.setdefault(filename, text) != text:
            raise ValueError(f"two files with different texts have the name {filename!r}: rename one of them")

    def added_to(self, verilog: str, top: str) -> str:
        """Return the Verilog of the top module with the files behind it.

        Raises:
            ValueError: if a file has a module of the top's name.
        """
        parts = [verilog]
        for name, text in self.files.items():
            if re.search(rf"^\s*(?:module|macromodule)\s+(?:automatic\s+|static\s+)?{re.escape(top)}\b", text, re.M):
                raise ValueError(
                    f"{name} has a module with the name of the top, {top!r}: give one of them another name"
                )
            # The next text is not to be read by this one's rules.
            parts.append(f'`line 1 "{ADDED}{name}" 0\n{text.rstrip()}\n`default_nettype wire\n')
        return "\n".join(parts)

    def get_ff_sync(self, synchroniser: FFSynchronizer) -> Module:
        """Return the hardware of a synchroniser, as Amaranth makes it but for the attributes."""
        m = Module()
        level = synchroniser.i
        for number in range(synchroniser._stages):
            stage = Signal(
                level.shape(),
                name=f"stage{number}",
                init=synchroniser._init,
                reset_less=synchroniser._reset_less,
                attrs=SYNCHRONISER,
            )
            m.d[synchroniser._o_domain] += stage.eq(level)
            level = stage
        m.d.comb += synchroniser.o.eq(level)
        return m
