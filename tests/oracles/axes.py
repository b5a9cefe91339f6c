"""Axes in a rota, clock for clock, from what their host and their encoders did at every clock."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from hardwall.model import clocked, clocked_axes, stamped
from hardwall.model.axes import AxesSpec
from hardwall.model.clocked_axes import Outputs, Samples


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
