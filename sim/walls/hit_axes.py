"""Hits of several axes at once: a handle and a wall for each, and one pipeline for all.

In `float` and `fixed` every axis has its own loop. The loop takes the samples and changes the drive at the clocks of
the axis's turn in the rota. Nothing goes from one axis to another. In `rtl` the hardware of all axes is one.
"""

import json
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import islice, pairwise
from pathlib import Path
from typing import Any

import numpy as np

from ...model.runtime.result import Table, table_of
from ...model.runtime.stages import stage
from ...model.runtime.whole_file import whole_file
from ..loop.interleaved import turns
from ..loop.values import EDGE_CAPACITY
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
        """Return the values common to all axes, with units in the keys, and the report of every axis under `rows`."""
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
        backend: one of `backends.BACKENDS`.
        traces: keep samples of the whole runs and of the contacts.
        progress: called with the number of samples done, of all axes together.

    Raises:
        RuntimeError: if a handle outran every decoder's limit by far, or the RTL could not be built.
    """
    if backend == "rtl":
        return _run_rtl(scene, traces, progress)
    hits = {}
    for number, axis in enumerate(scene.axes):

        def done(samples: int, before: int = number * scene.samples) -> None:
            if progress:
                progress(before + samples)

        hits[axis.axis] = hit.run(axis, backend, traces, done)
    return AxesHit(scene, backend, sum(each.seconds for each in hits.values()), hits)


def _run_rtl(scene: AxesScene, traces: bool, progress: Callable[[int], None] | None) -> AxesHit:
    """Close all loops around one piece of hardware."""
    from ..rtl.axes_library import HardwareOfAxes  # noqa: PLC0415  (the other backends need no C++ compiler)

    loops = [hit.Loop(axis, "rtl", traces, False) for axis in scene.axes]
    flags = np.zeros((len(loops), 1), np.int64)
    words, levels = [axis.words for axis in scene.axes], [loop.start_level for loop in loops]
    with HardwareOfAxes(scene.spec, words, levels) as hardware:
        with stage("compiling the loops, once"):
            ways = [
                turns(loop.world, controller, loop.at, loop.memory, raised, scene.samples)
                for loop, controller, raised in zip(loops, hardware.controllers, flags, strict=True)
            ]
        began = time.perf_counter()
        for done in _rounds(ways, loops, scene):
            if progress:
                progress(done * len(loops))
        seconds = time.perf_counter() - began
    hits = {loop.scene.axis: loop.result(seconds, int(raised[0])) for loop, raised in zip(loops, flags, strict=True)}
    return AxesHit(scene, "rtl", seconds, hits)


def _rounds(ways: list[Iterator[int]], loops: list[hit.Loop], scene: AxesScene) -> Iterator[int]:
    """Let the loops take their turns to the end; yield the number of samples of every axis that are done, now and then.

    Every loop's samples are tallied when its arrays are full, as in a loop that runs alone.

    Raises:
        RuntimeError: if a handle outran every decoder's limit by far.
    """
    rounds = zip(*ways, strict=False)  # a loop that lost edges ends before the others
    steps = {max(scene.samples // hit.LOOKS, 1), *(loop.chunk for loop in loops)}
    ends = sorted({scene.samples}.union(*(range(step, scene.samples, step) for step in steps)))
    next(rounds, None)  # the edges until the first change
    for first, end in pairwise([0, *ends]):
        done = first + sum(1 for _ in islice(rounds, end - first))
        if done < end:
            when = done / scene.spec.sample_hz
            raise RuntimeError(f"a handle passed more than {EDGE_CAPACITY} edges in a sample, at {when:g} s")
        for loop in loops:
            begin = first // loop.chunk * loop.chunk
            if end == scene.samples or end % loop.chunk == 0:
                loop.tally.add(begin, loop.memory.positions[: end - begin], loop.memory.drives[: end - begin])
                loop.at = loop.at._replace(sample=end)
        yield end
