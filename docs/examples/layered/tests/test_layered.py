"""The layered wall: RTL against model, model against the float64 equation, and no push of the core in free space."""

import cocotb
import pytest

from hardwall.hdl.layered import Layered
from hardwall.model.axis import wall
from hardwall.model.layered import Design
from hardwall.testing import CAMPAIGN, SAMPLES, Bench, check, parameters, rng, simulate
from stimuli.sampled import Sampled
from stimuli.specs import spec


def design(name: str) -> Design:
    axis = spec(name)
    return Design(axis, axis.design.estimator.velocity)


def make(name: str) -> Sampled:
    return Sampled(Layered(design(name)), wall.LEAD)


def stimulus(d: Design, samples: int):
    """Yield (count, velocity, *words) near the surface, near the core, at the ends of the count, and anywhere."""
    random, half = rng(), 1 << (d.count_width - 1)
    for k in range(samples):
        words = [int(random.integers(word.format.min, word.format.max + 1)) for word in d.words]
        named = dict(zip((word.name for word in d.words), words, strict=True))
        inwards = -named["core_depth"] if named["wall_left"] else named["core_depth"]
        near = (named["wall_position"], named["wall_position"] + inwards, half - 1, int(random.integers(-half, half)))[
            k % 4
        ]
        count = (near + int(random.integers(-50, 51)) + half) % (2 * half) - half
        yield count, int(random.integers(d.velocity.min, d.velocity.max + 1)), *words


def model(d: Design, rows) -> list[int]:
    names = [word.name for word in d.words]
    return [wall.render(d.params(dict(zip(names, row[2:], strict=True))), row[0], row[1]) for row in rows]


@cocotb.test(**CAMPAIGN)
async def follows_model(dut):
    component = make(**parameters())
    d, bench = component.design, Bench(dut, component)
    names = ("count", "velocity", *(word.name for word in d.words))
    await bench.reset()
    rows, every = stimulus(d, SAMPLES // 2), d.interval
    inputs, outputs = await bench.campaign("strobe", "valid", names, ("force",), rows, every=every, momentary=names)
    check(inputs, outputs, {"force": model(d, inputs.rows)}, component.latency)


@pytest.mark.parametrize("name", ["paper", "narrow"])
def test_rtl(name):
    simulate(__file__, make, name=name)


def test_fixed_point_is_within_two_force_lsb_of_float():
    d, compared = design("paper"), 0
    names = [word.name for word in d.words]
    for count, velocity, *words in stimulus(d, 20_000):
        named = dict(zip(names, words, strict=True))
        si = [word.to_si(named[word.name]) for word in d.words[:2]]
        params, speed = d.float_params(*si, named), velocity * d.velocity.lsb
        layers = [wall.render(layer, count, speed) for layer in params]
        if max(map(abs, (*layers, sum(layers)))) < d.force.max - 2:
            compared += 1
            assert abs(wall.render(d.params(named), count, velocity) - sum(layers)) <= 2 + 1e-9
            assert wall.render(params, count, speed) == sum(layers)
    assert compared > 5_000


def test_a_core_never_pushes_in_free_space():
    axis, d = spec("paper"), design("paper")
    words = {word.name: word.reset for word in d.words} | {"core_stiffness": d.layer.stiffness.max}
    travel = int(axis.travel_m / axis.count_m)
    for depth in range(-travel, 0, 997):
        for core_depth in (0, travel // 2, travel, d.words[-1].format.max):
            assert wall.render(d.params(words | {"core_depth": core_depth}), depth, 0) == 0


def test_without_a_core_it_is_the_wall():
    d = design("paper")
    rows = [(*row[:-2], 0, row[-1]) for row in stimulus(d, 5_000)]
    plain = [
        wall.render(d.layer.params(dict(zip((w.name for w in d.layer.words), row[2:], strict=False))), *row[:2])
        for row in rows
    ]
    assert model(d, rows) == [max(-d.force.max, min(d.force.max, force)) for force in plain]


def test_wrong_design_is_refused():
    with pytest.raises(TypeError, match=r"not 3$"):
        Layered(3)
