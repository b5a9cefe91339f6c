"""The way of a sample from the encoder's pins to those of the drive, with the clocks of each step."""

from functools import cache
from itertools import accumulate, pairwise
from typing import NamedTuple

from hardwall.model.axis import supervisor
from hardwall.model.encoder import quadrature
from hardwall.model.spec import AxisSpec
from hardwall.sim.scene.load import load

from .sheet import BLUE, GREEN, GREY, ORANGE, PURPLE, SMALL, Box, Sheet, Tone, bold, code, row, small

SCENE = "mhz"


class Step(NamedTuple):
    """A step on the way: its name, its clocks and its colours."""

    name: str
    clocks: int
    tone: Tone


@cache
def spec_of_scene() -> AxisSpec:
    """Return the axis of the scene that is shown."""
    return load(SCENE).spec


def decoder_clocks(spec: AxisSpec) -> tuple[int, int, int]:
    """Return the clocks of synchroniser, filter and count: those in which an edge of A passes the model's registers."""
    inputs = quadrature.Inputs(0, 0, 0, spec.glitch_clocks, 0)
    state = quadrature.START
    while state.starting:
        state = quadrature.step(spec.design.decoder, state, inputs, quadrature.NO_STROBES)
    seen, clocks = [0], 0
    for reached in (lambda state: state.second & 1, lambda state: state.level & 1, lambda state: state.count):
        while not reached(state):
            state = quadrature.step(spec.design.decoder, state, inputs._replace(a=1), quadrature.NO_STROBES)
            clocks += 1
        seen.append(clocks)
    first, second, third = (later - sooner for sooner, later in pairwise(seen))
    return first, second, third


def supervisor_clocks(spec: AxisSpec) -> int:
    """Return the clocks from a changed drive to the drive that is let out while ARMED, as the model steps."""
    design = supervisor.Design(spec)
    most = spec.force_limit_word
    state = supervisor.START._replace(
        state=supervisor.ARMED, live=1, left=1, ceiling=most << design.params.ramp_fraction
    )
    inputs = supervisor.Inputs(drive=1, enable=1, supervisor_force_limit=most)
    clocks = 0
    while not state.driven:
        state = supervisor.step(design.params, state, inputs)
        clocks += 1
    return clocks


def before_sample(spec: AxisSpec) -> tuple[Step, ...]:
    """Return the steps from a pin to the count."""
    synchroniser, glitch_filter, count = decoder_clocks(spec)
    return (
        Step("synchroniser", synchroniser, GREY),
        Step("glitch filter", glitch_filter, GREY),
        Step("decoder", count, GREY),
    )


def behind_sample(spec: AxisSpec) -> tuple[Step, ...]:
    """Return the steps from the sample strobe to the pins of the drive."""
    design = spec.design
    return (
        Step("estimator", design.estimator.latency, BLUE),
        Step("wall", design.wall.latency, PURPLE),
        Step("output stage", design.output.latency, ORANGE),
        Step("supervisor", supervisor_clocks(spec), GREEN),
        Step("drive stage", spec.drive.latency, GREY),
    )


def clocks(number: int) -> str:
    """Return a number of clocks in words."""
    return f"{number} clock{'s' * (number != 1)}"


def draw() -> str:
    """Return the diagram."""
    spec = spec_of_scene()
    before, behind = before_sample(spec), behind_sample(spec)
    sheet = Sheet(424)
    _boxes(sheet, spec, before, behind)
    _bar(sheet, spec, before, behind)
    return sheet.svg()


def _boxes(sheet: Sheet, spec: AxisSpec, before: tuple[Step, ...], behind: tuple[Step, ...]) -> None:
    """Draw the steps as boxes in two rows."""
    boxes = [sheet.box(Box(20, 24, 112, 62), bold("pins A, B"), small("encoder"))]
    for (left, wide), step in zip(row(166, 600, len(before), 34), before, strict=True):
        boxes.append(sheet.box(Box(left, 24, wide, 62), step.name, small(clocks(step.clocks)), tone=step.tone))
    sheet.chain(*boxes)
    counted, turn, top = boxes[-1], 122, 158
    places, boxes = row(20, 680, len(behind) + 1, 18), []
    for (left, wide), step in zip(places, behind, strict=False):
        lines = *step.name.split(), small(clocks(step.clocks))
        boxes.append(sheet.box(Box(left, top, wide, 78), *lines, tone=step.tone))
    left, wide = places[-1]
    boxes.append(sheet.box(Box(left, top, wide, 78), bold("pin"), code(spec.drive.pins[0], SMALL)))
    sheet.chain(*boxes)
    sheet.wire(counted.east, (640, counted.y), (640, turn), (boxes[0].x, turn), boxes[0].north)
    waits = f"0 to {spec.clocks_per_sample - 1} clocks until the next sample strobe"
    sheet.text((366, turn - 13), small(waits))


def _bar(sheet: Sheet, spec: AxisSpec, before: tuple[Step, ...], behind: tuple[Step, ...]) -> None:
    """Draw the steps as a bar, a clock as wide as every other, without the wait for the strobe."""
    steps = (*before, *behind)
    ends = list(accumulate((step.clocks for step in steps), initial=0))
    counted, driven = ends[len(before)], ends[-3]
    unit, top, high = 660 / ends[-1], 318, 40

    def at(clock: int) -> float:
        return 20 + unit * clock

    for step, (begin, end) in zip(steps, pairwise(ends), strict=True):
        sheet.box(Box(at(begin), top, at(end) - at(begin), high), bold(f"{step.clocks}"), tone=step.tone)
    sheet.span(at(0), at(counted), top - 18, f"pin to count: {clocks(counted)}")
    sheet.span(at(counted), at(driven), top - 18, f"sample to drive: {clocks(driven - counted)}")
    let_out = ends[-2]
    ns = f"{let_out * 1e9 / spec.clock_hz:g} ns at {spec.clock_hz / 1e6:g} MHz"
    total = bold(f"pin to the drive let out, without the wait: {clocks(let_out)}, {ns}", SMALL)
    sheet.span(at(0), at(let_out), top + high + 22, total, above=False)
