"""Hitting the wall: the founding paper's protocol on any scene and backend."""

import hashlib
import time
from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ..model import quadrature
from . import loop
from .controllers import Model, ModelState
from .encoder import Encoder, level, locate
from .plant import Coulomb, Handle, Motion, span
from .scene import Scene

BACKENDS = ("float", "fixed", "rtl")
CHUNK = 1 << 16
"""Samples between two looks at progress."""
OVERVIEW_POINTS = 6000
DETAIL_BEFORE_M = 0.3e-3
DETAIL_POINTS = 200_000
DETAIL_S = 0.12


@dataclass
class Trace:
    """What a run kept of its samples; arrays of one length.

    Attributes:
        time_s: time of each sample.
        position_m, velocity_m_per_s: of the handle, as they truly are.
        estimate_m_per_s: the estimator's output.
        force_n: of the wall on the handle, as it left the controller after the sample.
    """

    time_s: np.ndarray
    position_m: np.ndarray
    velocity_m_per_s: np.ndarray
    estimate_m_per_s: np.ndarray
    force_n: np.ndarray


@dataclass
class Hit:
    """Result of a run; `report` is its summary."""

    scene: Scene
    backend: str
    samples: int
    seconds: float
    mean_m: float
    rms_m: float
    max_force_n: float
    flags: list[str]
    force_sha256: str | None
    overview: Trace | None = None
    detail: Trace | None = None
    position_at_settle_m: float = field(default=0.0)

    @property
    def stable(self) -> bool:
        """Whether the RMS stays under the protocol's threshold."""
        return self.rms_m * 1e3 < self.scene.protocol.threshold_mm

    def report(self) -> dict:
        """Return the summary that the command line prints, units in the keys."""
        return {
            "scene": self.scene.name,
            "backend": self.backend,
            "estimator": self.scene.controller.estimator,
            "output": self.scene.output,
            "stiffness_n_per_m": self.scene.wall.stiffness_n_per_m,
            "damping_n_s_per_m": self.scene.wall.damping_n_s_per_m,
            "stable": self.stable,
            "rms_mm": self.rms_m * 1e3,
            "mean_mm": self.mean_m * 1e3,
            "samples": self.samples,
            "seconds": self.seconds,
            "samples_per_s": self.samples / self.seconds,
            "max_force_n": self.max_force_n,
            "flags": self.flags,
            "force_sha256": self.force_sha256,
        }


def world_of(scene: Scene) -> loop.World:
    """Return the loop's constants for a scene."""
    spec, latency = scene.spec, scene.spec.design.latency_to_drive
    handle = Handle(scene.handle.mass_kg, scene.handle.viscous_n_s_per_m)
    return loop.World(
        handle=handle,
        coulomb=Coulomb(scene.handle.coulomb_n) if scene.handle.coulomb_n else None,
        encoder=Encoder(spec.count_m, float(spec.clock_hz), scene.encoder.offsets),
        push_n=scene.protocol.push_n,
        force_lsb_n=spec.force_resolution_n,
        clocks_per_sample=spec.clocks_per_sample,
        latency=latency,
        before=span(handle, (spec.clocks_per_sample - latency) / spec.clock_hz),
        after=span(handle, latency / spec.clock_hz),
    )


def model_controller(scene: Scene, floating: bool, start_level: int) -> tuple[Model, ModelState]:
    """Return the `float` or `fixed` controller of a scene, and its state after reset with the pins at `start_level`."""
    spec, design, words = scene.spec, scene.spec.design, scene.words
    if floating:
        params = design.float_params(words, scene.wall.stiffness_n_per_m, scene.wall.damping_n_s_per_m)
    else:
        params = design.params(words)
    decoder = quadrature.Params(spec.count_width, spec.stamp_width, 8)
    controller = Model(decoder, words["encoder_glitch_clocks"], words["encoder_invert"], params)
    state = design.start(floating)
    velocity = 0.0 if floating else 0
    return controller, ModelState(state.output.drive, velocity, 0, quadrature.START, state, 0, start_level)


def _record(scene: Scene, floating: bool, trigger_m: float, stride: int, points: int) -> loop.Record:
    estimate = np.zeros(points, np.float64 if floating else np.int64)
    reals = (np.zeros(points) for _ in range(3))
    position, velocity, force = reals
    return loop.Record(trigger_m, stride, np.zeros(points, np.int64), position, velocity, estimate, force)


def _trace(scene: Scene, record: loop.Record, recorded: int, floating: bool) -> Trace:
    spec = scene.spec
    lsb = 1.0 if floating else spec.design.estimator.velocity.lsb
    return Trace(
        time_s=record.sample[:recorded] / spec.sample_hz,
        position_m=record.position_m[:recorded],
        velocity_m_per_s=record.velocity_m_per_s[:recorded],
        estimate_m_per_s=record.estimate[:recorded] * (lsb * spec.velocity_unit_m_per_s),
        force_n=record.force_n[:recorded],
    )


class _Tally:
    """Mean, RMS, largest force and force words of a run, chunk by chunk."""

    def __init__(self, scene: Scene, exact: bool):
        spec, protocol = scene.spec, scene.protocol
        self._settled = round(protocol.settle_s * spec.sample_hz)
        self._mean_from = self._settled - round(protocol.mean_s * spec.sample_hz)
        self._decimation = spec.samples_per_actuation
        self._digest = hashlib.sha256() if exact else None
        self._sum = self._squares = 0.0
        self._measured = 0
        self.largest_drive = 0

    @property
    def mean_m(self) -> float:
        return self._sum / (self._settled - self._mean_from)

    @property
    def rms_m(self) -> float:
        return (self._squares / self._measured) ** 0.5

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
        if self._digest:
            self._digest.update(drives[-first % self._decimation :: self._decimation].astype("<i4").tobytes())


def run(
    scene: Scene,
    backend: str,
    traces: bool = False,
    progress: Callable[[int], None] | None = None,
    waveform: Path | None = None,
) -> Hit:
    """Hit the wall of `scene` and return what came of it.

    Args:
        scene: from `scene.load`.
        backend: one of `BACKENDS`.
        traces: keep samples of the whole run and of the contact.
        progress: called with the number of samples done.
        waveform: for `rtl`, a VCD file to write from just before the contact on.

    Raises:
        RuntimeError: if the handle outran every decoder's limit by far, or the RTL could not be built.
    """
    floating = backend == "float"
    world, spec = world_of(scene), scene.spec
    start = Motion(scene.protocol.start_m, 0.0)
    cell = locate(world.encoder, start.position_m)
    start_level = int(level(cell.number))

    if backend == "rtl":
        from .rtl import Hardware  # noqa: PLC0415  (the other backends need neither Amaranth nor a compiler)

        opened = Hardware(spec, scene.words, start_level)
    else:
        opened = nullcontext(None)
    with opened as hardware:
        if hardware is not None:
            controller, state = hardware.controller, hardware.start
        else:
            controller, state = model_controller(scene, floating, start_level)
        at = loop.Progress(0, start, cell, scene.protocol.push_n, 0, 0, -1)
        return _run(scene, backend, world, controller, state, at, traces, progress)


def _run(scene, backend, world, controller, state, at, traces, progress) -> Hit:
    floating, total = backend == "float", scene.samples
    number = np.float64 if floating else np.int64
    delay = loop.Delay(np.zeros(scene.delay_samples, number)) if scene.delay_samples else None
    overview = detail = None
    if traces:
        overview = _record(scene, floating, -np.inf, max(1, total // OVERVIEW_POINTS), OVERVIEW_POINTS + 1)
    edges = np.zeros(loop.EDGE_CAPACITY, np.int64), np.zeros(loop.EDGE_CAPACITY, np.int64)
    positions, drives = np.zeros(CHUNK), np.zeros(CHUNK, number)
    tally = _Tally(scene, exact=not floating)
    # Compiling is not running: a call with nothing to do keeps it out of the time.
    loop.run(world, controller, state, at, delay, overview, edges, positions, drives, 0)
    began = time.perf_counter()
    while at.sample < total:
        first = at.sample
        until = min(first + CHUNK, total)
        state, at = loop.run(world, controller, state, at, delay, overview, edges, positions, drives, until)
        if at.n_edges < 0:
            raise RuntimeError(
                f"the handle passed more than {loop.EDGE_CAPACITY} edges in a sample, at {at.sample / scene.spec.sample_hz:g} s"
            )
        tally.add(first, positions[: until - first], drives[: until - first])
        if progress:
            progress(until)
    seconds = time.perf_counter() - began
    return Hit(
        scene,
        backend,
        total,
        seconds,
        tally.mean_m,
        tally.rms_m,
        tally.largest_drive * scene.spec.force_resolution_n,
        scene.spec.design.flag_names(int(state.flags)),
        tally.force_sha256,
        overview and _trace(scene, overview, at.recorded, floating),
    )
