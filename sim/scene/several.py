"""A scene of several axes: every one of them is a scene of its own, and all share one pipeline.

What is shared is the hardware, and the length of the run: `shared` names these keys. An axis may have any other key of
its own: for its device, its wall, and the words of the hardware that the host writes.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

from ...model.axes.axis import AxesSpec
from ...model.axis.design import Timing
from .schema import ControllerSection, Scene

ABSENT = {
    "drive": "the pipeline of several axes has no drive stages",
    "coupling": "the pipeline of several axes has no moving surfaces",
    "passivity": "the pipeline of several axes has no passivity controller",
    "virtual_mass": "the pipeline of several axes has no acceleration",
    "zwidth": "no map is made of several axes",
}
"""The sections that a scene of several axes may not have, and why."""
OWN_OF_CONTROLLER = {"output", "glitch_clocks", "slew_limit_n_per_s", "gains"}
"""The keys of the controller that are run-time words: every axis has its own."""
SHARED = {
    *(("controller", key) for key in ControllerSection.model_fields if key not in OWN_OF_CONTROLLER),
    *(("protocol", key) for key in ("settle_s", "mean_s", "measure_s", "longest_s", "verdict")),
    ("encoder", "count_m"),
}
"""The keys that all axes share."""
GAIN_WORDS = {
    "levant_lambda": "lambda_sqrt_m_per_s",
    "levant_alpha": "alpha_m_per_s2",
    "window_length": "window_s",
}
"""The gains that are words of a pipeline's estimators, by the name of the word."""


def shared(key: Sequence[str]) -> bool:
    """Return whether all axes share a key, or a section, given by its parts."""
    return key[0] in ABSENT or tuple(key[:2]) in SHARED


class AxisScene(Scene):
    """One of several axes, with all that it shares with the others.

    Attributes:
        axis: the name of the axis.
        number, axes: its number in the rota, from 0, and how many there are.
        base: an axis without own keys in its controller; None for this axis itself.
    """

    axis: str
    number: int
    axes: int
    base: "AxisScene | None" = None

    @cached_property
    def spec(self) -> AxesSpec:
        """All the axes; their formats follow from what they share."""
        return AxesSpec(axes=self.axes, **self.requirements) if self.base is None else self.base.spec

    @property
    def timing(self) -> Timing:
        """The clocks at which the axis samples and changes its drive: from when the words of all axes are written."""
        return self.spec.timing(self.number, self.spec.rotas_to_write)

    @property
    def parameters(self) -> dict[str, float]:
        """Run-time parameters in SI units, by word, with the gains of the axis if they are its own."""
        si = super().parameters
        if self.base is None or self.gains == self.base.gains:
            return si
        gains = self.gains.model_dump()
        return si | {word: gains[field] for word, field in GAIN_WORDS.items() if field in gains}

    @property
    def most_samples(self) -> int:
        """The samples of one window: the hardware of all axes is one, and their runs end together."""
        return self.samples


@dataclass(frozen=True)
class AxesScene:
    """Several axes that share one pipeline, and a wall and a device for each.

    Attributes:
        name: name of the scene.
        axes: the axes in their order in the rota; at least one.
    """

    name: str
    axes: tuple[AxisScene, ...]

    @property
    def spec(self) -> AxesSpec:
        """The hardware of all axes."""
        return self.axes[0].spec

    @property
    def samples(self) -> int:
        """Number of samples of every axis."""
        return self.axes[0].samples
