"""What the tests of the M/T estimators share: their designs, and campaigns of their RTL against the model."""

from cocotb.triggers import ClockCycles, RisingEdge

from hardwall.hdl.estimators.estimate import EstimatorBlock
from hardwall.model.encoder.quadrature import Seen
from hardwall.model.estimators.kept_edges import Gains, KeptDesign
from hardwall.model.estimators.registry import design_of
from hardwall.testing import SAMPLES, Bench
from hardwall.testing.estimators import follow, model
from stimuli.edges import anything, rows, turn
from stimuli.seeded import seeded
from stimuli.specs import spec


def design(estimator: str, name: str, half: int | None = None) -> KeptDesign:
    """Return the design for an axis, with a window of `half` samples twice or the default one."""
    axis = spec(name, estimator)
    gains = Gains(2 * half / axis.sample_hz) if half else Gains.default(axis)
    return design_of(estimator)(axis, gains)


def stimulus(d: KeptDesign, samples: int):
    """Yield rows of all motions, both ways round, and of what no encoder gives."""
    random = seeded()
    turns = [rows(d, *turn(d, random, samples // 3), invert) for invert in (False, True)]
    yield from (row for part in (*turns, anything(d, random, samples // 3)) for row in part)


async def follows_model(dut, component: EstimatorBlock, name: str) -> None:
    """Put all motions through the RTL: it is the model, reaches both ends, and says so."""
    d = component.design
    expected = await follow(dut, component, stimulus(d, SAMPLES // (4 if name == "mhz" else 10)), d.start())
    assert {0, 1} <= set(expected["saturated"]) <= {0, 1, 2, 3}
    for end in (-d.velocity.max, 0, d.velocity.max):
        assert end in expected["velocity"]


async def starts_afresh(dut, component: EstimatorBlock) -> None:
    """Move, reset, and stand: nothing is left of the motion."""
    bench = Bench(dut, component)
    await bench.reset()
    moving = [
        {"count": 0, "stamp": 40, "stamp_a_rise": 10},
        {"count": 1, "stamp": 70, "stamp_a_rise": 50},
        {"count": 5, "stamp": 90, "stamp_a_rise": 85},
    ]
    for expected_moving, row in zip((False, False, True), moving, strict=True):
        await bench.transact("strobe", "valid", **{f"seen__{name}": value for name, value in row.items()})
        assert (bench.reader("velocity")() > 0) == expected_moving
    await bench.reset()
    await bench.transact("strobe", "valid", seen__count=5, seen__stamp=90, seen__stamp_a_rise=85)
    assert bench.reader("velocity")() == 0


async def stays_until_the_next(dut, component: EstimatorBlock) -> None:
    """Put a few motions through the RTL: both outputs change with `valid` alone, at a saturated velocity too."""
    bench, clock, d = Bench(dut, component), RisingEdge(dut.clk), component.design
    await bench.reset()
    names = (*(f"seen__{name}" for name in Seen._fields), "restart")
    velocity, saturated = map(bench.reader, ("velocity", "saturated"))
    every = list(stimulus(d, 6_000))
    first = int((model(d, every, d.start())["saturated"] & 1).argmax())
    seen = set()
    for row in every[max(first - 2 * d.half - d.doubt - 8, 0) : first + 20]:
        before = velocity(), saturated()
        bench.drive(strobe=1, **dict(zip(names, row, strict=True)))
        await clock
        bench.drive(strobe=0)
        for _ in range(d.latency - 1):
            await clock
            assert (velocity(), saturated()) == before
        await ClockCycles(dut.clk, 2)
        seen.add(saturated() & 1)
    assert seen == {0, 1}
