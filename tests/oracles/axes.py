"""Axes in a rota, clock for clock, from what their host and their encoders did at every clock."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from hardwall.model import stamped
from hardwall.model.axes import clocked as clocked_axes
from hardwall.model.axes.axis import FRONT_LATENCY, AxesSpec
from hardwall.model.axes.clocked import Outputs, Samples
from hardwall.model.axis import clocked
from hardwall.model.axis.design import ENCODER_FLAGS
from hardwall.testing.packing import Packing

RECORD = "count", "velocity", "wall_force", "drive", "flags"
"""The words of the record of a sample, and of `Samples`."""


class Write(NamedTuple):
    """The host's writing of a word."""

    clock: int
    axis: int
    name: str
    word: int


class Lane(NamedTuple):
    """What one of the axes shows at every clock, what its samples become, and how many of them have ended."""

    outputs: Outputs
    commit_pending: np.ndarray
    samples: Samples
    ended: int
    committed: int


def _settings(spec: AxesSpec, axis: int, commits: np.ndarray, writes: list[Write]) -> Iterator[tuple[int, dict]]:
    """Yield the strobes of an axis at which its words take effect, and the words."""
    period, clocks = spec.clocks_per_sample, len(commits)
    shadow = {word.name: word.reset for word in spec.design.words}
    # What is written in the first rota is lost.
    left = [write for write in writes if write.axis == axis and write.clock >= period]
    for strobe in range(axis, clocks, period):
        while left and left[0].clock < strobe:
            shadow[left[0].name] = left[0].word
            left.pop(0)
        if commits[max(strobe - period, 0) : strobe].any():
            yield strobe, dict(shadow)


def _pending(period: int, axis: int, commits: np.ndarray) -> np.ndarray:
    """Return whether words wait, at every clock."""
    shown, pending = np.zeros(len(commits), np.int64), 0
    for clock, commit in enumerate(commits):
        shown[clock] = pending
        pending = commit | (pending & (clock % period != axis))
    return shown


def lane(spec: AxesSpec, axis: int, pins: clocked.Pins, commits: np.ndarray, writes: list[Write]) -> Lane:
    """Return all of one axis from reset, by the model.

    Args:
        spec: the axes.
        axis: the number of the axis.
        pins: its pins at every clock, from clock 0 on.
        commits: whether its `commit` was high, at every clock.
        writes: what the host wrote, in the order of the clocks.
    """
    design, clocks, timing = spec.design, len(commits), spec.timing(axis)
    samples = Samples(*np.zeros((len(Samples._fields), clocks // spec.clocks_per_sample + 1), np.int64))
    outputs = Outputs(*np.zeros((len(Outputs._fields), clocks), np.int64))
    words = {word.name: word.reset for word in design.words}
    state, clock, committed = clocked_axes.start(design), 0, 0

    def run_to(until: int, settings: dict[str, int], gains: dict[str, int]) -> None:
        nonlocal state, clock
        encoder = settings["encoder_glitch_clocks"], settings["encoder_invert"]
        controller = stamped.Controller(design.decoder, *encoder, design.params(gains))
        state = clocked_axes.run(controller, timing, state, pins, samples, outputs, clock, until)
        clock = until

    for strobe, new in _settings(spec, axis, commits, writes):
        run_to(strobe, words, words)
        # The strobe's sample uses the new words; the decoder uses them from the next clock on.
        run_to(strobe + 1, words, new)
        words, committed = new, committed + 1
    run_to(clocks, words, words)
    pending = _pending(spec.clocks_per_sample, axis, commits)
    return Lane(outputs, pending, samples, int(outputs.sampled.sum()), committed)


def lanes_of(spec: AxesSpec, given: list[dict[str, int]], writes: list[Write]) -> list[Lane]:
    """Return all of every axis from reset, by the model.

    Args:
        spec: the axes.
        given: the inputs of the axes at every clock.
        writes: what the host wrote, in the order of the clocks.
    """

    def bits(name: str, number: int) -> np.ndarray:
        return np.array([each[name] >> number & 1 for each in given], np.int64)

    preload_count = np.array([each["preload_count"] for each in given], np.int64)
    bit = [name for name in clocked.Pins._fields if name != "preload_count"]
    every = []
    for number in range(spec.axes):
        pins = clocked.Pins(**{name: bits(name, number) for name in bit}, preload_count=preload_count)
        every.append(lane(spec, number, pins, bits("commit", number), writes))
    return every


class Seen:
    """The outputs of the hardware at every clock, from its packed words.

    Args:
        packing: how its outputs lie in a word.
        spec: the axes.

    Attributes:
        words: the packed words, by clock.
    """

    def __init__(self, packing: Packing, spec: AxesSpec):
        self.packing, self.spec = packing, spec
        self.words: list[int] = []
        design = spec.design
        self.shapes = {
            "drive": (spec.force.width, 1),
            "flags": (len(design.flags), 0),
            "illegal_count": (8, 0),
            "edge_kind": (2, 0),
        }
        self.shapes |= dict.fromkeys(("count", "index_count"), (spec.count_width, 1))

    def port(self, name: str) -> list[int]:
        """Return a port at every clock."""
        return self.packing.column(name, self.words)

    def lanes(self, name: str) -> np.ndarray:
        """Return a port that every axis has a part of, by axis and clock."""
        width, signed = self.shapes.get(name, (1, 0))
        sign = 1 << width >> 1 if signed else 0
        column, mask = self.port(name), (1 << width) - 1
        rows = [[(word >> width * number & mask ^ sign) - sign for word in column] for number in range(self.spec.axes)]
        return np.array(rows, np.int64)


def check(spec: AxesSpec, lanes: list[Lane], seen: Seen) -> None:
    """Check all that the axes show."""
    _check_clocks(spec, lanes, seen)
    _check_estimates(spec, lanes, seen)
    _check_records(spec, lanes, seen)


def _check_clocks(spec: AxesSpec, lanes: list[Lane], seen: Seen) -> None:
    """Check every output of every axis at every clock, but for those that do not leave a block around the axes."""
    for name in ({*Outputs._fields, "commit_pending"} - {"stamp"}) & set(seen.packing.shapes):
        found = seen.lanes(name)
        for number, each in enumerate(lanes):
            wanted = each.commit_pending if name == "commit_pending" else getattr(each.outputs, name)
            wrong = np.flatnonzero(found[number] != wanted)
            assert not len(wrong), f"{name} of axis {number}: {len(wrong)} clocks differ, first clock {wrong[:1]}"
    assert seen.port("stamp") == lanes[0].outputs.stamp.tolist()
    ready = seen.port("word_ready")
    assert ready == [int(clock >= spec.clocks_per_sample) for clock in range(len(ready))]


def _check_estimates(spec: AxesSpec, lanes: list[Lane], seen: Seen) -> None:
    """Check the velocity of every sample, its clock, its count, and whether the estimator was saturated."""
    velocity, saturated = np.array(seen.port("velocity")), np.array(seen.port("saturated"))
    count = np.array(seen.port("estimated_count"))
    for number, estimated in enumerate(seen.lanes("estimated")):
        came = np.flatnonzero(estimated)
        first = number + FRONT_LATENCY + spec.pipeline.latency
        assert came.tolist() == list(range(first, len(velocity), spec.clocks_per_sample))
        samples = lanes[number].samples
        assert (velocity[came] == samples.velocity[: len(came)]).all()
        assert (count[came] == samples.count[: len(came)]).all()
        assert (saturated[came] == (samples.raised[: len(came)] >> len(ENCODER_FLAGS) != 0)).all()


def _check_records(spec: AxesSpec, lanes: list[Lane], seen: Seen) -> None:
    """Check the records of all samples, and that none is missing."""
    came = np.flatnonzero(seen.port("record_valid")).tolist()
    ended = [0] * spec.axes
    columns = {name: seen.port(f"record_{name}") for name in ("axis", *RECORD)}
    for clock in came:
        number = columns["axis"][clock]
        k, samples = ended[number], lanes[number].samples
        assert clock == number + k * spec.clocks_per_sample + spec.latency + 1
        record = {name: columns[name][clock] for name in RECORD}
        assert record == {name: int(getattr(samples, name)[k]) for name in RECORD}, f"sample {k} of axis {number}"
        ended[number] += 1
    clocks, first = len(seen.words), spec.latency + 1
    assert ended == [len(range(number + first, clocks, spec.clocks_per_sample)) for number in range(spec.axes)]
    assert min(ended) > clocks // spec.clocks_per_sample // 2
