"""A frame of a serial port: named fields side by side in one word, and the host's conversions to and from bytes."""

from collections.abc import Iterator, Mapping
from typing import NamedTuple

from amaranth.hdl import Shape

BYTE = 8


class Place(NamedTuple):
    """The place of a field: its lowest bit in the frame, and the shape of its value."""

    name: str
    low: int
    shape: Shape


class Frame:
    """Fields in the order on the wire, most significant bit of the first field first; unused bits come last.

    Attributes:
        fields: shapes by name.
        bits: length of the frame, a whole number of bytes.
    """

    def __init__(self, fields: Mapping[str, Shape], bits: int):
        self.fields, self.bits = dict(fields), bits

    def __iter__(self) -> Iterator[Place]:
        """Yield the place of every field."""
        low = self.bits
        for name, shape in self.fields.items():
            low -= shape.width
            yield Place(name, low, shape)

    @property
    def unused(self) -> int:
        """Bits below the last field."""
        return self.bits - sum(shape.width for shape in self.fields.values())

    def encode(self, values: Mapping[str, int]) -> bytes:
        """Return the frame with `values`, by name; a field without a value is zero.

        Raises:
            ValueError: if a name is not a field, or a value does not fit its field.
        """
        for name in values:
            if name not in self.fields:
                raise ValueError(f"name must be one of {', '.join(self.fields)}, not {name!r}")
        word = 0
        for name, low, shape in self:
            value, least = values.get(name, 0), -(1 << (shape.width - 1)) if shape.signed else 0
            if not least <= value < least + (1 << shape.width):
                raise ValueError(f"{name} must be {least} to {least + (1 << shape.width) - 1}, not {value!r}")
            word |= (value & ((1 << shape.width) - 1)) << low
        return word.to_bytes(self.bits // BYTE, "big")

    def decode(self, frame: bytes) -> dict[str, int]:
        """Return the values of a frame, by name.

        Raises:
            ValueError: if `frame` does not have the length of a frame.
        """
        if len(frame) * BYTE != self.bits:
            raise ValueError(f"frame must have {self.bits // BYTE} bytes, not {len(frame)!r}")
        word, values = int.from_bytes(frame, "big"), {}
        for name, low, shape in self:
            value = word >> low & ((1 << shape.width) - 1)
            values[name] = value - (1 << shape.width) if shape.signed and value >> (shape.width - 1) else value
        return values
