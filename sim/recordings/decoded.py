"""A capture of an encoder's pins as a recording: its edges by the decoder of the model, and the counts at any rate.

A tick of the capture is a clock of the decoder, which has no glitch filter: it counts every edge that is in the file.
The count of sample k is that at time k / rate after the first tick, an edge at that very time included.
"""

import numpy as np

from ...model import stamped
from ...model.encoder import quadrature
from ...model.runtime.compiled import compiled
from .capture import Capture, Changes
from .error import RecordingError, plain
from .recording import SAMPLES_MAX, EdgeRecord, Recording

WIDTHS = quadrature.Params(count_width=62, stamp_width=62, fault_width=16)
LEAD = 16
"""The clocks before the first tick, in which the decoder's synchronisers are filled."""
Z_SHOWN = 4


def recording_of(capture: Capture, file: str, channels: tuple[str, ...], rate_hz: float | None) -> Recording:
    """Return the recording of a capture.

    Args:
        capture: the capture.
        file: its path.
        channels: names or numbers of its channels A, B and Z; empty to find them.
        rate_hz: the rate at which an estimator is to take samples.

    Raises:
        RecordingError: if there is no rate, a channel is not there, or A and B change at once.
    """
    places = capture.places(channels)
    names = [capture.channels[place] for place in places]
    if rate_hz is None:
        raise RecordingError(
            f"{capture.name}: is a capture of edges, so the sample rate of the estimator must be given (--rate)"
        )
    if len(set(places)) < len(places):
        raise RecordingError(f"{capture.name}: A, B and Z must be different channels, not {', '.join(names)}")
    changes = capture.changes(places)
    edges = edges_of(capture.name, changes)
    samples = int(changes.end / changes.tick_hz * rate_hz * (1 + 1e-12)) + 1
    if not 2 <= samples <= SAMPLES_MAX:
        raise RecordingError(
            f"{capture.name}: must give 2 to {SAMPLES_MAX} samples at {rate_hz:g} Hz, not {samples}: correct the rate"
        )
    said = "".join(f", {letter} {plain(name)}" for letter, name in zip("ABZ", names, strict=False))
    notes = [
        f"{capture.form}{said}",
        f"{len(edges.ticks)} edges in {changes.end / changes.tick_hz:g} s, ticks of {1e9 / changes.tick_hz:g} ns",
        *_index(changes, edges, len(places) > 2),
    ]
    column = ",".join(names)
    return Recording(file, column, counts_at(edges, rate_hz, samples), rate_hz, changes.start_s, edges, tuple(notes))


def counts_at(edges: EdgeRecord, rate_hz: float, samples: int) -> np.ndarray:
    """Return the counts of so many samples at a rate, int64."""
    before = np.searchsorted(edges.ticks / edges.tick_hz * rate_hz, np.arange(samples) * (1 + 1e-15), side="right")
    return np.concatenate([[edges.start], edges.counts])[before]


def edges_of(name: str, changes: Changes) -> EdgeRecord:
    """Return the edges of A and B, counted from 0.

    Raises:
        RecordingError: if both change at once, or the times do not increase.
    """
    pins = np.concatenate([[changes.start], changes.levels]) & 3
    moved = np.diff(pins) != 0
    ticks, pins = changes.ticks[moved], np.concatenate([pins[:1], pins[1:][moved]])
    if (np.diff(changes.ticks, prepend=-1) <= 0).any():
        place = int(np.argmax(np.diff(changes.ticks, prepend=-1) <= 0))
        raise RecordingError(
            f"{name}: times must increase from one change of levels to the next, not go to "
            f"{changes.ticks[place] / changes.tick_hz:g} s after the first sample at change {place + 1}"
        )
    both = np.flatnonzero((pins[1:] ^ pins[:-1]) == 3)
    if len(both):
        raise RecordingError(
            f"{name}: A and B must not change at once, as at {ticks[both[0]] / changes.tick_hz:g} s after the first "
            f"sample ({len(both)} times of {len(ticks)}): capture faster, or correct the channels (--channels)"
        )
    counts = np.zeros(len(ticks), np.int64)
    edges = stamped.Edges(ticks + LEAD, pins[1:].astype(np.int64))
    controller = stamped.Controller(WIDTHS, 0, 0, 0)  # the axis is not used
    _decode(controller, stamped.State(0.0, 0.0, 0.0, 0, quadrature.START, 0, 0, int(pins[0])), edges, counts)
    return EdgeRecord(changes.tick_hz, ticks, counts, 0)


@compiled
def _decode(controller, state, edges, counts):
    """Fill `counts` with the count after every edge."""
    taken = 0
    for edge in range(len(counts)):
        until = edges.clocks[edge] + quadrature.LATENCY
        rest = stamped.Edges(edges.clocks[taken:], edges.levels[taken:])
        state, some = stamped.decode(controller, state, rest, len(rest.clocks), until)
        taken += some
        counts[edge] = state.decoder.count


def _index(changes: Changes, edges: EdgeRecord, has_z: bool) -> list[str]:
    """Return what Z tells: the counts at which it rises."""
    if not has_z:
        return []
    high = np.concatenate([[changes.start], changes.levels]) >> 2 & 1
    rises = changes.ticks[np.flatnonzero(np.diff(high) == 1)]
    counts = np.concatenate([[edges.start], edges.counts])[np.searchsorted(edges.ticks, rises, side="right")]
    shown = ", ".join(map(str, counts[:Z_SHOWN].tolist())) + (", ..." if len(counts) > Z_SHOWN else "")
    return [f"Z rises {len(counts)} times" + (f", at counts {shown}" if len(counts) else "")]
