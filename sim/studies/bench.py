"""How fast the closed loop runs, and what each optional part of a scene costs; measured side by side in one run.

Every figure is a median over rounds, and in each round every contestant runs once, so that a machine that slows down
slows them all.
"""

import json
import statistics
import tempfile
from collections.abc import Callable, Hashable
from pathlib import Path

from ...model.compiled import build_dir
from ..scene.load import load
from ..scene.schema import Scene
from ..walls import hit

ROUNDS = 5
SECONDS_OF_SCENE = {"float": 6.0, "fixed": 6.0, "rtl": 0.2}
"""Simulated time a round, by backend: the whole protocol of the model's, enough of the RTL's to time it."""
COCOTB_SAMPLES = 2000


def _parts(sample_s: float) -> dict[str, dict]:
    """Return changes that leave a scene one optional part each, so slight that the motion is as without; then all."""
    bare = {"handle.coulomb_n": None, "amplifier": None}
    cable = {"transmission.stiffness_n_per_m": 1e6, "transmission.damping_n_s_per_m": 10.0}
    motor = {"resistance_ohm": 2.0, "inductance_h": 3e-4, "torque_constant_n_m_per_a": 0.04}
    motor |= {"voltage_limit_v": 48.0, "pulley_radius_m": 0.01}
    return {
        "none": bare,
        "coulomb friction": bare | {"handle.coulomb_n": 1e-12},
        "amplifier delay": {"handle.coulomb_n": None, "amplifier.delay_s": sample_s},
        "encoder phase error": bare | {"encoder.phase_error_counts": 1e-9},
        "converter": bare | {"output.full_scale_n": 64.0, "output.dac_bits": 32},
        "amplifier lag": bare | {"amplifier.bandwidth_hz": 1e5},
        "amplifier lag, motor, cable, friction": {
            "amplifier.bandwidth_hz": 1e4,
            **{f"motor.{key}": value for key, value in motor.items()},
            **cable,
            "transmission.motor_mass_kg": 0.05,
        },
    }


def _scene(name: str, changes: dict, seconds: float) -> Scene:
    """Return a scene that lasts `seconds`, halved between settling and measuring."""
    half = {"protocol.settle_s": seconds / 2, "protocol.mean_s": seconds / 4, "protocol.measure_s": seconds / 2}
    return load(name, changes | half)


def medians(
    contestants: dict[Hashable, Callable[[], float]], rounds: int, progress: Callable[[str], None]
) -> dict[Hashable, float]:
    """Return the median over the rounds of what each contestant gives, taken in turns."""
    given: dict[Hashable, list[float]] = {name: [] for name in contestants}
    for number in range(rounds):
        for name, run in contestants.items():
            progress(f"round {number + 1} of {rounds}: {name}")
            given[name].append(run())
    return {name: statistics.median(values) for name, values in given.items()}


def _hits(scene: Scene, backend: str) -> Callable[[], float]:
    """Return a run of the closed loop, in samples a second."""

    def run() -> float:
        result = hit.run(scene, backend)
        return result.samples / result.seconds

    run()  # compiles and builds
    return run


def _cocotb(name: str) -> Callable[[], float]:
    """Return a run of the same closed loop under cocotb, in samples a second; its force words must be the model's."""
    from ..rtl.cocotb_runner import Job, simulate_axis  # noqa: PLC0415  (cocotb comes with the regressions)

    scene = load(name)
    words = hit.run(_scene(name, {}, COCOTB_SAMPLES / scene.spec.sample_hz), "fixed").force_sha256

    def run() -> float:
        with tempfile.TemporaryDirectory() as folder:
            report = Path(folder) / "report.json"
            # The simulator runs in a folder of its own.
            found = str(Path(name).absolute()) if name.endswith(".toml") else name
            order = {"scene": found, "samples": COCOTB_SAMPLES, "report": str(report)}
            environ = {"HARDWALL_LOOP": json.dumps(order), "COCOTB_LOG_LEVEL": "WARNING"}
            log = build_dir() / "cocotb" / "bench.log"
            simulate_axis(scene.spec, Job("hardwall.sim.studies.cocotb_loop", Path(folder), environ, log=log))
            result = json.loads(report.read_text())
        if result["force_sha256"] != words:
            raise RuntimeError(f"the RTL under cocotb and the model differ in their first {COCOTB_SAMPLES} force words")
        return COCOTB_SAMPLES / result["seconds"]

    return run


def bench(scene: str, progress: Callable[[str], None]) -> dict:
    """Return the benchmark's report: samples a second by backend, and nanoseconds a sample by optional part.

    Args:
        scene: name of a scene.
        progress: called with what is measured next.
    """
    progress("compiling and building")
    speeds = {backend: _hits(_scene(scene, {}, seconds), backend) for backend, seconds in SECONDS_OF_SCENE.items()}
    speeds["cocotb"] = _cocotb(scene)
    parts = {
        name: _hits(_scene(scene, changes, SECONDS_OF_SCENE["fixed"]), "fixed")
        for name, changes in _parts(1 / load(scene).spec.sample_hz).items()
    }
    samples_per_s = medians(speeds, ROUNDS, progress)
    costs = {name: 1e9 / rate for name, rate in medians(parts, ROUNDS, progress).items()}
    return {
        "scene": scene,
        "rounds": ROUNDS,
        "samples_per_s": samples_per_s,
        "rtl_over_cocotb": samples_per_s["rtl"] / samples_per_s["cocotb"],
        "rtl_clocks_per_s": samples_per_s["rtl"] * load(scene).spec.clocks_per_sample,
        "ns_per_sample_of_parts": costs,
    }
