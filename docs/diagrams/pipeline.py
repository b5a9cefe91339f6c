"""The pipeline of an axis over time: which stage works on which sample, when samples follow each other soonest."""

from itertools import accumulate, pairwise

from .pin_to_drive import SCENE, Step, behind_sample, spec_of_scene
from .sheet import BLUE, LINE, ORANGE, Box, Sheet, bold, small

SAMPLES = (("k", BLUE), ("k + 1", ORANGE))
LEFT, RIGHT, TOP, HIGH, GAP = 118, 680, 96, 34, 12


def draw() -> str:
    """Return the diagram."""
    spec = spec_of_scene()
    stages, interval = behind_sample(spec), spec.design.interval
    ends = list(accumulate((stage.clocks for stage in stages), initial=0))
    last = interval * (len(SAMPLES) - 1) + ends[-1] + 1
    unit = (RIGHT - LEFT) / last
    bottom = TOP + len(stages) * (HIGH + GAP)
    sheet = Sheet(bottom + 106)

    def at(clock: int) -> float:
        return LEFT + unit * clock

    sheet.grid(map(at, range(last + 1)), 76, bottom)
    _strobe(sheet, [at(interval * k) for k in range(len(SAMPLES))], unit)
    _bars(sheet, stages, ends, interval, at)
    for clock in range(0, last + 1, 3):
        sheet.text((at(clock), bottom + 12), small(f"{clock}"))
    sheet.text((60, bottom + 12), small("clocks"))
    here = bottom + 60
    sheet.span(at(0), at(interval), here, f"next sample: {interval} clocks")
    said = f"sample to pin: {ends[-1]} clocks"
    sheet.span(at(interval), at(interval + ends[-1]), here, said)
    fewest = f"the scene {SCENE} takes a sample every {spec.clocks_per_sample} clocks; {interval} is the fewest"
    sheet.text((350, here + 26), small(fewest))
    return sheet.svg()


def _strobe(sheet: Sheet, places: list[float], unit: float) -> None:
    """Draw the sample strobe, high for a clock at each of some places, and which sample it takes."""
    low, high = 70, 48
    sheet.text((60, 60), "strobe")
    path = [(LEFT - 8, low)]
    for place, (name, tone) in zip(places, SAMPLES, strict=True):
        path += [(place, low), (place, high), (place + unit, high), (place + unit, low)]
        sheet.text((place + 2, 30), bold(f"sample {name}", 14, tone.edge), align="left")
    sheet.wire(*path, (RIGHT, low), ink=LINE, heads="-")


def _bars(sheet: Sheet, stages: tuple[Step, ...], ends: list[int], interval: int, at) -> None:
    """Draw a row for each stage, with a bar while it works on a sample."""
    for place, (stage, (begin, end)) in enumerate(zip(stages, pairwise(ends), strict=True)):
        top = TOP + place * (HIGH + GAP)
        sheet.text((60, top + HIGH / 2), stage.name)
        for number, (name, tone) in enumerate(SAMPLES):
            first = interval * number + begin
            wide = at(first + end - begin) - at(first)
            lines = [bold(name, 14)] if wide > 60 else []
            sheet.box(Box(at(first), top, wide, HIGH), *lines, tone=tone)
