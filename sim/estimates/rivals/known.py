"""The rivals by name, with the settings that their projects give them, and the settings that are tried to do better.

Settings, where a rival has them: `period_s`, the time from one reading to the next, 0 for every sample; `filter_s`, the
time constant of a low pass; `calibrated`, whether it knows where the four kinds of edges are; `bandwidth_hz`.

ODrive and moteus have one algorithm, and this project has it, too: the estimator `tracking-loop`, whose module gives
their gains. Two details of ODrive are left out. It drops the fraction of a count of its own position before it
compares, and holds the smallest velocities at 0. Its default is 1000 rad/s; the default of moteus is 1.3 % more.
"""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from itertools import product
from typing import Any

from ....model.estimators.tracking_loop import INDEX_MAX
from .dvrk import ACCELERATION, MEASURED, PREDICTED, Dvrk
from .hostmot2 import TIMEOUT_S, Hostmot2
from .pico import UNIFORM, Substep
from .simplefoc import FILTER_S, LOOP_S, Differences, Mixed

Settings = dict[str, Any]
Offsets = tuple[float, float, float, float]
PERIODS_S = 1e-2, 3e-3, 1e-3, 3e-4, 1e-4, 3e-5, 1e-5, 0.0
FILTERS_S = 5e-3, 2e-3, 1e-3, 3e-4, 1e-4, 0.0


@dataclass(frozen=True)
class Rival:
    """A rival whose algorithm is in this package.

    Attributes:
        project: the project that it is from.
        make: returns the rival with settings, for a scale whose four kinds of edges are off by so many counts.
        usual: the settings that the project gives it.
        tried: settings that are tried beside the usual ones.
    """

    project: str
    make: Callable[[Settings, Offsets], tuple]
    usual: Settings
    tried: tuple[Settings, ...] = ()


def _varied(**values: Iterable[Any]) -> tuple[Settings, ...]:
    """Return every combination of the values of settings."""
    return tuple(dict(zip(values, chosen, strict=True)) for chosen in product(*values.values()))


RIVALS = {
    "dvrk": Rival("dVRK", lambda settings, offsets: Dvrk(PREDICTED), {"period_s": 0.0}),
    "dvrk-measured": Rival("dVRK", lambda settings, offsets: Dvrk(MEASURED), {"period_s": 0.0}),
    "hostmot2": Rival(
        "LinuxCNC",
        lambda settings, offsets: Hostmot2(TIMEOUT_S),
        {"period_s": 1e-3},
        _varied(period_s=PERIODS_S),
    ),
    "simplefoc-encoder": Rival(
        "SimpleFOC",
        lambda settings, offsets: Mixed(settings["filter_s"]),
        {"period_s": LOOP_S, "filter_s": FILTER_S},
        _varied(period_s=(1e-3, 1e-4, 1e-5), filter_s=FILTERS_S),
    ),
    "simplefoc-sensor": Rival(
        "SimpleFOC",
        lambda settings, offsets: Differences(settings["filter_s"]),
        {"period_s": LOOP_S, "filter_s": FILTER_S},
        _varied(period_s=(1e-3, 1e-4), filter_s=FILTERS_S),
    ),
    "pico": Rival(
        "Raspberry Pi Pico",
        lambda settings, offsets: Substep(offsets if settings["calibrated"] else UNIFORM),
        {"period_s": 1e-2, "calibrated": False},
        _varied(period_s=PERIODS_S, calibrated=(False, True)),
    ),
}
ACCELERATIONS = {"dvrk": Dvrk(ACCELERATION)}
"""The rivals that give an acceleration, counts/s^2."""
LOOP = "tracking-loop"
LOOP_USUAL: Settings = {"bandwidth_hz": 1000 / math.tau}
LOOP_TRIED = _varied(bandwidth_hz=(30.0, 60.0, 100.0, 200.0, 400.0, 800.0, 1500.0, 3000.0, 6000.0))
PROJECTS = {name: rival.project for name, rival in RIVALS.items()} | {LOOP: "ODrive, moteus"}
"""The projects of all rivals, by the names of the rivals."""


def _is_whole(samples: float) -> bool:
    """Return whether a period is a whole number of samples; 0 stands for every sample."""
    return samples == 0 or (samples > 0.5 and abs(samples - round(samples)) < 1e-3)


def choices(name: str, sample_hz: float) -> tuple[Settings | None, list[Settings]]:
    """Return the usual settings of a rival, None where the rate does not suit them, and all settings, each once.

    Args:
        name: one of `PROJECTS`.
        sample_hz: the sample rate: it limits the bandwidth of the loop, and a period of reading is whole samples.
    """
    if name != LOOP:
        rival = RIVALS[name]
        every = [rival.usual, *(settings for settings in rival.tried if settings != rival.usual)]
        every = [settings for settings in every if _is_whole(settings["period_s"] * sample_hz)]
        return rival.usual if rival.usual in every else None, every
    most_hz = INDEX_MAX * sample_hz / math.tau
    every = [settings for settings in (LOOP_USUAL, *LOOP_TRIED) if settings["bandwidth_hz"] < most_hz]
    return LOOP_USUAL if LOOP_USUAL in every else None, every
