"""The worst of several hands: every wall, the edge and its hands against brute force, and what is printed and refused.

The verdicts are made up but in one long test, so that every start's edge is known.
"""

import csv
import json
from itertools import product

import pytest

from hardwall.sim.jobs.job_pool import Threads
from hardwall.sim.jobs.store import Store
from hardwall.sim.scene.case import Case
from hardwall.sim.scene.hand_section import HANDS, HandSection
from hardwall.sim.studies import zwidth as study
from hardwall.sim.walls import mapping, worst_variant, zwidth
from hardwall.sim.walls.boundary import STABLE, BoundaryPoint
from hardwall.sim.walls.grid import grid_of
from hardwall.sim.walls.likelihood import Wall
from stimuli import results
from stimuli.lengths import long_form
from stimuli.scenes import HAND
from support.command_line import call
from support.reports import check

STEP = 1e3
GRID = {
    "zwidth.stiffness_step_n_per_m": STEP, "zwidth.stiffness_to_n_per_m": 40e3,
    "zwidth.damping_from_n_s_per_m": 10.0, "zwidth.damping_to_n_s_per_m": 50.0, "zwidth.damping_step_n_s_per_m": 20.0,
}  # fmt: skip
SMALL = {
    "zwidth.stiffness_step_n_per_m": 20e3, "zwidth.stiffness_to_n_per_m": 80e3,
    "zwidth.damping_from_n_s_per_m": 20.0, "zwidth.damping_to_n_s_per_m": 20.0, "zwidth.damping_step_n_s_per_m": 10.0,
    "protocol.settle_s": 2.0, "protocol.measure_s": 0.5,
}  # fmt: skip
TWO = ("none", "hogan-1989")
STARTS = 5
EDGES = {"none": (20e3, 0.0), "hogan-1989": (36e3, -600.0), "yokokohji-1994": (30e3, 0.0), "van-beek-2015": (30e3, 0.0)}
"""The K up to which half of the starts are stable at B = 0, and what it gains with B, by hand."""


def hand_of(changes: dict) -> str:
    return changes.get("hand.model", "none")


def stable(hand: str, wall: tuple[float, float], start: int) -> bool:
    """Return the made-up verdict: the edges of the starts are 1.5 kN/m apart, in an order that is not their own."""
    stiffness, damping = wall
    edge, gain = EDGES[hand]
    return stiffness <= edge + gain * damping + 1.5e3 * (start * 3 % STARTS - 2)


@pytest.fixture
def asked(monkeypatch):
    """Let hits have made-up verdicts; give a list of what was asked: hand, wall and start."""
    found = []

    def verdict(changes, wall, start, **_):
        found.append((hand_of(changes), tuple(wall), start))
        return results.verdict(stable(hand_of(changes), wall, start))

    monkeypatch.setattr(mapping, "verdict", verdict)
    return found


def mapped(case: Case, hands: tuple[str, ...]) -> list[zwidth.Map]:
    with Threads(1) as pool:
        return mapping.run(worst_variant.cases_of(case, hands), "fixed", Store("zwidth"), pool, starts=STARTS)


@pytest.fixture
def case():
    return Case.of("seed-2011", GRID, "u")


def test_every_wall_has_the_least_share_of_the_hands(case, asked):
    *_, found = mapped(case, worst_variant.HELD_BY)
    assert found.case.label == "u, worst hand"
    report = found.report()
    assert report["hands"] == list(EDGES) == list(worst_variant.HELD_BY)
    walls = zip(found.walls, report["p_stable"], report["worst_of_p_stable"], strict=True)
    for wall, (damping, stiffness, good, bad, open_), names in walls:
        starts = list(wall.hits)
        shares = {
            hand: sum(stable(hand, (stiffness, damping), start) for start in starts) / len(starts) for hand in EDGES
        }
        assert good / (good + bad + open_) == min(shares.values())
        assert names == [hand for hand in EDGES if shares[hand] == min(shares.values())]
    assert any(0 < each[2] < STARTS for each in report["p_stable"])


def test_the_edge_is_where_the_least_share_of_a_whole_grid_passes_one_half(case, asked):
    """The edges are 20 kN/m without a hand and 30, 18 and 6 with the stiff arm, at the three values of B."""
    *_, found = mapped(case, worst_variant.HELD_BY)
    grid = grid_of(case.scene)
    for point in found.boundary:
        below = 0.0
        for row in range(1, grid.rows + 1):
            wall = row * STEP, point.damping_n_s_per_m
            least = min(sum(stable(hand, wall, start) for start in range(STARTS)) for hand in EDGES)
            below = wall[0] if 2 * least >= STARTS else below
        assert below <= point.stable_n_per_m <= below + STEP
        assert point.marginal_n_per_m > point.stable_n_per_m
    assert found.report()["worst_of_boundary"] == [["none"], ["hogan-1989"], ["hogan-1989"]]
    assert worst_variant.told(found.variants, found.boundary) == "no hand at 10, hogan-1989 at 30 to 50"


def test_no_hit_is_made_twice_and_all_hands_have_the_same_starts(case, asked):
    *alone, found = mapped(case, worst_variant.HELD_BY)
    assert len(asked) == len(set(asked)) < sum(each.hits for each in (*alone, found))
    for walls in zip(*found.variants.values(), strict=True):
        assert len({tuple(wall.hits) for wall in walls}) == 1
    assert found.hits == sum(len(wall.hits) for walls in found.variants.values() for wall in walls)


def test_the_map_of_a_hand_is_that_of_its_scene_alone(case, asked):
    """The worst of a hand with itself is no map: a list of one has the hand's own map only."""
    (alone,) = mapped(case, ("hogan-1989",))
    with Threads(1) as pool:
        held = [case.changed({"hand.model": "hogan-1989"})]
        (again,) = mapping.run(held, "fixed", Store("zwidth"), pool, starts=STARTS)
    assert alone.boundary == again.boundary
    assert alone.report().keys() == again.report().keys()
    assert "hands" not in alone.report()


def test_a_hand_takes_the_place_of_the_scene_s_own_and_rests_where_that_does():
    no_hand, arm, least = worst_variant.cases_of(Case.of("seed-2011", GRID | HAND), TWO)
    assert no_hand.scene.hand is None
    assert arm.scene.hand == HandSection(model="hogan-1989", rest_m=HAND["hand.rest_m"])
    assert [each.scene for each in least.variants.values()] == [no_hand.scene, arm.scene]


def test_hands_of_one_edge_are_all_the_worst(case, asked):
    *_, found = mapped(case, ("yokokohji-1994", "van-beek-2015"))
    assert worst_variant.told(found.variants, found.boundary) == "yokokohji-1994 or van-beek-2015 at 10 to 50"


def test_report_lines_table_and_picture(monkeypatch, capsys, tmp_path, asked):
    picture, file = tmp_path / "map.svg", tmp_path / "hits.csv"
    options = [word for key, value in GRID.items() for word in ("--set", f"{key}={value}")]
    options += ["--estimators", "kalman", "--hands", ",".join(TWO), "--starts", STARTS]
    options += ["--workers", 1]
    code, out, _ = call(monkeypatch, capsys, "zwidth", *options, "--json", "--plot", picture, "--csv", file)
    assert code == 0
    report = json.loads(out)
    check("zwidth", report)
    none, arm, least = report["maps"]
    assert [each["label"] for each in report["maps"]] == [
        f"kalman, {name}" for name in ("no hand", TWO[1], "worst hand")
    ]
    assert none["changes"]["hand"] is None
    assert arm["changes"]["hand.model"] == TWO[1]
    assert least["hands"] == list(TWO)
    for one, other, both in zip(none["boundary"], arm["boundary"], least["boundary"], strict=True):
        assert both[1] == pytest.approx(min(one[1], other[1]), abs=STEP)
    lines = [tuple(line.values())[:4] for line in csv.DictReader(file.open())]
    assert len(lines) == len(set(lines)) == len(asked)
    assert {line[0] for line in lines} == {none["label"], arm["label"]}
    told = "no hand at 10, hogan-1989 at 30 to 50"
    assert f"kalman, worst hand: {told} N s/m" in picture.read_text()


@pytest.mark.parametrize(
    ("edge", "one", "other", "names"),
    [
        (2e3, (4, 3, 0, 0), (4, 4, 0, 0), ["one"]),
        (2.5e3, (4, 4, 1, 0), (4, 4, 0, 0), ["other"]),
        (2.5e3, (3, 4, 1, 0), (4, 4, 1, 0), ["one", "other"]),
        (0.0, (1, 0, 0, 0), (0, 0, 0, 0), ["other"]),
        (4e3, (4, 4, 4, 3), (4, 4, 4, 4), ["one"]),
    ],
    ids=["below", "above", "neither", "no stable wall", "beyond the map"],
)
def test_the_worst_at_an_edge_is_that_of_its_two_walls(edge, one, other, names):
    """Of four starts so many are stable at 1, 2, 3 and 4 kN/m."""
    variants = {
        name: tuple(
            Wall(10.0, 1e3 * row, {start: results.verdict(start < number) for start in range(4)})
            for row, number in enumerate(numbers, 1)
        )
        for name, numbers in (("one", one), ("other", other))
    }
    assert worst_variant.at_edge(variants, BoundaryPoint(10.0, edge, None)) == names


def test_the_table_says_which_hand_is_the_worst(case, asked):
    found = study.ZWidth(case.scene, mapped(case, TWO), [], results.NOTHING)
    (table,) = found.tables()
    column = list(table.columns).index(study.WORST)
    assert [row[column] for row in table.rows] == ["", "", "no hand at 10, hogan-1989 at 30 to 50"]
    assert any(note.startswith(f"{study.WORST}: ") for note in found.notes())


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--hands", "nobody"], f"--hands must be all, or some of none, {', '.join(HANDS)}, not 'nobody'"),
        (["--hands", ""], f"--hands must be all, or some of none, {', '.join(HANDS)}, not ''"),
        (
            ["--hands", "all", "--set", "hand.model=hogan-1989"],
            "--set 'hand.model' must be absent (this command sets it): see",
        ),
        (
            ["--hands", "none", "--set", "hand.mass_kg=0.1"],
            "--set 'hand.mass_kg' must be absent (this command sets it): see",
        ),
        (
            ["--hands", "hogan-1989", "--set", "presliding.model=dahl", "--set", "presliding.stiffness_n_per_m=1e5"],
            "presliding must be absent beside amplifier.bandwidth_hz, motor, transmission, hand, ",
        ),
    ],
)
def test_what_cannot_be_is_refused_in_a_line(monkeypatch, capsys, arguments, message):
    code, out, err = call(monkeypatch, capsys, "zwidth", *arguments)
    assert (code, out) == (2, "")
    assert message in err
    assert err.count("\n") == 1


@long_form
def test_real_hits_of_every_wall_of_a_grid_have_the_edge_of_the_map():
    """The loop itself: every wall of a small grid is hit with both hands from every start."""
    case = Case.of("seed-2011", SMALL | {"controller.estimator": "fdm"}, "fdm")
    *_, found = mapped(case, TWO)
    grid = grid_of(case.scene)
    (damping,) = grid.dampings
    least = []
    for row in range(1, grid.rows + 1):
        wall = row * grid.stiffness_step_n_per_m, damping
        shares = dict.fromkeys(TWO, 0)
        for hand, start in product(TWO, range(STARTS)):
            job = found.case.variants[hand].job() | {"sources": mapping.store.sources(), "backend": "fixed"}
            shares[hand] += mapping.verdict(**job, wall=wall, start=start)["verdict"] == STABLE
        least.append(min(shares.values()))
    (point,) = found.boundary
    below = max((row for row, each in enumerate(least, 1) if 2 * each >= STARTS), default=0)
    assert below * grid.stiffness_step_n_per_m <= point.stable_n_per_m <= (below + 1) * grid.stiffness_step_n_per_m
