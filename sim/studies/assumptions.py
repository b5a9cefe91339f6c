"""Which facts of the founding paper's Figure 5 depend on what a scene assumes of the paper's device, and on the grid.

The paper gives no mass, no friction, no delay and no threshold, and its steps of K and B were lost. So every assumed
value is changed alone, down and up by `FACTOR`, and a delay by one sample. A value beyond the range that `fit` searches
is left out. The steps of the grid are changed, too, and the protocol of the verdict. Each change has the maps of the
paper's six methods, their facts, and the share of the draws of the starts that show each fact.
"""

from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from typing import Any

from ...model.runtime.result import Table, table_of
from ..scene.case import Case
from ..scene.schema import Scene
from ..walls.figure_5 import Fact, with_shares
from ..walls.grid import grid_of
from ..walls.mapping import Effort, Mapper
from ..walls.methods import methods
from .fit import Range, searched, value_of

FACTOR = 1.5
"""The factor by which a value is changed."""
GRIDS = (
    {"zwidth.stiffness_step_n_per_m": 2.0},
    {"zwidth.stiffness_step_n_per_m": 4.0},
    {"zwidth.damping_step_n_s_per_m": 2.0},
    {"zwidth.stiffness_step_n_per_m": 4.0, "zwidth.damping_step_n_s_per_m": 2.0},
)
"""Coarser grids: the factors of their steps."""
VERDICTS = "detrended", "literal"
"""The protocols of the verdict: see the scene's key."""


@dataclass(frozen=True)
class Changed:
    """A change of the scene, by dotted key, and the facts that its maps show."""

    changes: dict[str, Any]
    facts: list[Fact]

    @property
    def held(self) -> int:
        """The number of facts that hold."""
        return sum(fact.held for fact in self.facts)

    @property
    def text(self) -> str:
        """The change in words: the keys without their section."""
        shown = {key.rpartition(".")[2]: _shown(value) for key, value in self.changes.items()}
        return ", ".join(f"{key}={value}" for key, value in shown.items()) or "as it is"


@dataclass(frozen=True)
class Assumptions:
    """The result of the study.

    Attributes:
        scene: the scene.
        values: its own values of what is changed, by dotted key.
        rows: its changes; first the scene as it is.
        effort: effort of the maps.
    """

    scene: Scene
    values: dict[str, Any]
    rows: list[Changed]
    effort: Effort

    def report(self) -> dict[str, Any]:
        """Return what the command line prints."""
        rows = [
            {"changes": row.changes, "held": row.held, "facts": [asdict(fact) for fact in row.facts]}
            for row in self.rows
        ]
        return {"scene": self.scene.name, "values": self.values} | self.effort._asdict() | {"rows": rows}

    def tables(self) -> list[Table]:
        """Return the share of draws that show each fact, a row for each change."""
        numbers = [str(number) for number in range(1, len(self.rows[0].facts) + 1)]
        rows = [[row.text, *(f"{fact.share or 0:.0%}" for fact in row.facts), str(row.held)] for row in self.rows]
        return [table_of((self.scene.name,), (*numbers, "held"), rows)]

    def notes(self) -> list[str]:
        """Return the facts by their numbers."""
        texts = [f"{number}: {fact.text}" for number, fact in enumerate(self.rows[0].facts, 1)]
        return [*texts, "of each fact: in which part of the draws of the starts it holds"]


def changes_of(scene: Scene) -> Iterator[dict[str, Any]]:
    """Yield the changes of a scene, by dotted key: none, then every assumed value alone, the grids, the verdict.

    Raises:
        SceneError: if the scene lacks a value that is changed.
    """
    yield {}
    for key, where in searched(scene).items():
        for value in _beside(value_of(scene, key), where, scene.controller.sample_hz):
            if where.low <= value <= where.high:
                yield {key: value}
    for grid in GRIDS:
        yield {key: factor * value_of(scene, key) for key, factor in grid.items()}
    (other,) = (each for each in VERDICTS if each != scene.protocol.verdict)
    yield {"protocol.verdict": other}


def _beside(own: float, where: Range, sample_hz: int) -> tuple[float, float]:
    """Return the values below and above a scene's own one."""
    if where.scale == "samples":
        samples = round(own * sample_hz)
        return (samples - 1) / sample_hz, (samples + 1) / sample_hz
    return float(f"{own / FACTOR:.3g}"), float(f"{own * FACTOR:.3g}")


def study(case: Case, mapper: Mapper, progress: Callable[[int], None]) -> Assumptions:
    """Return what the facts depend on.

    Args:
        case: the scene.
        mapper: function that makes the maps, and keeps them.
        progress: function called after every change with the number of changes done.

    Raises:
        SceneError: if the scene is not valid, or lacks a value that is changed.
        NeverReached: if the handle of a change does not reach the wall.
    """
    rows: list[Changed] = []
    cases = [(changes, case.changed(changes)) for changes in changes_of(case.scene)]
    for _, changed in cases:
        grid_of(changed.scene)  # raises SceneError before anything is mapped
    for changes, changed in cases:
        papers = methods(changed.scene)
        maps = mapper("assumptions", [changed.changed(each.changes, each.label) for each in papers.values()])
        rows.append(Changed(changes, with_shares(dict(zip(papers, maps, strict=True)))))
        progress(len(rows))
    values = {key: value_of(case.scene, key) for row in rows for key in row.changes}
    return Assumptions(case.scene, values, rows, mapper.effort())


def _shown(value: Any) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)
