"""The section of the bristles on which a handle's dry friction sticks and slips."""

from typing import Literal

from .quantities import Damping, Force, Speed, Stiffness, or_none
from .section import Section

OF_LUGRE = "damping_n_s_per_m", "static_n", "stribeck_m_per_s"
"""The keys that LuGre's model cannot be without, and Dahl's does not have."""


class PreslidingSection(Section):
    """Bristles by Dahl's model or by LuGre's: see `hardwall.sim.world.bristles`. Their Coulomb level is the handle's.

    Without this section dry friction sticks ideally, as far as its level holds.
    """

    model: Literal["dahl", "lugre"]
    stiffness_n_per_m: Stiffness
    damping_n_s_per_m: or_none(Damping) | None = None
    static_n: Force | None = None
    stribeck_m_per_s: Speed | None = None

    def check(self, coulomb_n: float | None) -> None:
        """Raise ValueError if a key lacks or is of the other model, or the levels are impossible.

        Args:
            coulomb_n: Coulomb friction of the handle.

        The message begins with the key.
        """
        if not coulomb_n:
            raise ValueError("presliding needs handle.coulomb_n above 0, the level at which the bristles slip")
        for key in OF_LUGRE:
            given = getattr(self, key) is not None
            if given and self.model == "dahl":
                raise ValueError(f"presliding.{key} must be absent, because presliding.model is dahl, not lugre")
            if not given and self.model == "lugre":
                raise ValueError(f"presliding.{key} is missing")
        if self.static_n is not None and self.static_n < coulomb_n:
            raise ValueError(
                f"presliding.static_n must be at least handle.coulomb_n, {coulomb_n:g}, not {self.static_n!r}"
            )
