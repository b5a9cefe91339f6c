"""Curves of a magnitude that are powers in the end, from its leading bits."""

from amaranth.hdl import Cat, Mux, Signal

from hardwall.model.arithmetic.curves import Design

from ..wires import port
from .powers import Powers, entry_of, leading, times


class Curves(Powers):
    """The terms 2^k F(a 2^-k) of a magnitude a.

    Equation: D is log2 of the leading bit, less k and the number of the first octave. Below 0 a term is a multiple of
    the magnitude. Otherwise D has a row in a table; with the three bits below the leading one it gives an entry, which
    is shifted by a number of D, plus k. See `hardwall.model.arithmetic.curves`.

    Latency: `latency` clocks from `start` to `done`: the shift that brings the leading one to the top takes two, the
    tables one, the shift of their entries one. A `start` may come with `done`.

    Rounding and overflow: an entry stands for an eighth of an octave; shifts round down; nothing overflows.

    Parameters
    ----------
    design : hardwall.model.arithmetic.curves.Design
        Tables, shifts and widths.

    Members
    -------
    As of `Powers`; `size` is constant from `start` to `done`.

    Source: the model's module names it.
    """

    design_class = Design

    def _read(self, m):
        design, params = self.design, self.design.params
        octave, step, empty = leading(m, design, self.size, self.octaves, design.lowest)
        near = Signal()
        if design.near:
            m.d.sync += near.eq(octave[-1])

        entry = Cat(step, entry_of(m, octave, params.rows.tolist(), "row"))
        columns = zip(params.tables.tolist(), params.shifts.tolist(), strict=True)
        for number, (table, shifts) in enumerate(columns):
            least, most = design.least[number], design.most[number]
            value = Signal(design.entry_bits[number], name=f"entry_{number}")
            down = Signal(range(most - least + 1), name=f"down_{number}")
            largest = max(shifts)
            below = entry_of(m, octave, [largest - each for each in shifts], f"below_{number}")
            m.d.sync += [
                value.eq(Mux(empty, 0, entry_of(m, entry, table, f"table_{number}"))),
                down.eq(most - largest + below - self.octaves),
            ]
            read = (value << most if most > 0 else value >> -most) >> down
            if design.near:
                double = times(self.size[: design.near], int(params.doubles[number]))
                place = int(params.places[number]) - params.fraction - 1
                read = Mux(near, double << place if place >= 0 else double >> -place, read)
            m.d.sync += port(self, f"term_{number}").eq(read)
