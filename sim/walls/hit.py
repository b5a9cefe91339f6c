"""Hitting the wall: the founding paper's protocol on any scene and backend."""

import hashlib
import json
import math
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...model import stamped
from ...model.axis import Axis
from ..jobs.result import Summary
from ..jobs.whole_file import whole_file
from ..loop import loop, record
from ..scene.build import output_step_n, start_of, work_of, world_of
from ..scene.schema import Scene
from ..world.encoder import level

BACKENDS = ("float", "fixed", "rtl")
CHUNK = 1 << 16
"""Samples between two looks at progress, and at whether the user wants no more; fewer of those that take long."""
LOOK_S = 0.1
"""Time between two looks at whether the verdict is sure."""
OVERVIEW_POINTS = 6000
DETAIL_FROM_M = -0.2e-3
DETAIL_S = 0.1
WAVEFORM_CLOCKS = 60_000
"""Length of a waveform; a fifth of it before the contact."""


@dataclass
class Hit(Summary):
    """Result of a run; `report` is its summary.

    Attributes:
        seconds: wall time of the loop, compiling and building apart.
        mean_m: mean position before the settling mark, m; positive is inside the wall.
        rms_m: RMS distance from it after the mark, m.
        touched: whether the handle ever was within the wall, or felt it.
        force_sha256: of the drive words of every actuation, little-endian int32; None for `float`.
        overview, detail: if asked for, samples of the whole run, and every one of the contact.
    """

    scene: Scene
    backend: str
    samples: int
    seconds: float
    mean_m: float
    rms_m: float
    touched: bool
    max_force_n: float
    flags: list[str]
    force_sha256: str | None
    overview: record.Trace | None = None
    detail: record.Trace | None = None

    @property
    def stable(self) -> bool:
        """Whether the handle touched the wall, and the RMS stays under the protocol's threshold."""
        return self.touched and self.rms_m * 1e3 < self.scene.protocol.threshold_mm

    @property
    def in_place(self) -> bool:
        """Whether the handle rests where the wall's spring alone would hold it.

        At rest the velocity is 0, and the spring carries the push and the hand, but for the friction that sticks, a
        step of the output and what a count hides. A wall may be stable and felt elsewhere: where the estimate is not 0
        at rest, its damper carries a part. The mean after the settling mark is not farther from the one before it than
        the RMS.
        """
        scene, stiffness = self.scene, self.scene.wall.stiffness_n_per_m
        hand, cable = scene.hand, scene.transmission
        carried_n = scene.protocol.push_n + (hand.stiffness_n_per_m * (hand.rest_m - self.mean_m) if hand else 0.0)
        slack_n = (scene.handle.coulomb_n or 0.0) + output_step_n(scene)
        hidden_m = scene.encoder.count_m + self.rms_m
        if cable and cable.encoder_at == "motor":
            hidden_m += (abs(carried_n) + slack_n) / cable.stiffness_n_per_m
        slack_n += stiffness * hidden_m
        return abs(stiffness * self.mean_m - carried_n) <= slack_n

    @property
    def contact_s(self) -> float:
        """Time of the first sample inside the wall, of those that `detail` has; else of the end."""
        inside = np.flatnonzero(self.detail.position_m > 0)
        return float(self.detail.time_s[inside[0]]) if len(inside) else self.samples / self.scene.spec.sample_hz

    @property
    def estimate_rms_m_per_s(self) -> float | None:
        """RMS error of the velocity estimate over `detail`, the first contact; None without traces, or a contact."""
        if self.detail is None or not len(self.detail.time_s):
            return None
        return float(np.sqrt(np.mean((self.detail.estimate_m_per_s - self.detail.velocity_m_per_s) ** 2)))

    def save(self, path: Path) -> None:
        """Write the traces as an .npz: `overview_time_s`, `detail_force_n` and so on, and the report as JSON text.

        Raises:
            OSError: if the file cannot be written.
        """
        kept = {"overview": self.overview, "detail": self.detail}
        arrays = {f"{name}_{key}": array for name, trace in kept.items() for key, array in vars(trace).items()}
        with whole_file(path) as part, part.open("wb") as file:
            np.savez_compressed(file, report=json.dumps(self.report()), **arrays)

    def report(self) -> dict:
        """Return the summary that the command line prints, units in the keys."""
        error = self.estimate_rms_m_per_s
        return {
            "scene": self.scene.name,
            "backend": self.backend,
            "estimator": self.scene.controller.estimator,
            "output": self.scene.estimator_output,
            "stiffness_n_per_m": self.scene.wall.stiffness_n_per_m,
            "damping_n_s_per_m": self.scene.wall.damping_n_s_per_m,
            "stable": self.stable,
            "touched": self.touched,
            "rms_mm": self.rms_m * 1e3,
            "mean_mm": self.mean_m * 1e3,
            "samples": self.samples,
            "seconds": self.seconds,
            "samples_per_s": self.samples / self.seconds,
            "max_force_n": self.max_force_n,
            "estimate_rms_mm_per_s": error and error * 1e3,
            "flags": self.flags,
            "force_sha256": self.force_sha256,
        }


class _Tally:
    """Mean, RMS, largest force and force words of a run, chunk by chunk."""

    def __init__(self, scene: Scene, exact: bool):
        spec, protocol = scene.spec, scene.protocol
        self._hopeless = round(protocol.measure_s * spec.sample_hz) * (protocol.threshold_mm * 1e-3) ** 2
        self._settled = round(protocol.settle_s * spec.sample_hz)
        self._mean_from = self._settled - round(protocol.mean_s * spec.sample_hz)
        self._decimation = spec.samples_per_actuation
        self._digest = hashlib.sha256() if exact else None
        self._sum = self._squares = 0.0
        self._measured = 0
        self.largest_drive, self.farthest_m = 0, -math.inf

    @property
    def mean_m(self) -> float:
        return self._sum / (self._settled - self._mean_from)

    @property
    def rms_m(self) -> float:
        """Of what was measured; infinite if nothing was."""
        return (self._squares / self._measured) ** 0.5 if self._measured else math.inf

    @property
    def sure_unstable(self) -> bool:
        """Whether the rest of the run cannot make it stable: its squares already exceed what the threshold allows."""
        return self._squares >= self._hopeless

    @property
    def force_sha256(self) -> str | None:
        return self._digest and self._digest.hexdigest()

    def add(self, first: int, positions: np.ndarray, drives: np.ndarray) -> None:
        def part(start: int, stop: int) -> np.ndarray:
            return positions[max(start - first, 0) : max(stop - first, 0)]

        self._sum += float(part(self._mean_from, self._settled).sum())
        rest = part(self._settled, first + len(positions))
        if len(rest):
            self._squares += float(np.square(rest - self.mean_m).sum())
            self._measured += len(rest)
        self.largest_drive = max(self.largest_drive, float(np.abs(drives).max()))
        self.farthest_m = max(self.farthest_m, float(positions.max()))
        if self._digest:
            self._digest.update(drives[-first % self._decimation :: self._decimation].astype("<i4").tobytes())


def run(
    scene: Scene,
    backend: str,
    traces: bool = False,
    progress: Callable[[int], None] | None = None,
    waveform: Path | None = None,
    until_sure: bool = False,
) -> Hit:
    """Hit the wall of `scene` and return what came of it.

    Args:
        scene: from `scene.load`.
        backend: one of `BACKENDS`.
        traces: keep samples of the whole run and of the contact.
        progress: called with the number of samples done.
        waveform: for `rtl`, an FST file to write, of every signal around the contact.
        until_sure: end a run that is unstable for certain, or whose handle outruns the encoder by far; its `rms_m` is
            that until then, or infinite.

    Raises:
        RuntimeError: if the handle outran every decoder's limit by far, or the RTL could not be built.
    """
    floating, spec, world = backend == "float", scene.spec, world_of(scene)
    at = start_of(scene, world)
    start_level = int(level(at.cell.number))
    records = None, None
    if traces:
        stride = max(1, scene.samples // OVERVIEW_POINTS)
        records = (
            record.new(spec, floating, -np.inf, stride, scene.samples // stride + 1),
            record.new(spec, floating, DETAIL_FROM_M, 1, round(DETAIL_S * spec.sample_hz)),
        )
    if backend != "rtl":
        controller, state = stamped.controller(Axis(spec, floating, **scene.parameters), start_level)
        return _closed_loop(scene, backend, world, controller, state, at, records, progress, (), until_sure)

    from ..rtl.library import Hardware  # noqa: PLC0415  (the other backends need neither Amaranth nor a C++ compiler)

    with Hardware(spec, scene.words, start_level, traced=waveform is not None) as hardware, _vcd(waveform) as vcd:
        # What the hardware will do is known before it runs: the contact is where the bit-accurate model has it.
        marks = _waveform_marks(scene, hardware, vcd) if waveform else ()
        result = _closed_loop(
            scene, backend, world, hardware.controller, hardware.start, at, records, progress, marks, until_sure
        )
        if waveform:
            hardware.end_trace()
        return result


@contextmanager
def _vcd(waveform: Path | None) -> Iterator[Path | None]:
    """Give a VCD file to write to; turn it into `waveform` at the end."""
    if waveform is None:
        yield None
        return
    from ..rtl.waveform import vcd_to_fst  # noqa: PLC0415  (only waveforms need its library)

    with tempfile.TemporaryDirectory() as folder:
        vcd = Path(folder) / "axis.vcd"
        yield vcd
        vcd_to_fst(vcd, waveform)


def _waveform_marks(scene: Scene, hardware, vcd: Path) -> list[tuple[int, Callable[[], None]]]:
    """Return at which samples to do what for a waveform around the contact."""
    length = max(1, WAVEFORM_CLOCKS // scene.spec.clocks_per_sample)
    contact = round(run(scene, "fixed", traces=True).contact_s * scene.spec.sample_hz)
    first = max(contact - length // 5, 0)
    return [(first, lambda: hardware.trace(vcd)), (first + length, hardware.end_trace)]


def _closed_loop(scene, backend, world, controller, state, at, records, progress, marks, until_sure) -> Hit:
    """Run the loop in chunks that end at the `marks` (sample, action), and tally it."""
    floating, total = backend == "float", scene.samples
    number = np.float64 if floating else np.int64
    delay = loop.Delay(np.zeros(scene.delay_samples, number)) if scene.delay_samples else None
    edges = np.zeros(loop.EDGE_CAPACITY, np.int64), np.zeros(loop.EDGE_CAPACITY, np.int64)
    chunk = max(round(LOOK_S * scene.spec.sample_hz), 1) if until_sure else CHUNK
    chunk = max(1, min(chunk, CHUNK // work_of(world)))
    positions, drives = np.zeros(chunk), np.zeros(chunk, number)
    tally, actions = _Tally(scene, exact=not floating), dict(marks)
    # Compiling is not running: a call with nothing to do keeps it out of the time.
    loop.run(world, controller, state, at, delay, records, edges, positions, drives, 0)
    began = time.perf_counter()
    while at.sample < total and not (until_sure and tally.sure_unstable):
        first = at.sample
        if first in actions:
            actions.pop(first)()
        until = min(first + chunk, total, *(sample for sample in actions if sample > first))
        state, at = loop.run(world, controller, state, at, delay, records, edges, positions, drives, until)
        if at.n_edges < 0 and until_sure:
            break
        if at.n_edges < 0:
            when = at.sample / scene.spec.sample_hz
            raise RuntimeError(f"the handle passed more than {loop.EDGE_CAPACITY} edges in a sample, at {when:g} s")
        tally.add(first, positions[: until - first], drives[: until - first])
        if progress:
            progress(until)
    return Hit(
        scene=scene,
        backend=backend,
        samples=at.sample,
        seconds=time.perf_counter() - began,
        mean_m=tally.mean_m,
        rms_m=math.inf if at.n_edges < 0 else tally.rms_m,
        touched=tally.farthest_m > 0 or tally.largest_drive > 0,
        max_force_n=tally.largest_drive * scene.spec.force_resolution_n,
        flags=scene.spec.design.flag_names(int(state.flags)),
        force_sha256=tally.force_sha256,
        overview=records[0] and record.trace_of(records[0], scene.spec),
        detail=records[1] and record.trace_of(records[1], scene.spec),
    )
