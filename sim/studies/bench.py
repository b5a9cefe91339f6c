"""How fast the closed loop runs, what every optional part of a scene costs, and how long a user waits at the prompt.

Every figure is a median over rounds in which the contestants take turns: see `jobs.rounds`.
"""

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from ...model.estimators.registry import ESTIMATORS
from ...model.runtime.build_folder import build_dir
from ...model.runtime.result import Table, table_of, text_of
from ..jobs.rounds import medians
from ..jobs.scratch import scratch
from ..rtl.cocotb_runner import Job, simulate_axis
from ..scene.case import Case, accepted
from ..scene.schema import Scene
from ..walls import hit
from .waiting_time import Wait, measure, table

OUTPUT = "controller.output"
ROUNDS = 5
SECONDS_OF_SCENE = {"float": 6.0, "fixed": 6.0, "rtl": 0.2}
"""Simulated time (s) of a round, by backend: the whole protocol for the models, enough to time the RTL."""
COCOTB_SAMPLES = 2000


def _parts(sample_s: float) -> dict[str, dict]:
    """Return changes that each give a scene one optional part, too slight to alter the motion. Only the bristles are
    not slight: they are about as in LuGre's paper. The last change has all parts that go together."""
    bare = {"handle.coulomb_n": None, "amplifier": None}
    cable = {"transmission.stiffness_n_per_m": 1e6, "transmission.damping_n_s_per_m": 10.0}
    motor = {"resistance_ohm": 2.0, "inductance_h": 3e-4, "torque_constant_n_m_per_a": 0.04}
    motor |= {"voltage_limit_v": 48.0, "pulley_radius_m": 0.01}
    alone = dict.fromkeys(("motor", "transmission", "hand", "output", "solver"))
    bristles = {"handle.coulomb_n": 0.1, "presliding.stiffness_n_per_m": 1e5}
    lugre = {"model": "lugre", "damping_n_s_per_m": 300.0, "static_n": 0.15, "stribeck_m_per_s": 1e-3}
    lugre = {f"presliding.{key}": value for key, value in lugre.items()}
    coupling = {"coupling.stiffness_n_per_m": 1e4, "coupling.sample_hz": round(1 / sample_s)}
    return {
        "none": bare,
        "coulomb friction": bare | {"handle.coulomb_n": 1e-12},
        "bristles, Dahl's model": bare | alone | bristles | {"presliding.model": "dahl"},
        "bristles, LuGre's model": bare | alone | bristles | lugre,
        "amplifier delay": {"handle.coulomb_n": None, "amplifier.delay_s": sample_s},
        "encoder phase error": bare | {"encoder.phase_error_counts": 1e-9},
        "passivity controller": bare | {"passivity.damping_n_s_per_m": 1e-2},
        "virtual coupling, a tool at every sample": bare | coupling,
        "converter": bare | {"output.full_scale_n": 64.0, "output.dac_bits": 32},
        "amplifier lag": bare | {"amplifier.bandwidth_hz": 1e5},
        "amplifier lag, motor, cable, friction": {
            "amplifier.bandwidth_hz": 1e4,
            **{f"motor.{key}": value for key, value in motor.items()},
            **cable,
            "transmission.motor_mass_kg": 0.05,
        },
    }


def _scene(case: Case, changes: dict, seconds: float) -> Scene:
    """Return a scene that lasts `seconds`, half of them for settling and half for measuring."""
    half = {"protocol.settle_s": seconds / 2, "protocol.mean_s": seconds / 4, "protocol.measure_s": seconds / 2}
    return case.changed(changes | half).scene


def _hits(scene: Scene, backend: str) -> Callable[[], float]:
    """Return a function that runs the closed loop and returns its speed in samples a second."""

    def run() -> float:
        result = hit.run(scene, backend)
        return result.samples / result.seconds

    run()  # compiles and builds
    return run


def under_cocotb(case: Case, samples: int) -> dict[str, Any]:
    """Return the `seconds` that the loop under cocotb takes for the first samples of a case, and its `force_sha256`."""
    with scratch(build_dir() / "cocotb") as folder:
        report = folder / "report.json"
        order = {"case": case.job(), "samples": samples, "report": str(report)}
        environ = {"HARDWALL_LOOP": json.dumps(order), "COCOTB_LOG_LEVEL": "WARNING"}
        log = build_dir() / "cocotb" / "bench.log"
        simulate_axis(case.scene.spec, Job("hardwall.sim.studies.cocotb_loop", folder, environ, log=log))
        return json.loads(report.read_text())


def _cocotb(case: Case) -> Callable[[], float]:
    """Return the same for the loop under cocotb, which raises RuntimeError if the force words are not the model's."""
    spec = case.scene.spec
    words = hit.run(_scene(case, {}, COCOTB_SAMPLES / spec.sample_hz), "fixed").force_sha256

    def run() -> float:
        result = under_cocotb(case, COCOTB_SAMPLES)
        if result["force_sha256"] != words:
            raise RuntimeError(f"the RTL under cocotb and the model differ in their first {COCOTB_SAMPLES} force words")
        return COCOTB_SAMPLES / result["seconds"]

    return run


class Clocks(NamedTuple):
    """The fewest clocks from a sample to the next, and those from a sample to the changed drive."""

    interval: int
    latency: int


def clocks_of_estimators(case: Case) -> dict[str, Clocks]:
    """Return the clocks of every estimator that a scene can have."""
    cases = accepted({name: case.changed({"controller.estimator": name, OUTPUT: None}) for name in ESTIMATORS})
    designs = {name: each.scene.spec.design for name, each in cases.items()}
    return {name: Clocks(design.interval, design.latency_to_drive) for name, design in designs.items()}


@dataclass(frozen=True)
class Speeds:
    """The measured speeds.

    Attributes:
        scene: name of the scene.
        samples_per_s: speed by backend, and under cocotb.
        clocks_per_sample: clocks of the hardware in a sample.
        ns_per_sample_of_parts: time of a sample by optional part.
        clocks: by estimator, the fewest clocks from a sample to the next, and those from a sample to the changed drive.
        waits: what a user waits for at the prompt.
    """

    scene: str
    samples_per_s: dict[str, float]
    clocks_per_sample: int
    ns_per_sample_of_parts: dict[str, float]
    clocks: dict[str, Clocks]
    waits: list[Wait]

    def _ratios(self) -> dict[str, float]:
        rtl, cocotb = self.samples_per_s["rtl"], self.samples_per_s["cocotb"]
        return {"rtl_over_cocotb": rtl / cocotb, "rtl_clocks_per_s": rtl * self.clocks_per_sample}

    def report(self) -> dict[str, Any]:
        """Return what the command line prints, units in the keys."""
        head = {"scene": self.scene, "rounds": ROUNDS, "samples_per_s": self.samples_per_s}
        clocks = {name: each._asdict() for name, each in self.clocks.items()}
        tail = {"clocks_of_estimators": clocks, "from_the_prompt": [wait.report() for wait in self.waits]}
        return head | self._ratios() | {"ns_per_sample_of_parts": self.ns_per_sample_of_parts} | tail

    def tables(self) -> list[Table]:
        """Return the same numbers, one a line, and a table each of the estimators and of the prompt."""
        speeds = {f"{name} (samples/s)": value for name, value in self.samples_per_s.items()}
        costs = {f"{name} (ns/sample)": value for name, value in self.ns_per_sample_of_parts.items()}
        lines = {"scene": self.scene, "rounds": ROUNDS} | self._ratios() | speeds | costs
        rows = [[name, str(each.interval), str(each.latency)] for name, each in self.clocks.items()]
        clocks = table_of(("estimator",), ("clocks a sample", "clocks to the drive"), rows)
        return [Table({}, [[key, text_of(value)] for key, value in lines.items()]), clocks, table(self.waits)]

    def notes(self) -> list[str]:
        return []


def study(case: Case, progress: Callable[[str], None], against: Path | None = None) -> Speeds:
    """Return samples a second by backend, nanoseconds a sample by optional part, and the time of whole commands.

    Args:
        case: the scene.
        progress: function called with the name of the next measurement.
        against: the program of another hardwall; its commands and this one's are run in turns.

    Raises:
        RuntimeError: if the force words of the RTL under cocotb differ from the model's.
        SceneError: if the scene has a coupling.
    """
    case.without_coupling("under cocotb nobody moves a tool")
    spec = case.scene.spec
    progress("compiling and building")
    speeds = {backend: _hits(_scene(case, {}, seconds), backend) for backend, seconds in SECONDS_OF_SCENE.items()}
    speeds["cocotb"] = _cocotb(case)
    parts = {
        name: _hits(_scene(case, changes, SECONDS_OF_SCENE["fixed"]), "fixed")
        for name, changes in _parts(1 / spec.sample_hz).items()
    }
    samples_per_s = medians(speeds, ROUNDS, progress)
    costs = {name: 1e9 / rate for name, rate in medians(parts, ROUNDS, progress).items()}
    clocks, waits = clocks_of_estimators(case), measure(case.text, against, progress)
    return Speeds(case.source, samples_per_s, spec.clocks_per_sample, costs, clocks, waits)
