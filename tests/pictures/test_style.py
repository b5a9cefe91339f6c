"""The style that all pictures share: colours, lengths as text, places of labels, and files."""

import numpy as np
import pytest

from hardwall.model.estimators import registry
from hardwall.sim.pictures.labels import label_points, label_right, spread
from hardwall.sim.pictures.style import (
    COLOURS,
    MARKERS,
    OTHER,
    ink,
    lay_out,
    length_text,
    looks,
    new_figure,
    save,
    save_all,
)


def test_colours_and_markers_are_of_estimators_and_are_distinct():
    """An estimator that has none yet is black, so that adding one needs no change here."""
    assert set(COLOURS) == set(MARKERS) <= set(registry.ESTIMATORS)
    assert len(set(COLOURS.values()) | {OTHER["color"]}) == len(COLOURS) + 1
    assert len(set(MARKERS.values()) | {OTHER["marker"]}) == len(MARKERS) + 1
    assert ink("of tomorrow") == OTHER["color"]


def test_an_estimator_looks_the_same_in_every_picture():
    alone, beside = looks([("kalman", "u")])[0], looks([("fdm", "u"), ("kalman", "u")])[1]
    assert alone == beside
    assert alone["color"].lower() == COLOURS["kalman"].lower()


def test_several_of_one_estimator_go_from_pale_to_full_and_a_second_output_is_dashed():
    pale, full, second = looks([("levant", "u"), ("levant", "u"), ("levant", "u1")])
    assert pale["color"] != full["color"] == second["color"]
    assert (full["ls"], second["ls"], second["mfc"]) == ("-", "--", "white")


@pytest.mark.parametrize(
    ("length_m", "text"),
    [(0.0, "at rest"), (9e-10, "at rest"), (1.5e-9, "0.0015 µm"), (4.56789e-6, "4.57 µm"), (2e-3, "2 mm")],
)
def test_lengths_have_digits_that_count(length_m, text):
    assert length_text(length_m) == text


def test_places_are_apart_in_order_and_near():
    wanted = [0.5, 0.51, 0.1, 0.52, 0.9]
    places = spread(wanted, [0.1] * 5)
    assert np.argsort(places).tolist() == np.argsort(wanted).tolist()
    assert np.diff(sorted(places)).min() >= 0.1 - 1e-12
    assert (places[2], places[4]) == (0.1, 0.9)
    assert places[1] == pytest.approx(0.51)


def test_places_end_where_the_panel_ends():
    assert spread([0.02, 0.03, 0.01], [0.1] * 3) == pytest.approx([0.15, 0.25, 0.05])


def boxes(texts) -> list:
    renderer = texts[0].figure.canvas.get_renderer()
    texts[0].figure.draw_without_rendering()
    # The text alone, without the line to its point.
    return [super(type(text), text).get_window_extent(renderer) for text in texts]


def apart(extents) -> bool:
    return not any(
        one.x0 < other.x1 and other.x0 < one.x1 and one.y0 < other.y1 and other.y0 < one.y1
        for number, one in enumerate(extents)
        for other in extents[:number]
    )


def test_names_of_a_crowd_of_points_do_not_touch():
    axes = new_figure(4.0, "crowd").subplots()
    spots = np.random.default_rng(3).uniform(0.4, 0.6, (8, 2))
    axes.set_xlim(0, 1)
    axes.set_ylim(0, 1)
    axes.plot(*spots.T, "o")
    lay_out(axes.figure)
    texts = label_points(axes, [(f"setting number {n}", spot, "black") for n, spot in enumerate(spots)])
    extents = boxes(texts)
    assert apart(extents)
    frame = axes.get_window_extent()
    assert all(frame.x0 <= box.x0 and box.x1 <= frame.x1 for box in extents)
    for x, y in axes.transData.transform(spots):
        assert not any(box.x0 < x < box.x1 and box.y0 < y < box.y1 for box in extents)


def test_names_at_the_ends_of_lines_do_not_touch():
    axes = new_figure(4.0, "ends").subplots()
    axes.set_yscale("log")
    axes.set_ylim(1, 100)
    label_right(axes, [(f"line {n}", 50.0 + n / 10, "black") for n in range(6)])
    assert apart(boxes(axes.texts))


def test_one_picture_is_its_file_and_several_have_their_names_in_theirs(tmp_path):
    one, two = new_figure(2.0, "one"), new_figure(2.0, "two")
    one.subplots()
    two.subplots()
    assert save_all(one, tmp_path / "drop.png") == [tmp_path / "drop.png"]
    written = save_all({"law": one, "maps": two}, tmp_path / "drop.svg")
    assert written == [tmp_path / "drop-law.svg", tmp_path / "drop-maps.svg"]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["drop-law.svg", "drop-maps.svg", "drop.png"]


def test_a_picture_of_another_kind_is_refused(tmp_path):
    message = r"^the name of a picture must end in .pdf, .png, .svg, not '.*replay.gif'$"
    with pytest.raises(ValueError, match=message):
        save(new_figure(2.0, "one"), tmp_path / "replay.gif")
    assert list(tmp_path.iterdir()) == []
