"""The same hit on two scenes, side by side: one wall, and two loops that render it."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from ...model.runtime.result import Table, table_of
from ..scene.schema import Scene
from . import hit
from .hit_rows import NOTES, NUMBERS, row_of


@dataclass(frozen=True)
class Beside:
    """Two hits.

    Attributes:
        hits: the hit of each scene, in their order.
    """

    hits: tuple[hit.Hit, hit.Hit]

    def report(self) -> dict[str, Any]:
        """Return the report of each hit under `rows`."""
        return {"rows": [each.report() for each in self.hits]}

    def tables(self) -> list[Table]:
        """Return a table with a row for each hit."""
        rows = [row_of(f"{each.scene.name}, {each.scene.controller.estimator}", each.report()) for each in self.hits]
        return [table_of(("scene",), NUMBERS, rows)]

    def notes(self) -> list[str]:
        """Return the meaning of the columns, and the flags of each hit."""
        return [*NOTES, *(f"flags of {each.scene.name}: {', '.join(each.flags)}" for each in self.hits if each.flags)]


def run(
    scenes: tuple[Scene, Scene], backend: str, traces: bool = False, progress: Callable[[int], None] | None = None
) -> Beside:
    """Hit the walls of two scenes, one after the other, and return both results.

    Args:
        scenes: scenes of one axis.
        backend: one of `backends.BACKENDS`.
        traces: keep samples of the whole runs, which a picture needs.
        progress: called with the number of samples done, of both together.

    Raises:
        RuntimeError: see `hit.run`.
    """
    first, second = scenes

    def after(samples: int) -> None:
        if progress:
            progress(first.samples + samples)

    return Beside((hit.run(first, backend, traces, progress), hit.run(second, backend, traces, after)))
