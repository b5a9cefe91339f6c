"""The closed loop: a simulated device, an encoder, the axis on one of the backends, and the force that goes back."""

from hardwall.sim.loop.backends import BACKENDS, is_exact

from .sheet import BLUE, GREEN, GREY, ORANGE, PURPLE, YELLOW, Box, Sheet, bold, code, small

SAID = {
    "float": ("the algorithm", "in float64"),
    "fixed": ("the model, in the", "hardware's integers"),
    "rtl": ("the Verilog,", "by Verilator"),
}
TONES = {"float": GREY, "fixed": BLUE, "rtl": PURPLE}


def draw() -> str:
    """Return the diagram."""
    sheet = Sheet(396)
    plant = sheet.box(
        Box(20, 24, 206, 92), bold("device"), small("hand, handle, motor,"), small("friction"), tone=GREEN
    )
    encoder = sheet.box(Box(474, 24, 206, 92), bold("encoder"), small("counts, with its errors"), tone=ORANGE)
    frame = sheet.box(Box(150, 180, 530, 192), tone=YELLOW)
    sheet.text((frame.x, frame.top + 22), bold("axis: estimator, wall, output stage"))
    sheet.text((frame.x, frame.top + 43), small("one of three backends, at the same clocks"))
    left = frame.left + 18
    boxes = {}
    for name in BACKENDS:
        lines = code(name, 16), *map(small, SAID[name])
        boxes[name] = sheet.box(Box(left, frame.top + 64, 144, 108), *lines, tone=TONES[name])
        left += 175
    exact = [name for name in BACKENDS if is_exact(name)]
    between = (boxes[exact[0]].right + boxes[exact[1]].left) / 2
    sheet.text((between, boxes[exact[0]].y), bold("=", 20))
    sheet.wire(plant.east, encoder.west)
    sheet.text(((plant.right + encoder.left) / 2, plant.y - 14), "position")
    sheet.wire(encoder.south, (encoder.x, frame.top))
    sheet.text((encoder.x - 12, 148), "edges of A, B", align="right")
    sheet.wire((frame.left, frame.y), (88, frame.y), (88, plant.bottom))
    sheet.text((100, 148), "force", small("after the latency"), align="left")
    return sheet.svg()
