"""The section of a hand that holds the handle, and the published hands that it may name."""

import tomllib
from pathlib import Path
from typing import Any, Literal

from .quantities import Damping, Mass, Place, Stiffness, or_none
from .section import Section

HANDS: dict[str, dict[str, Any]] = tomllib.loads(Path(__file__).with_name("hands.toml").read_text("utf-8"))
"""The published hands by name: the keys `OF_A_HAND`, and `grip`, `source` and `seen`, whether it was read there."""
OF_A_HAND = "mass_kg", "damping_n_s_per_m", "stiffness_n_per_m"
"""The keys that describe a hand; a published hand has them already."""


class HandSection(Section):
    """A hand that moves with the handle and holds it, by a spring to `rest_m` and a damper: one of `HANDS`, or its own
    mass, damper and spring."""

    model: Literal[tuple(HANDS)] | None = None
    mass_kg: or_none(Mass) | None = None
    damping_n_s_per_m: or_none(Damping) | None = None
    stiffness_n_per_m: or_none(Stiffness) | None = None
    rest_m: Place = 0.0

    def check(self) -> None:
        """Raise ValueError if a key lacks, or is one that the named hand has already; the message begins with it."""
        for key in OF_A_HAND:
            given = getattr(self, key) is not None
            if given and self.model:
                raise ValueError(f"hand.{key} must be absent, because hand.model is {self.model}, which has its own")
            if not given and not self.model:
                raise ValueError(
                    f"hand.{key} is missing: a hand has {', '.join(OF_A_HAND)}, or is a published one by hand.model, "
                    f"one of {', '.join(HANDS)}"
                )

    @property
    def parts(self) -> dict[str, float]:
        """The mass, the damper and the spring, and where it rests, by key."""
        own = HANDS[self.model] if self.model else self.model_dump()
        return {key: own[key] for key in OF_A_HAND} | {"rest_m": self.rest_m}
