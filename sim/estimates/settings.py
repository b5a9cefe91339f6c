"""The settings of a replay's axis besides C: the gains, the bound on the jerk, and the error of single edges.

Everything is in recorded counts and true seconds, by the keys that a scene has with metres: `gains.ESTIMATOR.NAME`,
`jerk_max_counts_per_s3` and `edge_error_max_counts` of its section `controller`. An axis counts in samples: see
`replay_axis`.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from ...model.checks import shown
from ...model.estimators import registry
from ...model.record_axis import DECODER_CLOCKS
from ...model.record_time import RecordTime
from ...model.spec import AxisSpec


@dataclass(frozen=True)
class Settings:
    """The settings of an axis; None leaves a setting to what follows from C.

    Attributes:
        gains: the gains of the estimator, by their names, in counts and seconds; empty for its own.
        jerk_max_counts_per_s3: bound on the jerk between impacts; at impacts too for `kalman`.
        edge_error_max_counts: RMS error of single edges, in counts that the estimator sees.
    """

    gains: dict[str, float] = field(default_factory=dict)
    jerk_max_counts_per_s3: float | None = None
    edge_error_max_counts: float | None = None


GAIN_RANGE = 1e-15, 1e15
EDGE_ERROR_RANGE = 1e-6, 1.0
"""The ranges of a scene's keys: see `scene.quantities`."""
SECTION = "controller."
HIGHER = tuple(f"levant-{order}{kind}" for kind in ("", "-filtering", "-implicit") for order in (2, 3))
"""The Levants whose bound is of a higher derivative than the acceleration."""
BOUNDS = {
    "jerk_max_counts_per_s3": (GAIN_RANGE, ("edge-kalman", "count-kalman", "kalman", *HIGHER)),
    "edge_error_max_counts": (EDGE_ERROR_RANGE, ("edge-kalman", "count-kalman", "mt", "mt-divisionless")),
}
"""The bounds by their keys: their ranges, and the estimators whose gains follow from them."""


class SettingError(ValueError):
    """A setting is refused; the message is one line with its key and the accepted values."""


def settings_of(changes: Mapping[str, Any], estimator: str) -> Settings:
    """Return the settings of changed keys.

    Args:
        changes: values by key, as in `{"controller.gains.levant.alpha_counts_per_s2": 1e6}`.
        estimator: the estimator whose gains may be set.

    Raises:
        SettingError: if a key or a value is not valid, some of the gains are lacking, or a bound is given beside them.
    """
    names = names_of(estimator)
    keys = {f"{SECTION}gains.{estimator}.{name}": (name, GAIN_RANGE) for name in names}
    bounds = {f"{SECTION}{name}": (name, reach) for name, (reach, of) in BOUNDS.items() if estimator in of}
    found = {}
    for key, value in changes.items():
        if key not in keys | bounds:
            known = ", ".join(keys | bounds) or "none"
            raise SettingError(f"{shown(key)} is not a key of a replay with {estimator}, which has {known}")
        name, (least, most) = (keys | bounds)[key]
        if isinstance(value, bool) or not isinstance(value, int | float) or not least <= value <= most:
            raise SettingError(f"{key} must be a number of {least:g} to {most:g}, not {shown(value)}")
        found[name] = float(value)
    gains = {name: found.pop(name) for name in names if name in found}
    lacking = [name for name in names if name not in gains]
    if gains and lacking:
        raise SettingError(f"{SECTION}gains.{estimator} must have all its gains: {', '.join(lacking)} is missing")
    if gains and found:
        raise SettingError(f"{SECTION}{min(found)} must be absent beside the gains, which it would set")
    return Settings(gains, **found)


def names_of(estimator: str) -> dict[str, str]:
    """Return the gains of an estimator: their names here, and their names in its class."""
    return {in_counts(name): name for name in registry.design_of(estimator).gains_class.__annotations__}


def in_counts(name: str) -> str:
    """Return the name of a gain with counts in place of metres."""
    return re.sub(r"_m(?=_|$)", "_counts", name)


def applied(spec: AxisSpec, settings: Settings, time: RecordTime) -> AxisSpec:
    """Return an axis with some settings.

    Raises:
        ValueError: if there is no such axis; the message names the field.
    """
    changes = {}
    if settings.jerk_max_counts_per_s3 is not None:
        changes["jerk_max_m_per_s3"] = time.to_axis(settings.jerk_max_counts_per_s3, 3)
    if settings.edge_error_max_counts is not None:
        changes["edge_error_max_counts"] = settings.edge_error_max_counts
    if settings.gains:
        names = names_of(spec.estimator)
        given = registry.design_of(spec.estimator).gains_class(**{names[n]: each for n, each in settings.gains.items()})
        changes["gains"] = time.gains(given)
    if not changes:
        return spec
    changed = replace(spec, **changes)
    # Gains may change the length of the path from a sample to its drive, before which no edge of the next may come.
    clocks = changed.clocks_per_sample
    while clocks < changed.design.latency_to_drive + DECODER_CLOCKS:
        clocks *= 2
    return replace(changed, clock_hz=clocks * changed.sample_hz)
