"""The Kalman filter of edges with a map of the scale: RTL against model, and model against counts that are moved."""

import cocotb
import numpy as np
import pytest
from cocotb.triggers import RisingEdge

from hardwall.hdl.estimators.edge_kalman import Estimator
from hardwall.model.encoder import scale_map
from hardwall.model.estimators import edge_kalman
from hardwall.model.estimators.edge_kalman_design import START
from hardwall.testing import CAMPAIGN, SAMPLES, Bench, check, parameters, simulate
from hardwall.testing.estimators import model, momentary, names, outputs
from stimuli.decoder_outputs import Scale
from stimuli.lengths import some_of
from stimuli.seeded import seeded
from stimuli.specs import spec

BIN_BITS = 2


class Mapped(edge_kalman.Design):
    """The design of an axis with a map that has errors."""

    def __init__(self, name: str, errors_counts=None):
        axis = spec(name, "edge-kalman")
        reach = min(96, 1 << (axis.count_width - 2))
        scale = scale_map.Design(axis.count_width, -reach, BIN_BITS, 2 * reach >> BIN_BITS, 2.0)
        super().__init__(axis, axis.design.gains, scale)
        self.errors = np.zeros(scale.bins) if errors_counts is None else errors_counts

    def params(self, words):
        return super().params(words)._replace(scale=self.scale.params(self.errors))


def drawn(bins: int) -> np.ndarray:
    """Return the errors of all bins, to the ends of their format."""
    random = seeded()
    return np.array([random.choice([-2.0, 2.0, 0.0, random.uniform(-1, 1)]) for _ in range(bins)])


def make(name: str) -> Estimator:
    return Estimator(Mapped(name, drawn(Mapped(name).scale.bins)))


def rows(d: edge_kalman.Design, samples: int):
    """Yield rows: runs of edges to and fro, over the bins and beyond their ends, at many speeds; rests and restarts."""
    random = seeded()
    scale = Scale(d, now=(1 << d.stamp_width) - 3 * d.clocks)
    furthest = min(400, (1 << (d.count_width - 1)) - 8)
    while samples > 0:
        up = scale.count < 0 if abs(scale.count) > furthest else random.random() < 0.5
        slow, fast = random.choice([(1, 1), (3, 1), (20, 1), (1, 4)])
        for k in range(random.randrange(5, 80)):
            scale.now += d.clocks
            for edge in range(fast if k % slow == 0 else 0):
                scale.pass_edge(up, scale.now - 1 - int(random.random() * d.clocks / (edge + 1)))
            row = scale.row()
            yield *row, int(random.random() < 0.01)
            samples -= 1


@cocotb.test(**CAMPAIGN)
async def follows_model(dut):
    component = make(**parameters())
    d, bench = component.design, Bench(dut, component)
    await bench.reset()
    for at, word in enumerate(d.scale.words(d.errors).tolist()):
        bench.drive(map_write=1, map_bin=at, map_written=word)
        await RisingEdge(dut.clk)
    bench.drive(map_write=0, map_enabled=1)
    inputs, seen = await bench.campaign(
        "strobe",
        "valid",
        names(d),
        (*outputs(d), "map_outside"),
        rows(d, SAMPLES // 4),
        momentary=momentary(d),
    )
    expected = model(d, inputs.rows, START)
    half = 1 << (d.count_width - 1)
    counts = (inputs.column("seen__count") + inputs.column("seen__down") + half) % (2 * half) - half
    params = d.scale.params(d.errors)
    expected["map_outside"] = np.array([scale_map.place_of(params, count).outside for count in counts.tolist()])
    check(inputs, seen, expected, component.latency)
    assert set(expected["map_outside"]) == {0, 1}
    # The map matters, and without its gate it does not.
    assert np.any(expected["velocity"] != model(Mapped(**parameters()), inputs.rows, START)["velocity"])
    bench.drive(map_enabled=0)
    inputs, seen = await bench.campaign("strobe", "valid", names(d), outputs(d), rows(d, 2000), momentary=momentary(d))
    # What the filter knows from before is forgotten by a restart.
    first = int(np.argmax(inputs.column("restart")))
    unmapped = model(Mapped(**parameters()), inputs.rows[first:], START)
    check(inputs, seen, {key: np.append(seen.column(key)[:first], unmapped[key]) for key in unmapped})


@pytest.mark.parametrize("name", some_of(["mhz", "narrow"], 0))
def test_rtl(name):
    simulate(__file__, make, name=name)


@pytest.mark.parametrize("name", ["paper", "mhz"])
def test_errors_of_whole_counts_are_counts_that_are_moved(name):
    """An edge that stands k counts off has the number of the edge that should stand there."""
    random, bins = seeded(), Mapped(name).scale.bins
    moved = np.array([random.randrange(-2, 3) for _ in range(bins)])
    d = Mapped(name, moved.astype(float))
    every = list(rows(d, 6000))
    assert max(abs(row[0]) for row in every) < (1 << (d.count_width - 1)) - 3
    at = [min(max((row[0] + row[7] - d.scale.first) >> BIN_BITS, 0), bins - 1) for row in every]
    plain = [(row[0] + int(moved[here]), *row[1:]) for row, here in zip(every, at, strict=True)]
    found, expected = model(d, every, START), model(Mapped(name), plain, START)
    assert {name: found[name].tolist() for name in found} == {name: expected[name].tolist() for name in expected}
    assert np.any(found["velocity"] != model(Mapped(name), every, START)["velocity"])
