"""Which virtual mass is stable: hits over the mass, by wall, estimator and rate, beside the theory of a rigid handle.

The wall has the mass. The softest wall here hardly pushes, and shows what free space allows. A mass counts as stable if
the handle comes to rest from every start.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from ...model.runtime.result import Summary, Table, table_of
from ..jobs import store
from ..scene.case import Case
from ..scene.errors import SceneError
from ..walls.hit import STABLE
from ..walls.mass_theory import stable_shares
from ..walls.methods import Curve
from .rates import SHORT, at_rate

METHODS = ("kalman", "count-kalman", "edge-kalman", "levant-2-implicit", "levant-3-implicit")
SHARES = (-0.9, -0.7, -0.5, -0.3, -0.2, -0.1, 0.0, 0.1, 0.2, 0.3, 0.5, 0.7, 0.9)
"""The masses, as shares of the handle's mass."""
MOST = 0.99
"""The largest share that can be asked for: theory ends at 1."""


class Wall(NamedTuple):
    """A wall that gets the mass: its stiffness, N/m, and damping, N s/m."""

    stiffness_n_per_m: float
    damping_n_s_per_m: float

    def __str__(self) -> str:
        return f"{self.stiffness_n_per_m / 1e3:g} kN/m, {self.damping_n_s_per_m:g} N s/m"


WALLS = (Wall(200.0, 5.0), Wall(10e3, 20.0), Wall(40e3, 60.0))
"""A wall that is hardly there, the founding paper's, and a stiffer one."""
NOT_IN_THEORY = "coupling", "passivity", "motor", "transmission", "hand"
"""Sections of a scene that the theory of a rigid handle does not know."""


class Setting(NamedTuple):
    """What a row is of: estimator, sample rate (None: the scene's rates) and wall."""

    curve: Curve
    rate_hz: int | None
    wall: Wall


@dataclass(frozen=True)
class Masses(Summary):
    """The result of the study.

    Attributes:
        scene: name of the scene.
        mass_kg: the mass of its handle.
        starts: the number of starts.
        shares: the virtual masses, as shares of the handle's, ascending.
        settings: what the rows are of, rates within estimators within walls.
        stable: for every setting the number of stable starts, by share.
        theory: the range of stable shares in theory by rate and wall; None if there is none.
    """

    scene: str
    mass_kg: float
    starts: int
    shares: list[float]
    settings: list[Setting]
    stable: list[list[int]]
    theory: dict[tuple[int | None, Wall], tuple[float, float] | None]

    def range_of(self, row: int) -> tuple[float, float] | None:
        """Return the least and the largest mass, as shares, between which all starts of a row are stable.

        It is the longest such range; None if no mass is stable from all starts.
        """
        runs: list[list[float]] = [[]]
        for share, stable in zip(self.shares, self.stable[row], strict=True):
            if stable == self.starts:
                runs[-1].append(share)
            elif runs[-1]:
                runs.append([])
        longest = max(runs, key=len)
        return (longest[0], longest[-1]) if longest else None

    def report(self) -> dict[str, Any]:
        """Return what the command line prints, units in the keys."""
        rows = []
        for number, (curve, rate_hz, wall) in enumerate(self.settings):
            found, expected = self.range_of(number), self.theory[rate_hz, wall]
            rows.append(
                {
                    "label": curve.label,
                    "estimator": curve.estimator,
                    "output": curve.output,
                    "rate_hz": rate_hz,
                    **wall._asdict(),
                    "stable_starts": self.stable[number],
                    "from_share": found and found[0],
                    "to_share": found and found[1],
                    "theory_from_share": expected and expected[0],
                    "theory_to_share": expected and expected[1],
                }
            )
        return {"handle_kg": self.mass_kg, "starts": self.starts, "shares": self.shares, "rows": rows}

    def tables(self) -> list[Table]:
        """Return the stable masses by estimator, a column for every rate and wall."""
        columns = list(self.theory)
        labels = dict.fromkeys(setting.curve.label for setting in self.settings)
        found = {
            (setting.curve.label, setting.rate_hz, setting.wall): self.range_of(row)
            for row, setting in enumerate(self.settings)
        }
        rows = [["theory, exact", *(range_text(self.theory[column]) for column in columns)]]
        rows += [[label, *(range_text(found[label, *column]) for column in columns)] for label in labels]
        heads = [f"{rate_text(rate_hz)}: {wall}" for rate_hz, wall in columns]
        return [table_of(("stable virtual mass / handle's",), heads, rows)]

    def notes(self) -> list[str]:
        """Return what a range says."""
        return [f"from to, where all {self.starts} starts come to rest, of the shares that were tried: "
                f"{', '.join(f'{share:g}' for share in self.shares)}"]  # fmt: skip


def range_text(shares: tuple[float, float] | None) -> str:
    """Return a range of shares as text."""
    return "none" if shares is None else f"{shares[0]:+.2g} to {shares[1]:+.2g}"


def rate_text(rate_hz: int | None) -> str:
    """Return a sample rate as text."""
    return "own rates" if rate_hz is None else f"{rate_hz / 1e3:g} kHz"


def settings_of(curves: list[Curve], rates_hz: list[int], walls: Sequence[Wall] = WALLS) -> list[Setting]:
    """Return every setting: at the scene's own rates, and at others."""
    rates = (None, *rates_hz)
    return [Setting(curve, rate_hz, wall) for wall in walls for curve in curves for rate_hz in rates]


def case_of(case: Case, setting: Setting, share: float) -> Case:
    """Return the case of a setting, with a virtual mass as a share of the handle's."""
    mass_kg = case.scene.handle.mass_kg
    rates = {} if setting.rate_hz is None else at_rate(setting.rate_hz)
    mass = {"virtual_mass.most_kg": MOST * mass_kg * (1 + 1e-9), "virtual_mass.in_wall_kg": share * mass_kg}
    return case.with_defaults(SHORT).changed(rates | setting.curve.changes | mass, setting.curve.label)


def jobs(case: Case, settings: list[Setting], shares: list[float], starts: int, backend: str) -> list[dict[str, Any]]:
    """Return the hits, as jobs of `walls.mapping.verdict`: starts within shares within settings.

    Raises:
        SceneError: if a case is not valid, or the theory does not know its device.
    """
    scene = case.scene
    for section in NOT_IN_THEORY:
        if getattr(scene, section) is not None:
            raise SceneError(f"{scene.name}: {section} must be absent: the theory beside the hits is of a rigid handle")
    if scene.amplifier is not None and scene.amplifier.bandwidth_hz is not None:
        raise SceneError(f"{scene.name}: amplifier.bandwidth_hz must be absent: the theory knows only a delay")
    common, made = {"sources": store.sources(), "backend": backend}, []
    for setting in settings:
        for share in shares:
            each = case_of(case, setting, share)
            each.hitting(*setting.wall)  # raises SceneError before the first hit
            made += [each.job() | common | {"wall": tuple(setting.wall), "start": start} for start in range(starts)]
    return made


def study(case: Case, settings: list[Setting], shares: list[float], starts: int, results: list[dict]) -> Masses:
    """Return the study of the verdicts on `jobs`, in their order."""
    verdicts = iter(result["verdict"] for result in results)
    stable = [[sum(next(verdicts) == STABLE for _ in range(starts)) for _ in shares] for _ in settings]
    theory = {}
    for _, rate_hz, wall in settings:
        if (rate_hz, wall) not in theory:
            changed = {} if rate_hz is None else at_rate(rate_hz)
            theory[rate_hz, wall] = stable_shares(case.changed(changed).scene, *wall)
    return Masses(case.scene.name, case.scene.handle.mass_kg, starts, shares, settings, stable, theory)
