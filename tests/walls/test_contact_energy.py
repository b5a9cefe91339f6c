"""The energy that an observer sees in a contact, beside the work of the drive on the handle's true motion."""

import numpy as np
import pytest

from hardwall.model.axis import passivity
from hardwall.sim.scene.load import load
from stimuli.handle_paths import energies
from stimuli.hit_paths import path_of


def contact(scene: str, stiffness: float, damping: float) -> tuple[float, float, float]:
    """Return the energy of a contact that the handle leaves (J): as observed, of the true motion, and all moved."""
    changes = {
        "wall.stiffness_n_per_m": stiffness, "wall.damping_n_s_per_m": damping, "protocol.start_m": -2e-3,
        "protocol.settle_s": 0.3, "protocol.longest_s": 0.4, "protocol.mean_s": 0.1, "protocol.measure_s": 0.1,
    }  # fmt: skip
    loaded = load(scene, changes | ({"amplifier.delay_s": None} if scene == "seed-2011" else {}))
    position_m, drives = path_of(loaded, "fixed")
    near = int(np.argmax(position_m > -0.2e-3))
    position_m, drives = (each[near : near + loaded.spec.sample_hz // 10] for each in (position_m, drives))
    q, r = loaded.encoder.count_m, loaded.spec.force_resolution_n
    works = -r * drives[:-1] * np.diff(position_m)
    counts = np.floor(position_m / q).astype(int)
    d = passivity.Design(loaded.spec, loaded.spec.design.estimator.velocity)
    found = energies(d.params({"passivity_damping": 0}), counts.tolist(), drives.tolist())
    entered = int(np.argmax(position_m > 0))
    left = entered + int(np.argmax(position_m[entered:] < 0))
    assert entered < left < len(works)
    return found[left] * r * q / 2, works[:left].sum(), np.abs(works[:left]).sum()


@pytest.mark.parametrize(("scene", "share"), [("mhz", 0.03), ("seed-2011", 0.001)])
def test_the_energy_is_the_work_of_the_force_on_the_true_motion(scene, share):
    """Edge by edge at 1 MHz, and many counts a sample at 10 kHz, in a wall that is a spring alone."""
    observed, work, moved = contact(scene, 20e3, 0.0)
    assert abs(observed - work) < share * moved


def test_a_damper_whose_estimate_jumps_at_an_edge_is_counted_too_low():
    """The drive at the end of a count is less than its mean there; so the controller is on the side that damps."""
    observed, work, _ = contact("mhz", 50e3, 20.0)
    assert 0.65 * work < observed < 0.75 * work
