"""How a test runs: pytest reads the file and starts the simulator, which reads it again and compares."""

from pathlib import Path

from .sheet import BLUE, GREEN, GREY, ORANGE, PURPLE, RED, YELLOW, Box, Line, Sheet, Tone, bold, code, small

(EXAMPLE,) = (Path(__file__).absolute().parents[1] / "examples").glob("test_*.py")
BLOCK = Tone("#b9d6f3", BLUE.edge)


def draw() -> str:
    """Return the diagram."""
    sheet = Sheet(640)
    first = sheet.box(Box(14, 14, 672, 116), tone=GREY)
    sheet.text((first.left + 14, 32), bold("pytest"), align="left")
    file = sheet.box(Box(30, 50, 250, 64), code(EXAMPLE.name), small("read by pytest"))
    simulate = sheet.box(Box(360, 50, 306, 64), code("simulate(__file__, make)"), small("Amaranth, Verilog, Verilator"))
    sheet.chain(file, simulate)
    second = sheet.box(Box(14, 182, 672, 444), tone=GREY)
    sheet.text((second.left + 14, 202), bold("simulator: the same file, read again by cocotb"), align="left")
    sheet.wire(simulate.south, (simulate.x, second.top))
    sheet.text((simulate.x - 12, 156), "builds, starts", align="right")
    _campaign(sheet)
    _verdict(sheet)
    return sheet.svg()


def _campaign(sheet: Sheet) -> None:
    """Draw what drives the block, and what is taken from its pins."""
    rows = sheet.box(Box(30, 222, 150, 72), code("rows"), small("extremes first,"), small("then random"))
    campaign = sheet.box(
        Box(212, 222, 160, 72), code("Bench.campaign"), small("clock, reset,"), small("one strobe a row")
    )
    block = sheet.box(Box(496, 222, 170, 72), bold("your block"), small("the RTL"), tone=BLOCK, lw=2.6)
    sheet.chain(rows, campaign, block)
    sheet.text(((campaign.right + block.left) / 2, block.y - 26), code("strobe", 13), small("inputs"))
    taken = sheet.box(Box(372, 344, 140, 62), code("taken"), small("at every strobe"), tone=YELLOW)
    given = sheet.box(Box(526, 344, 140, 62), code("given"), small("at every valid"), tone=YELLOW)
    tap = (campaign.right + block.left) / 2 + 8
    sheet.dot((tap, block.y), 4)
    sheet.wire((tap, block.y), (tap, taken.top))
    sheet.wire((given.x + 24, block.bottom), (given.x + 24, given.top))
    sheet.text((given.x + 14, 319), code("valid", 13), align="right")
    point = Line("The model gets the inputs", 15, ORANGE.edge), Line("that the pins carried.", 15, ORANGE.edge)
    sheet.text((350, taken.y), *point, align="right")


def _verdict(sheet: Sheet) -> None:
    """Draw the model beside what the block gave, and what comes of the comparison."""
    model = sheet.box(Box(372, 446, 140, 62), bold("model"), small("your function"), tone=BLUE, lw=2.6)
    check = sheet.box(Box(372, 550, 294, 60), code("check"), small("equal, every sample, at its clock"), tone=PURPLE)
    sheet.wire((model.x, 406), model.north)
    sheet.wire(model.south, (model.x, check.top))
    sheet.text((model.x + 12, 529), code("expected", 13), align="left")
    sheet.wire((620, 406), (620, check.top))
    good = sheet.box(Box(30, 446, 250, 44), bold("pass"), tone=GREEN)
    lines = "first wrong sample,", "waveform .fst,", "command to run again"
    wrong = sheet.box(Box(30, 512, 250, 98), bold("fail"), *map(small, lines), tone=RED)
    fork = 326
    sheet.wire((check.left, check.y), (fork, check.y), (fork, good.y), good.east)
    sheet.wire((fork, check.y), (wrong.right, check.y))
    sheet.dot((fork, check.y), 3.5)
