"""The velocities of two estimators from the same counts, at every sample: bit-accurate models beside the board."""

import threading
from collections import deque
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ...model.axis import axis as model
from ...model.estimators.acceleration import room_of
from ...model.spec import AxisSpec

PLAIN = "fdm"
"""The estimator beside the board's own: the difference of two counts, as the founding paper calls it."""
KEPT = 256
"""Records that are kept for tabs."""


class _Lane:
    """An axis that continues from record to record; its words may change in between."""

    def __init__(self, spec: AxisSpec):
        self.spec = spec
        self._params = model.Axis(spec).params
        self.start()
        self._names = {word.name for word in spec.design.words}

    def start(self) -> None:
        """Start afresh, from the next count."""
        self._state = self.spec.design.start(False)

    def set(self, values: Mapping[str, float]) -> None:
        words = {name: values[name] for name in self._names & values.keys()}
        self._params = model.Axis(self.spec, False, **words).params

    def run(self, counts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the velocities (m/s) and the wall's forces (N) of successive counts."""
        made = room_of(self.spec.design.estimator, counts.shape, np.int64)
        words = [np.zeros(len(counts), np.int64) for _ in range(3)]
        # A fault of the encoder changes neither velocity nor force; the board's drive is not looked at here.
        faults = np.zeros(len(counts), np.int64)
        self._state = model.run(self._params, self._state, counts, faults, made, *words)
        record = model.Record(self.spec.design, made.velocity, *words)
        return record.velocity_m_per_s, record.force_n


class Estimates:
    """The board's estimator and the plain difference, side by side, fed with the same counts.

    Args:
        spec: the axis, whose estimator needs counts only.

    Attributes:
        names: the estimators, the board's first.
        sample_hz: samples of the axis in a second of the board.

    Raises:
        ValueError: if the estimator needs the stamps of edges, too.
    """

    def __init__(self, spec: AxisSpec):
        if spec.design.estimator.uses_stamps():
            raise ValueError(f"estimator must be one that needs only counts, not {spec.estimator!r}")
        self.names, self.sample_hz = (spec.estimator, PLAIN), spec.sample_hz
        self._lanes = [_Lane(spec), _Lane(replace(spec, estimator=PLAIN, gains=None))]
        self._used: tuple[Mapping[str, float], float] | None = None
        self._count_m, self._moved_m = spec.count_m, 0.0
        self._records: deque[bytes] = deque(maxlen=KEPT)
        self._taken, self._lock = 0, threading.Lock()
        # The first call compiles; no tab would wait so long.
        for lane in self._lanes:
            lane.run(np.zeros(1, np.int64))

    def use(self, values: Mapping[str, float], moved_m: float = 0.0) -> None:
        """Take the words that the board uses, in SI units, and how far its positions have moved, from now on."""
        self._used = values, moved_m

    def feed(self, counts: list[int]) -> None:
        """Take the next counts, which wrap as the hardware's do."""
        used, self._used = self._used, None
        if used is not None:
            values, moved_m = used
            for lane in self._lanes:
                lane.set(values)
                if moved_m != self._moved_m:
                    lane.start()
            self._moved_m = moved_m
        taken = np.array(counts, np.int64) + round(self._moved_m / self._count_m)
        both = [lane.run(taken) for lane in self._lanes]
        rows = np.concatenate([both[lane][kind] for kind in (0, 1) for lane in (0, 1)])
        with self._lock:
            self._taken += 1
            self._records.append(rows.astype("<f4").tobytes())

    def since(self, number: int) -> tuple[int, list[bytes]]:
        """Return the number of the next record, and the kept records from `number` on.

        A record is four successive rows of float32, of one length: the velocities (m/s) of both estimators, then the
        forces (N).
        """
        with self._lock:
            new = min(self._taken - number, len(self._records))
            return self._taken, [self._records[-place] for place in range(new, 0, -1)]
