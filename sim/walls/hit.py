"""Hits of the wall, on any scene and backend: see `tally` for what is said of the wall."""

import json
import math
import threading
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ...model import stamped
from ...model.runtime.result import Summary, Table, Values
from ...model.runtime.stages import stage
from ...model.runtime.whole_file import whole_file
from ..loop import loop, record
from ..loop.backends import Opened, is_exact, number_of, opened
from ..loop.coupled import coupled
from ..loop.values import EDGE_CAPACITY, Memory
from ..scene.build import output_step_n, start_of, sweep_of, tool_of, work_of, world_of
from ..scene.schema import Scene
from ..world.encoder import level
from ..world.lines import waiting
from . import repetition
from .hit_rows import NEVER
from .hit_statistics import STABLE, UNDECIDED, UNSTABLE, Tally

VERDICTS = STABLE, UNSTABLE, UNDECIDED
CHUNK = 1 << 16
"""Most samples in one call of the loop, which keeps them all; fewer if a sample takes long."""
LOOKS = 100
"""Number of progress reports in a run."""
LOOK_S = 0.25
"""Time between two checks whether the verdict is sure; a call of the loop costs as much as some 10^4 samples."""
RESTS = 0.25, 0.5, 1.0
"""The parts of the settling time after which the loop is looked at, whether it rests for ever."""
OVERVIEW_POINTS = 6000
DETAIL_FROM_M = -0.2e-3
DETAIL_S = 0.1
WAVEFORM_CLOCKS = 60_000
"""Length of a waveform; a fifth of it is before the contact."""

Marks = Iterable[tuple[int, Callable[[], None]]]
"""Actions, each with the number of the sample at which to do it."""


@dataclass
class Hit(Summary):
    """Result of a run; `report` is its summary.

    Attributes:
        seconds: wall time of the loop, without compiling and building.
        mean_m: mean position of the window that was judged, or in the literal protocol before the settling mark, m;
            positive is inside the wall.
        rms_m: RMS distance that the verdict is of, m.
        offset_m, drift_m_per_s: the distance from the mean before the settling mark to the mean of the judged window,
            and the slope of the position over this window.
        judged: `stable`, `unstable` or `undecided`, as if the wall was touched: see `tally`.
        touched: whether the handle ever was within the wall, or felt it.
        force_sha256: digest of the drive words of every actuation, little-endian int32; None for `float`.
        overview, detail: if asked for, samples of the whole run, and every sample from shortly before the first
            contact, `DETAIL_S` long.
    """

    scene: Scene
    backend: str
    samples: int
    seconds: float
    mean_m: float
    rms_m: float
    offset_m: float
    drift_m_per_s: float
    judged: str
    touched: bool
    max_force_n: float
    flags: list[str]
    force_sha256: str | None
    overview: record.Overview | None = None
    detail: record.Trace | None = None

    @property
    def verdict(self) -> str:
        """The verdict: `stable`, `unstable` or `undecided`. A wall that was never touched is not stable."""
        return self.judged if self.touched else UNSTABLE

    @property
    def stable(self) -> bool:
        """Whether the handle touched the wall and stays there, within the protocol's threshold."""
        return self.verdict == STABLE

    @property
    def in_place(self) -> bool:
        """Whether the handle rests where the wall's spring alone would hold it.

        At rest the velocity is 0, and the spring carries the push and the hand. The remainder is at most the sticking
        friction, a step of the output and the position hidden in a count. A stable wall may be felt elsewhere: where
        the estimate is not 0 at rest, its damper carries a part. In the literal protocol, the mean after the settling
        mark is not farther from the mean before it than the RMS.
        """
        scene, stiffness = self.scene, self.scene.felt_n_per_m
        hand, cable = scene.hand, scene.transmission
        held = hand and hand.parts
        pull_n = held["stiffness_n_per_m"] * (held["rest_m"] - self.mean_m) if held else 0.0
        carried_n = scene.protocol.push_n + pull_n
        slack_n = scene.sticking_n + output_step_n(scene)
        hidden_m = scene.encoder.count_m + self.rms_m
        if cable and cable.encoder_at == "motor":
            hidden_m += (abs(carried_n) + slack_n) / cable.stiffness_n_per_m
        slack_n += stiffness * hidden_m
        if scene.coupling is not None:
            # The surface is at a whole count.
            slack_n += scene.coupling.stiffness_n_per_m * scene.encoder.count_m / 2
        return abs(stiffness * self.mean_m - carried_n) <= slack_n

    @property
    def contact(self) -> slice | None:
        """The samples of `detail` in the first contact: from the first one inside the wall until the handle leaves it.

        A contact that lasts longer than `detail` ends with it. None without traces or a contact.
        """
        if self.detail is None:
            return None
        inside = self.detail.position_m > 0
        if not inside.any():
            return None
        entered = int(np.argmax(inside))
        outside = np.flatnonzero(~inside[entered:])
        return slice(entered, entered + int(outside[0]) if len(outside) else len(inside))

    @property
    def contact_s(self) -> float:
        """Time of the first sample in `detail` inside the wall; if there is none, time of the run's end."""
        contact = self.contact
        return float(self.detail.time_s[contact.start]) if contact else self.samples / self.scene.spec.sample_hz

    @property
    def estimate_rms_m_per_s(self) -> float | None:
        """RMS error of the velocity estimate over the first contact; None without traces or a contact."""
        contact = self.contact
        if contact is None:
            return None
        error = self.detail.estimate_m_per_s[contact] - self.detail.velocity_m_per_s[contact]
        return float(np.sqrt(np.mean(error**2)))

    def save(self, path: Path) -> None:
        """Write the traces as an .npz: `overview_time_s`, `detail_force_n` and so on, and the report as JSON text.

        Raises:
            OSError: if the file cannot be written.
        """
        with whole_file(path) as part, part.open("wb") as file:
            np.savez_compressed(file, report=json.dumps(self.report()), **self.arrays())

    def arrays(self) -> dict[str, np.ndarray]:
        """Return the arrays of the traces, by `overview_` or `detail_` and their name."""
        kept = {"overview": self.overview, "detail": self.detail}
        return {f"{name}_{key}": array for name, trace in kept.items() for key, array in vars(trace).items()}

    def tables(self) -> list[Table]:
        """Return the report as a table; a wall that was never touched has no verdict there, and no RMS."""
        said = self.report() | ({} if self.touched else {"verdict": NEVER, "rms_mm": None})
        return Values(said).tables()

    def notes(self) -> list[str]:
        """Return what keeps the verdict, and the velocity's error, from being known."""
        notes = []
        if self.judged == UNDECIDED:
            notes.append("undecided: it still fell, or had swung too seldom to tell: try a longer protocol.longest_s")
        if self.detail is None:
            notes.append("estimate_rms_mm_per_s: known with --plot or --trace, which keep every sample")
        return notes

    def report(self) -> dict:
        """Return the summary that the command line prints, with units in the keys."""
        error = self.estimate_rms_m_per_s
        return {
            "scene": self.scene.name,
            "backend": self.backend,
            "estimator": self.scene.controller.estimator,
            "output": self.scene.estimator_output,
            "stiffness_n_per_m": self.scene.wall.stiffness_n_per_m,
            "damping_n_s_per_m": self.scene.wall.damping_n_s_per_m,
            "stable": self.stable,
            "verdict": self.verdict,
            "touched": self.touched,
            "rms_mm": self.rms_m * 1e3,
            "mean_mm": self.mean_m * 1e3,
            "offset_mm": self.offset_m * 1e3,
            "drift_mm_per_s": self.drift_m_per_s * 1e3,
            "samples": self.samples,
            "seconds": self.seconds,
            "samples_per_s": self.samples / self.seconds,
            "max_force_n": self.max_force_n,
            "estimate_rms_mm_per_s": error and error * 1e3,
            "flags": self.flags,
            "force_sha256": self.force_sha256,
        }


_compiled: set[Any] = set()
"""The results of `_kinds` for the arguments of the loops compiled in this process."""
_compiling = threading.Lock()
"""Held by the compiling thread: the others may need the same loop, and wait in silence."""


def _kinds(value: Any) -> Any:
    """Return what the compiler sees of a value: the types of all its parts."""
    if isinstance(value, tuple):
        return type(value), *map(_kinds, value)
    return (value.dtype, value.ndim) if isinstance(value, np.ndarray) else type(value)


class Loop:
    """The closed loop of a scene on a backend: its progress, the arrays that it writes to, and its tally."""

    def __init__(self, scene: Scene, backend: str, traces: bool, until_sure: bool):
        self.scene, self.backend, self.until_sure = scene, backend, until_sure
        self.world = world_of(scene)
        self.at = start_of(scene, self.world)
        self.start_level = int(level(self.at.moment.cell.number))
        self.tally = Tally(scene, is_exact(backend))
        number, spec = number_of(backend), scene.spec
        self.chunk = max(1, CHUNK // work_of(self.world))
        self.literal = scene.protocol.verdict == "literal"
        self.look = max(round(LOOK_S * spec.sample_hz), 1) if until_sure else scene.samples
        overview = detail = None
        if traces:
            overview = record.overview(spec, number, scene.samples, OVERVIEW_POINTS)
            detail = record.detail(spec, number, DETAIL_FROM_M, round(DETAIL_S * spec.sample_hz))
        edges = stamped.room_for(EDGE_CAPACITY)
        self.memory = Memory(
            edges=edges,
            delay=np.zeros(scene.delay_samples, number) if scene.delay_samples else None,
            overview=overview,
            detail=detail,
            positions=np.zeros(self.chunk),
            drives=np.zeros(self.chunk, number),
            waiting=waiting(self.world.encoder.lines, self.start_level, edges),
        )

    def run(self, axis: Opened, marks: Marks, progress: Callable[[int], None] | None) -> Hit:
        """Run the loop in chunks that end at the `marks`, and return the result.

        Raises:
            RuntimeError: if the handle outran every decoder's limit by far.
        """
        controller, state, _ = axis
        self.world = self.world._replace(sweep=sweep_of(self.scene, self.world, controller))
        actions = dict(marks)
        self._compile(controller, state)
        began = time.perf_counter()
        looks = self._looks(state)
        before = None
        while self.tally.verdict is None and not (self.until_sure and self.tally.sure_unstable):
            first = self.at.sample
            if first in actions:
                actions.pop(first)()
            if first in looks:
                before = self._rests(state, before)
                if self.tally.verdict is not None:
                    break
            stops = [sample for sample in (*actions, *looks) if sample > first]
            until = min(first + self.chunk, self._next_look(first), *stops)
            state = self._chunk(controller, state, until, progress)
            if self.lost_edges:
                break
            self.tally.add(first, self.memory.positions[: until - first], self.memory.drives[: until - first])
        return self.result(time.perf_counter() - began, int(state.flags))

    def _looks(self, state) -> frozenset[int]:
        """Return the numbers of the samples before which the loop is looked at, whether it rests: each second one is a
        period behind the one before."""
        period = repetition.period_of(self.scene, self.world, state) if self.until_sure and not self.literal else None
        if period is None:
            return frozenset()
        firsts = [round(part * self.scene.settled) for part in RESTS]
        if min(np.diff([*firsts, self.scene.samples])) <= period:
            return frozenset()
        return frozenset(sample for first in firsts for sample in (first, first + period))

    def _rests(self, state, before: tuple[int, Any] | None) -> tuple[int, Any]:
        """Judge a resting handle if the loop's state equals the last look's; return this look."""
        now = repetition.seen(state, self.at, self.memory, self.scene.spec.clocks_per_sample)
        if before and before[1] == now and self.tally.still_from < before[0]:
            self.tally.rest()
        return self.at.sample, now

    def _compile(self, controller, state) -> None:
        """Compile the loop by a call without samples, so that compiling is not in the measured time."""
        arguments = self.world, controller, state, self.at, self.memory
        kinds = _kinds(arguments)
        with _compiling:
            if kinds not in _compiled:
                with stage("compiling the loop, once"):
                    loop.run(*arguments, 0)
                _compiled.add(kinds)

    def _next_look(self, sample: int) -> int:
        """Return the end of a chunk that begins at a sample, as far as a verdict may be there."""
        if self.literal:
            return min(max(self.scene.settled, sample) + self.look, self.scene.samples)
        return self.tally.window_end

    def _chunk(self, controller, state, until: int, progress: Callable[[int], None] | None):
        """Run to the end of a chunk, in pieces if progress is reported; return the controller's state."""
        first, memory = self.at.sample, self.memory
        piece = max(1, self.scene.samples // LOOKS) if progress else self.chunk
        while self.at.sample < until and not self.lost_edges:
            done = self.at.sample - first
            rest = memory._replace(positions=memory.positions[done:], drives=memory.drives[done:])
            end = min(self.at.sample + piece, until)
            state, self.at = loop.run(self.world, controller, state, self.at, rest, end)
            if progress:
                progress(min(self.at.sample, self.scene.samples))
        return state

    @property
    def lost_edges(self) -> bool:
        """Whether the handle outran the encoder by far; an error unless the run is only `until_sure`."""
        lost = self.at.moment.n_edges < 0
        if lost and not self.until_sure:
            when = self.at.sample / self.scene.spec.sample_hz
            raise RuntimeError(f"the handle passed more than {EDGE_CAPACITY} edges in a sample, at {when:g} s")
        return lost

    def result(self, seconds: float, flags: int) -> Hit:
        """Return the hit, of the samples that the tally has."""
        scene, tally, memory = self.scene, self.tally, self.memory
        return Hit(
            scene=scene,
            backend=self.backend,
            samples=self.at.sample,
            seconds=seconds,
            mean_m=tally.mean_m,
            rms_m=math.inf if self.lost_edges else tally.rms_m,
            offset_m=tally.offset_m,
            drift_m_per_s=tally.drift_m_per_s,
            judged=UNSTABLE if self.lost_edges or tally.verdict is None else tally.verdict,
            # A tool is felt in free motion, too.
            touched=tally.farthest_m > 0 or (tally.largest_drive > 0 and scene.coupling is None),
            max_force_n=tally.largest_drive * scene.spec.force_resolution_n,
            flags=scene.spec.design.flag_names(flags),
            force_sha256=tally.force_sha256,
            overview=memory.overview and record.trace_of(memory.overview, scene.spec),
            detail=memory.detail and record.trace_of(memory.detail, scene.spec),
        )


def run(
    scene: Scene,
    backend: str,
    traces: bool = False,
    progress: Callable[[int], None] | None = None,
    vcd: Path | None = None,
    until_sure: bool = False,
) -> Hit:
    """Hit the wall of `scene` and return the result.

    Args:
        scene: a scene from `scene.load`.
        backend: one of `backends.BACKENDS`.
        traces: keep samples of the whole run and of the contact.
        progress: called with the number of samples done.
        vcd: for `rtl`, a VCD file to write, with every signal around the contact.
        until_sure: end a run whose handle rests for ever, or outruns the encoder by far; in the literal protocol also a
            run that is certainly unstable. `rms_m` is then 0, infinite, or the RMS up to that point.

    Raises:
        RuntimeError: if the handle outran every decoder's limit by far, or the RTL could not be built.
    """
    closed = Loop(scene, backend, traces, until_sure)
    with opened(scene.spec, backend, scene.parameters, closed.start_level, traced=vcd is not None) as axis:
        driven = axis if scene.coupling is None else coupled(axis, tool_of(scene, backend))
        # The contact is known before the hardware runs, because the bit-accurate model has it at the same sample.
        result = closed.run(driven, _waveform_marks(scene, axis.hardware, vcd) if vcd else (), progress)
        if vcd:
            axis.hardware.end_trace()
    return result


def _waveform_marks(scene: Scene, hardware, vcd: Path) -> Marks:
    """Return the marks that begin and end a waveform around the contact."""
    length = max(1, WAVEFORM_CLOCKS // scene.spec.clocks_per_sample)
    contact = round(run(scene, "fixed", traces=True).contact_s * scene.spec.sample_hz)
    first = max(contact - length // 5, 0)
    return [(first, lambda: hardware.trace(vcd)), (first + length, hardware.end_trace)]
