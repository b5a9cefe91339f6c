"""The methods of the founding paper's Figure 5: estimators and gains with which a wall is rendered."""

import math
from dataclasses import dataclass, field
from typing import Any

from ...model.estimators import registry
from ..scene.schema import Scene

PROPOSED = {"lambda_sqrt_m_per_s": math.sqrt(12.0), "alpha_m_per_s2": 13.2}
"""The paper's proposed gains, for its C of 12 m/s^2."""
ADJUSTED = {"lambda_sqrt_m_per_s": 500 * math.sqrt(1e-3), "alpha_m_per_s2": 50.0}
"""The paper's adjusted gains; its alpha was lost, and this value satisfies the condition that the paper names."""


@dataclass(frozen=True)
class Curve:
    """One estimator of a figure.

    Attributes:
        label: label in the legend.
        estimator, output: their names.
        gains: gains that differ from the default ones, by name.
        cutoff_of_rate: a cutoff, as a share of the sample rate, in place of gains.
    """

    label: str
    estimator: str
    output: str
    gains: dict[str, float] = field(default_factory=dict)
    cutoff_of_rate: float | None = None

    @property
    def changes(self) -> dict[str, Any]:
        """The changes to a scene, by dotted key; they leave out a cutoff that is a share of the rate."""
        gains = {f"controller.gains.{self.estimator}": self.gains} if self.gains else {}
        return {"controller.estimator": self.estimator, "controller.output": self.output, **gains}

    def job(self, signal: str, sample_hz: int, **options) -> dict:
        """Return the arguments of `accuracy.measure`."""
        gains = {"cutoff_hz": self.cutoff_of_rate * sample_hz} if self.cutoff_of_rate else self.gains
        return {
            "estimator": self.estimator,
            "output": self.output,
            "signal": signal,
            "sample_hz": sample_hz,
            "gains": gains or None,
            **options,
        }


def methods(scene: Scene | None = None) -> dict[str, Curve]:
    """Return the methods of the paper's Figure 5, by the name used on the command line.

    Args:
        scene: a scene whose own gains for Levant, if any, are the adjusted gains: their alpha was lost, and a scene may
            choose it.
    """
    own = scene and scene.controller.gains.levant
    adjusted = own.model_dump() if own else ADJUSTED
    filtered = {
        f"fdm-{cutoff}": Curve(f"FDM + {cutoff} Hz", "butterworth", "u", {"cutoff_hz": float(cutoff)})
        for cutoff in (30, 100, 500, 1000)
    }
    return filtered | {
        "proposed": Curve("Levant u, proposed gains", "levant", "u", PROPOSED),
        "adjusted": Curve("Levant u, adjusted gains", "levant", "u", adjusted),
    }


def label(estimator: str, output: str) -> str:
    """Return the label of an estimator's output: the estimator's name alone if it has one output."""
    return estimator if len(registry.design_of(estimator).outputs) == 1 else f"{estimator} {output}"
