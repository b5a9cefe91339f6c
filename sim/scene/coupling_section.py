"""The section of a virtual coupling: the spring and damper between the handle and a tool that a host simulates, and the
tool."""

import math

from .quantities import Damping, Mass, Rate, Stiffness, Time, or_none
from .section import Section

AHEAD_MAX = 10
"""The most of the host's periods by which the surface may be ahead; half of one, and the delay, are of use."""


class CouplingSection(Section):
    """A spring and a damper between the handle and a tool, which touches the wall in its place; without `mass_kg` the
    tool has no mass. A host simulates it `sample_hz` times a second; its motion comes `delay_s` late, a sample at
    least, and the surface that the handle is coupled to is put `ahead_s` ahead of it."""

    stiffness_n_per_m: Stiffness
    damping_n_s_per_m: or_none(Damping) = 0.0
    mass_kg: or_none(Mass) = 0.0
    sample_hz: Rate
    delay_s: or_none(Time) = 0.0
    ahead_s: or_none(Time) = 0.0

    def period(self, sample_hz: int) -> int:
        """Return the samples of the axis from one of the host's to the next."""
        return sample_hz // self.sample_hz

    def latency(self, sample_hz: int) -> int:
        """Return the number of samples from the host's sample to the first that feels the tool."""
        return max(round(self.delay_s * sample_hz), 1)

    def check(self, sample_hz: int) -> None:
        """Raise ValueError if the host's rate or its delay do not fit an axis; the message begins with the key."""
        if sample_hz % self.sample_hz:
            raise ValueError(
                f"coupling.sample_hz must be controller.sample_hz {sample_hz} divided by a whole number, "
                f"not {self.sample_hz!r}"
            )
        latency, most_s = self.latency(sample_hz), 1 / self.sample_hz
        if self.ahead_s > AHEAD_MAX * most_s:
            raise ValueError(
                f"coupling.ahead_s must be at most {AHEAD_MAX * most_s:g}, {AHEAD_MAX} of the host's periods, "
                f"not {self.ahead_s!r}"
            )
        if latency > self.period(sample_hz):
            raise ValueError(
                f"coupling.delay_s must be at most {most_s:g}, one of the host's periods, not {self.delay_s!r}"
            )
        if self.delay_s and not math.isclose(self.delay_s * sample_hz, latency, abs_tol=1e-6):
            raise ValueError(
                f"coupling.delay_s must be a whole number of samples of {1 / sample_hz:g} s, not {self.delay_s!r}"
            )
