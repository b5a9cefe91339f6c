"""Ways of a handle under a drive, and the energy that a passivity controller's observer sees on them."""

import numpy as np
import pytest

from hardwall.model.axis import passivity
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


def energies(params: passivity.Params, counts: list[int], drives: list[int]) -> list[int]:
    """Return the energy at every sample of a way, with a debt that is never paid: nothing of it is forgotten.

    Args:
        params: the observer's.
        counts: of every sample.
        drives: from every sample on, force LSB.
    """
    debt, kept = -(1 << 30), []
    state = passivity.START._replace(energy=debt, last_count=counts[0])
    for k, count in enumerate(counts):
        drive = drives[k - 1] if k else 0
        state, _, _ = passivity.step(params, state, count, 0, 0, drive, drive)
        kept.append(state.energy - debt)
    return kept
