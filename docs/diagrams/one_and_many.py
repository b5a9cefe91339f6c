"""One axis with a chain of its own, beside several axes that take turns in one pipeline."""

from hardwall.model.axes.supervised import Design
from hardwall.sim.scene.tables import load_any

from .pin_to_drive import behind_sample, clocks, spec_of_scene
from .sheet import BLUE, GREEN, GREY, LINE, ORANGE, PURPLE, YELLOW, Box, Sheet, Tone, bold, row, small

SCENE = "eight-axes"
TONES = (BLUE, ORANGE, PURPLE, GREEN)


def draw() -> str:
    """Return the diagram."""
    sheet = Sheet(500)
    _one(sheet)
    _many(sheet)
    return sheet.svg()


def _one(sheet: Sheet) -> None:
    """Draw the axis that is alone."""
    spec = spec_of_scene()
    chain = behind_sample(spec)[:-1]
    sheet.text((20, 28), bold("one axis: the lowest latency"), align="left")
    names = "decoder", *(step.name for step in chain), "drive"
    boxes = [
        sheet.box(Box(left, 50, wide, 60), *name.split(), tone=GREY if name in ("decoder", "drive") else BLUE)
        for name, (left, wide) in zip(names, row(20, 680, len(names), 22), strict=True)
    ]
    sheet.chain(*boxes)
    latency = sum(step.clocks for step in chain)
    paces = f"a sample every {spec.design.interval} clocks or more"
    said = f"{clocks(latency)} from a sample to its drive, by the supervisor; {paces}"
    sheet.span(boxes[0].right, boxes[-1].left, 132, small(said), above=False)


def _many(sheet: Sheet) -> None:
    """Draw the axes that share a pipeline, and the rota of their turns."""
    spec = load_any(SCENE).spec
    last = spec.axes - 1
    sheet.text((20, 184), bold(f"{spec.axes} axes: one pipeline, in turn"), align="left")
    shared = Box(228, 206, 244, 156)
    sheet.box(shared, "one estimator", "one wall", "one output stage", "one supervisor", tone=YELLOW)
    for number, top in ((0, shared.top), (1, shared.top + 50), (last, shared.bottom - 40)):
        tone = _tone(number)
        decoder = sheet.box(Box(20, top, 130, 40), f"decoder {number}", tone=tone)
        drive = sheet.box(Box(550, top, 130, 40), f"drive {number}", tone=tone)
        sheet.wire(decoder.east, (shared.left, decoder.y), ink=tone.edge)
        sheet.wire((shared.right, drive.y), drive.west, ink=tone.edge)
    for x in (85, 615):
        sheet.text((x, shared.bottom - 53), bold("..."))
    latency = Design(spec).latency
    _rota(sheet, spec.axes, spec.clocks_per_sample)
    sheet.text((350, 382), small(f"{clocks(latency)} from a sample to its drive, by the supervisor"))


def _tone(number: int) -> Tone:
    return TONES[number % len(TONES)]


def _rota(sheet: Sheet, axes: int, rota: int) -> None:
    """Draw the clocks of a rota, each with the axis that takes a sample."""
    top, unit = 406, 660 / rota
    for clock in range(rota):
        at = Box(20 + unit * clock, top, unit, 34)
        if clock < axes:
            sheet.box(at, bold(f"{clock}"), tone=_tone(clock))
        else:
            sheet.box(at)
    sheet.span(
        20,
        680,
        top + 54,
        small(f"a rota of {rota} clocks: every axis takes a sample in its clock"),
        ink=LINE,
        above=False,
    )
