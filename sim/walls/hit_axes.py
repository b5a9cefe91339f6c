"""Hits of several axes at once: a handle and a wall for each, and one pipeline for all.

In `float` and `fixed` every axis has a loop of its own, which takes the samples and changes the drive at the clocks of
the axis's turn in the rota: nothing goes from one axis to another. In `rtl` the hardware of all axes is one.
"""

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ...model.whole_file import whole_file
from ..jobs.result import Table, table_of
from ..scene.several import AxesScene
from . import hit
from .hit_rows import NOTES, NUMBERS, row_of


@dataclass(frozen=True)
class AxesHit:
    """The hits of all axes of a scene.

    Attributes:
        scene, backend: what was run.
        seconds: wall time of the loops, without compiling and building.
        hits: the `hit.Hit` of every axis, by its name.
    """

    scene: AxesScene
    backend: str
    seconds: float
    hits: dict[str, hit.Hit]

    @property
    def traced(self) -> bool:
        """Whether samples were kept."""
        return all(each.detail is not None for each in self.hits.values())

    def report(self) -> dict[str, Any]:
        """Return what is of all axes, with units in the keys, and the report of every axis under `rows`."""
        samples = self.scene.samples * len(self.hits)
        return {
            "scene": self.scene.name,
            "backend": self.backend,
            "samples": samples,
            "seconds": self.seconds,
            "samples_per_s": samples / self.seconds,
            "rows": [{"axis": name} | each.report() for name, each in self.hits.items()],
        }

    def tables(self) -> list[Table]:
        rows = [row_of(name, each.report()) for name, each in self.hits.items()]
        return [table_of(("axis",), NUMBERS, rows)]

    def notes(self) -> list[str]:
        raised = [f"{name}: {', '.join(each.flags)}" for name, each in self.hits.items() if each.flags]
        return [*NOTES, *(f"flags of {line}" for line in raised)]

    def save(self, path: Path) -> None:
        """Write the traces of all axes as an .npz: `NAME_overview_time_s` and so on, and the report as JSON text.

        Raises:
            OSError: if the file cannot be written.
        """
        arrays = {f"{name}_{key}": array for name, each in self.hits.items() for key, array in each.arrays().items()}
        with whole_file(path) as part, part.open("wb") as file:
            np.savez_compressed(file, report=json.dumps(self.report()), **arrays)


def run(scene: AxesScene, backend: str, traces: bool = False, progress: Callable[[int], None] | None = None) -> AxesHit:
    """Hit the walls of all axes of a scene and return the result.

    Args:
        scene: a scene from `scene.tables.load_any`.
        backend: `float` or `fixed`.
        traces: keep samples of the whole runs and of the contacts.
        progress: called with the number of samples done, of all axes together.

    Raises:
        RuntimeError: if a handle outran every decoder's limit by far.
    """
    hits = {}
    for number, axis in enumerate(scene.axes):

        def done(samples: int, before: int = number * scene.samples) -> None:
            if progress:
                progress(before + samples)

        hits[axis.axis] = hit.run(axis, backend, traces, done)
    return AxesHit(scene, backend, sum(each.seconds for each in hits.values()), hits)
