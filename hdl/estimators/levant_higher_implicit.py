"""Levant's differentiators of order 2 and 3 by implicit Euler."""

from amaranth.hdl import Signal, signed

from hardwall.model.estimators.levant_higher_implicit import Design

from ..arithmetic.curves import Curves
from ..arithmetic.fixed import shift_round_half_up
from . import levant_higher


class Estimator(levant_higher.Estimator):
    """An implicit differentiator of order 2 or 3, one sample at a time.

    Equation, per sample, in counts and sample periods, with b the predicted error and T_n curves of |b|; order 2 has no
    z3:

        b   =  b- - (counts moved)
        b-  <- b + z1 + 3/2 (z2 + z3)  - T_0 sign(b)
        z1  <- z1 + z2 + z3 / 2        - T_1 sign(b)
        z2  <- z2 + z3                 - T_2 sign(b)
        z3  <- z3                      - T_3 sign(b)

    `hardwall.model.estimators.levant_higher_implicit` says why this is implicit Euler.

    Start: at the first sample, and with `restart`, z0 = count and all else is 0.

    Latency: `latency` clocks from `strobe` to `valid`: one for the distance from the count, one for the magnitude of
    b, the curves' own, one for the sums. The next `strobe` may come with `valid`.

    Rounding and overflow: the curves are rough, as derived, beyond the band in which they are linear; Taylor's terms
    round half up; saturations are flagged. The count may wrap.

    Parameters
    ----------
    design : hardwall.model.estimators.levant_higher_implicit.Design
        Formats; its module derives them.

    Source: Mojallizadeh, Brogliato, Acary 2021; Carvajal-Rubio and others 2021; Seeber 2024.
    """

    design_class = Design
    unit_class = Curves

    def _corrections(self, m, powers, still):
        return self._terms(powers)

    def _further(self, m, z):
        f = [each.f for each in self.design.z]
        ahead = z[1]
        if self.design.order == 3:
            # A clock more: the sum is ready long before the terms.
            ahead = Signal(signed(max(len(z[1]), len(z[2])) + 1), name="further")
            m.d.sync += ahead.eq(z[1] + shift_round_half_up(z[2], f[2] - f[1]))
        return shift_round_half_up(ahead + (ahead << 1), f[1] - f[0] + 1)
