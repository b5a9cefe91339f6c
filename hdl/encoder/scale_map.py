"""Where the edges of an encoder really stand: a memory of the scale's error, which the host writes."""

from amaranth.hdl import Module, Mux, Signal, signed
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In, Member, Out

from hardwall.model.encoder import scale_map

from ..arithmetic.fixed import shape
from ..block import Block


class ScaleMap(Block):
    """The error of the place of an edge, by the edge's number.

    Equation: the bins have 2**bin_bits edges each, from edge `first` on. error = places[floor((n - first) /
    2**bin_bits)]; beyond the bins it is the nearest bin's, and 0 without `enabled`. n is `number` less all shifts of
    the origin while `enabled`, so an edge keeps its bin.

    Latency: `error` and `outside` belong to the number `latency` clocks before. A new number may come every clock.
    A word that is written is read from the next clock on.

    Rounding and overflow: n is taken modulo the count's width; n less `first` has a bit more than a number.

    Reset: the memory keeps what it holds, and n is `number`. The memory is 0 at power-on.

    Parameters
    ----------
    design : hardwall.model.encoder.scale_map.Design
        Bins and format; its module derives them.

    Members
    -------
    number : In(SQ)
        The number of an edge, of the count's width.
    enabled : In(1)
        The count is referenced, and the map holds; acts on `error` at once. While it is low, n is `number`.
    shift : In(1), shift_count : In(SQ)
        Pulse: the origin was shifted, and `shift_count` added to the count.
    write : In(1)
        Pulse: put `written` into the bin `bin`.
    bin : In
        The number of a bin, less than `design.bins`.
    written : In(SQ)
        The error of its edges, in the format `design.place`.
    error : Out(SQ)
        The error of the edge, counts, in the format `design.place`.
    outside : Out(1)
        The edge is beyond the bins, enabled or not.

    Raises
    ------
    TypeError
        If `design` is of another class.
    """

    design_class = scale_map.Design

    @staticmethod
    def members(design: scale_map.Design) -> dict[str, Member]:
        return {
            "number": In(signed(design.count_width)),
            "enabled": In(1),
            "shift": In(1),
            "shift_count": In(signed(design.count_width)),
            "write": In(1),
            "bin": In(range(design.bins)),
            "written": In(shape(design.place)),
            "error": Out(shape(design.place)),
            "outside": Out(1),
        }

    def elaborate(self, platform):
        m, d = Module(), self._design
        m.submodules.places = places = Memory(shape=shape(d.place), depth=d.bins, init=[])
        read, write = places.read_port(), places.write_port()
        m.d.comb += [write.addr.eq(self.bin), write.data.eq(self.written), write.en.eq(self.write)]

        origin, unshifted = Signal.like(self.number), Signal.like(self.number)
        with m.If(~self.enabled):
            m.d.sync += origin.eq(0)
        with m.Elif(self.shift):
            m.d.sync += origin.eq((origin + self.shift_count)[: d.count_width])
        m.d.comb += unshifted.eq((self.number - origin)[: d.count_width])
        wanted = (unshifted - d.first) >> d.bin_bits
        below, above = wanted < 0, wanted > d.bins - 1
        held, beyond = Signal(range(d.bins)), Signal()
        m.d.sync += [
            held.eq(Mux(below, 0, Mux(above, d.bins - 1, wanted[: len(held)]))),
            beyond.eq(below | above),
            self.outside.eq(beyond),
        ]
        m.d.comb += [read.addr.eq(held), read.en.eq(1), self.error.eq(Mux(self.enabled, read.data, 0))]
        return m
