"""The diagrams of the pages are what their scripts draw now, can be read, and say what the code says."""

import importlib
import re
from itertools import combinations, pairwise
from types import SimpleNamespace
from typing import NamedTuple
from xml.etree import ElementTree

import pytest
from matplotlib.font_manager import FontProperties
from matplotlib.textpath import text_to_path

from hardwall.hdl.axis.board import Board
from hardwall.model.axis import supervisor
from hardwall.model.encoder import quadrature
from support.pages import PAGES, ROOT, text_of

pytest.importorskip("schemdraw", reason="schemdraw is not installed: pip install '.[docs]'")

FOLDER = ROOT / "docs" / "diagrams"
FILES = sorted(path.name for path in FOLDER.glob("*.svg"))
WIDE, LEAST_PX = 700, 12.5
"""The width of a page's picture, and the least size of letters at that width."""
SVG = "{http://www.w3.org/2000/svg}"
FAMILIES = {"monospace": "DejaVu Sans Mono", None: "DejaVu Sans"}
"""Wide fonts, of those that browsers take for a family."""
GRID = "#dfe3e8"


class Area(NamedTuple):
    """A rectangle, y downwards."""

    left: float
    top: float
    right: float
    bottom: float

    def meets(self, other: "Area") -> bool:
        across = self.left < other.right and other.left < self.right
        return across and self.top < other.bottom and other.top < self.bottom

    def within(self, other: "Area") -> bool:
        across = other.left <= self.left and self.right <= other.right
        return across and other.top <= self.top and self.bottom <= other.bottom


@pytest.fixture(scope="module")
def scripts():
    """Return the modules that draw, by their names."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(ROOT / "docs"))
        names = "draw", "pin_to_drive", "supervisor_states"
        return SimpleNamespace(**{name: importlib.import_module(f"diagrams.{name}") for name in names})


def elements(name: str, tag: str) -> list[ElementTree.Element]:
    return ElementTree.fromstring((FOLDER / name).read_text(encoding="utf-8")).findall(f"{SVG}{tag}")


def texts(name: str) -> dict[Area, str]:
    """Return the texts of a diagram by the areas that they take."""
    found = {}
    for each in elements(name, "text"):
        x, y, size = (float(each.get(key, 0)) for key in ("x", "y", "font-size"))
        font = FontProperties(
            family=FAMILIES[each.get("font-family")], weight=each.get("font-weight", "normal"), size=size
        )
        wide, *_ = text_to_path.get_text_width_height_descent(each.text, font, ismath=False)
        left = x - wide * {"start": 0, "middle": 0.5, "end": 1}[each.get("text-anchor")]
        found[Area(left, y - 0.73 * size, left + wide, y + 0.2 * size)] = each.text
    return found


def corners(path: ElementTree.Element) -> list[tuple[float, float]]:
    numbers = [float(number) for number in re.findall(r"-?[\d.]+", path.get("d", ""))]
    return list(zip(numbers[::2], numbers[1::2], strict=True))


def boxes(name: str) -> list[Area]:
    """Return the boxes of a diagram, which have round corners."""
    found = [corners(path) for path in elements(name, "path") if "Q" in path.get("d", "")]
    return [Area(*(choose(ends) for choose in (min, max) for ends in zip(*every, strict=True))) for every in found]


def wires(name: str) -> list[Area]:
    """Return the pieces of the lines of a diagram."""
    lines = [path for path in elements(name, "path") if "fill:none" in path.get("style", "")]
    ends = [pair for line in lines if GRID not in line.get("style", "") for pair in pairwise(corners(line))]
    return [Area(*map(min, zip(*pair, strict=True)), *map(max, zip(*pair, strict=True))) for pair in ends]


def test_a_diagram_is_what_its_script_draws(scripts):
    """After a change on purpose, `python -m docs.diagrams.draw` writes all anew."""
    drawn = scripts.draw.every()
    assert sorted(drawn) == FILES
    assert [name for name in FILES if (FOLDER / name).read_text(encoding="utf-8") != drawn[name]] == []


@pytest.mark.parametrize("name", FILES)
def test_a_page_shows_a_diagram(name):
    shown = re.compile(r"!\[[^\]]+\]\(([^)]+\.svg)\)")
    places = {(ROOT / page).parent.joinpath(path).resolve() for page in PAGES for path in shown.findall(text_of(page))}
    assert FOLDER / name in places


@pytest.mark.parametrize("name", FILES)
def test_every_word_is_read(name):
    """No letters are too small, and no text meets another one, a line, or the edge of a box or of the diagram."""
    image = ElementTree.fromstring((FOLDER / name).read_text(encoding="utf-8"))
    ground = Area(0, 0, *map(float, (image.get("width"), image.get("height"))))
    assert ground.right == WIDE
    assert {each.text for each in elements(name, "text") if float(each.get("font-size", 0)) < LEAST_PX} == set()
    found = texts(name)
    assert len(found) == len(elements(name, "text"))
    assert {text for area, text in found.items() if not area.within(ground)} == set()
    assert {(found[one], found[other]) for one, other in combinations(found, 2) if one.meets(other)} == set()
    edges = boxes(name)
    cut = {text for area, text in found.items() for box in edges if area.meets(box) and not area.within(box)}
    assert cut == set()
    assert {text for area, text in found.items() for wire in wires(name) if area.meets(wire)} == set()


def test_the_clocks_are_those_of_the_hardware(scripts):
    spec = scripts.pin_to_drive.spec_of_scene()
    before, behind = scripts.pin_to_drive.before_sample(spec), scripts.pin_to_drive.behind_sample(spec)
    to_count, to_pins = (sum(step.clocks for step in steps) for steps in (before, behind))
    board = Board(spec)
    assert to_count == quadrature.latency(spec.glitch_clocks)
    assert to_pins == board.latency
    assert to_pins - behind[-1].clocks == board.drive_latency
    assert sum(step.clocks for step in behind[:3]) == spec.design.latency_to_drive
    said = " ".join(texts("pin-to-drive.svg").values())
    for number, what in (
        (to_count, "pin to count"),
        (spec.design.latency_to_drive, "sample to drive"),
        (to_count + board.drive_latency, "without the wait"),
    ):
        assert f"{what}: {number} clocks" in said


def test_the_transitions_are_those_of_the_supervisor(scripts):
    states = scripts.supervisor_states
    off, on, tripped = supervisor.DISARMED, supervisor.ARMED, supervisor.TRIPPED
    assert set(states.transitions()) == {(off, on), (on, off), (off, tripped), (on, tripped), (tripped, off)}
    assert len(states.tripping(on)) == supervisor.COUNT
    assert states.tripping(off) == [cause.name for cause in supervisor.CAUSES if cause.always]
    # "Just the causes that are latched": an acknowledgement of more of them, or of none, is void.
    after = [states.stepped(tripped, 0, acknowledge=1, acknowledged=causes).state for causes in (1, 0, 3)]
    assert after == [off, tripped, tripped]


def test_overlaps_are_seen():
    one, two = Area(0, 0, 10, 10), Area(5, 5, 20, 8)
    assert one.meets(two)
    assert not one.meets(Area(10, 0, 20, 10))
    assert Area(1, 1, 9, 9).within(one)
    assert not two.within(one)
