"""The path of a handle in a hit, and the drive on it."""

import numpy as np
import pytest

from hardwall.sim.scene.schema import Scene
from hardwall.sim.walls import hit
from hardwall.sim.walls.hit_statistics import Tally


def path_of(scene: Scene, backend: str) -> tuple[np.ndarray, np.ndarray]:
    """Return position (m) and drive (force LSB) at every sample of a hit, by the loop that keeps no traces."""
    kept, add = [], Tally.add

    def added(tally: Tally, first: int, positions: np.ndarray, drives: np.ndarray) -> None:
        kept.append((positions.copy(), drives.copy()))
        add(tally, first, positions, drives)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Tally, "add", added)
        hit.run(scene, backend)
    positions, drives = map(np.concatenate, zip(*kept, strict=True))
    return positions, drives
