"""Every picture: its axes have names and units, all words are within it, and its file is always the same."""

import re
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from matplotlib.axis import Tick
from matplotlib.figure import Figure
from matplotlib.text import Text
from PIL import Image

from hardwall.sim.estimates import figures
from hardwall.sim.estimates.replay import replay
from hardwall.sim.pictures import (
    accuracy,
    bits,
    capture,
    costs,
    cutoff,
    drop,
    gains,
    hit,
    hit_axes,
    hit_beside,
    lipschitz,
    mass,
    rates,
    rendered,
    response,
    trade,
    zwidth,
)
from hardwall.sim.pictures import axes as several
from hardwall.sim.pictures import replay as replayed
from hardwall.sim.pictures.style import PAGE_IN, lay_out, save
from hardwall.sim.studies.accuracy import Accuracy
from hardwall.sim.studies.published import LOOPS
from hardwall.sim.studies.shortcuts import SCATTER
from hardwall.sim.studies.zwidth import ZWidth
from stimuli import results
from stimuli.lengths import LONG
from stimuli.replays import BOUND, COARSEN, swing
from stimuli.scenes import COUPLING

SECOND = {"encoder_phase_error_counts": 0.0, "acceleration_max_mm_s2": 2000.0, "backend": "float", "rms_mm_s": 1.0}


def figure_1() -> Figure:
    curves = figures.curves(1)
    rows = [curve.job("paper", 1_000) | SECOND for curve in curves]
    return accuracy.draw(Accuracy(1, curves, rows, [curve.label for curve in curves]))


def errors_at_rates() -> dict:
    """Return a report of errors, of which that of fdm grows with the rate; the others fall, levant's u1 most."""
    ends = {("fdm", "u"): (0.4, 100.0), ("butterworth", "u"): (0.3, 0.2), ("levant", "u1"): (2.0, 0.1)}
    return {
        "rows": [
            {"estimator": name, "output": output, "sample_hz": hz, "rms_mm_s": error}
            for (name, output), errors in ends.items()
            for hz, error in zip((1_000, 1_000_000), errors, strict=True)
        ]
    }


@cache
def many_maps() -> ZWidth:
    """Return twelve maps, always the same, as their limits take long to compute."""
    return results.zwidth([results.map_of(name, 2e4, 200) for name in ("fdm-30", "fdm-100", "adjusted")] * 4)


@cache
def pictures_of_a_drop() -> dict[str, Figure]:
    """Return the pictures of a drop, which are drawn together: each is laid out by the test that looks at it."""
    return drop.draw(results.dropped())


@cache
def pictures_of_rendered_walls() -> dict[str, Figure]:
    """Return the pictures of rendered walls, which are drawn together."""
    return rendered.draw(results.rendered_walls())


PICTURES = {
    "hit": lambda: hit.draw(results.hit()),
    "hit, unstable": lambda: hit.draw(results.hit(4.2e-6)),
    "hit, never reached": lambda: hit.draw(results.hit(reached=False)),
    "hit of several axes": lambda: hit_axes.draw(results.hit_axes()),
    "hits side by side": lambda: hit_beside.draw(results.hit_beside()),
    "replay": lambda: replayed.draw(replay(swing(), coarsen=COARSEN, acceleration_max_counts_per_s2=BOUND)),
    "figure 1": figure_1,
    "figure 2": lambda: accuracy.draw(results.rows()),
    "axes": lambda: several.draw(results.axes_costs()),
    "bits": lambda: bits.draw(results.bits_dropped()),
    "capture": lambda: capture.draw(results.captured("velocity_m_per_s")),
    "capture of accelerations": lambda: capture.draw(results.captured("acceleration_m_per_s2")),
    "response": lambda: response.draw(results.responses()),
    "mass": lambda: mass.draw(results.masses()),
    "costs": lambda: costs.draw(results.costs_of_boards()),
    "cutoff": lambda: cutoff.draw(results.devices()),
    "gains": lambda: gains.draw(results.search()),
    "lipschitz": lambda: lipschitz.draw(results.fit()),
    "rates": lambda: rates.draw(results.rate_gains()),
    "rates beside errors": lambda: rates.draw_beside_errors(errors_at_rates(), results.rate_gains().report()),
    **{
        f"rendered, {name}": lambda name=name: pictures_of_rendered_walls()[name]
        for name in ("impedance", "bandwidth", "contact")
    },
    "zwidth": lambda: zwidth.draw(results.maps()),
    "zwidth of many": lambda: zwidth.draw(many_maps()),
    **{f"drop, {name}": lambda name=name: pictures_of_a_drop()[name] for name in ("rest", "law", "ends", "maps")},
    "trade": lambda: trade.draw(results.traded()),
}


@pytest.fixture(scope="module", params=PICTURES)
def picture(request) -> Figure:
    """Return a picture as it is when it is saved; the tests that share it only look at it."""
    figure = PICTURES[request.param]()
    lay_out(figure)
    figure.draw_without_rendering()
    return figure


def words(figure: Figure) -> list[Text]:
    """Return the visible texts of a figure, except for those of the ticks."""
    ticks = {text for tick in figure.findobj(Tick) for text in tick.findobj(Text)}
    texts = figure.findobj(Text, include_self=False)
    return [text for text in texts if text.get_visible() and text.get_text() and text not in ticks]


def shown(figure: Figure) -> list:
    return [axes for axes in figure.axes if axes.axison and axes.get_label() != "<colorbar>"]


def test_axes_have_names_with_units(picture):
    below = [axes.get_xlabel() for axes in shown(picture)]
    beside = [axes.get_ylabel() for axes in shown(picture)]
    assert any(below)
    named = [label for label in below + beside if label]
    without = [label for label in named if not re.search(r"\(.+\)|bits|LUT4", label)]
    assert without == []
    # A panel without a name shares the axis of one that has it.
    for axes, label in zip(shown(picture), below, strict=True):
        assert label or len(axes.get_shared_x_axes().get_siblings(axes)) > 1


def test_all_words_are_within_the_picture(picture):
    frame = picture.bbox
    renderer = picture.canvas.get_renderer()
    assert picture.get_size_inches()[0] == PAGE_IN
    outside = []
    for each in [*words(picture), *shown(picture)]:
        box = each.get_tightbbox(renderer)
        if box.x0 < frame.x0 - 1 or box.x1 > frame.x1 + 1 or box.y0 < frame.y0 - 1 or box.y1 > frame.y1 + 1:
            outside.append(each)
    assert outside == []


def test_letters_are_large_enough_to_read(picture):
    small = {text.get_text() for text in words(picture) if text.get_fontsize() < 7.5}
    # Exponents of ticks are smaller than their tens, and are part of them.
    assert small == set()


@pytest.mark.parametrize(
    ("name", "suffix"),
    [
        ("bits", ".png"),
        ("bits", ".svg"),
        ("bits", ".pdf"),
        *([("hit", ".png"), ("figure 2", ".svg"), ("zwidth", ".pdf")] if LONG else ()),
        *([("zwidth", ".png"), ("zwidth", ".svg"), ("trade", ".svg")] if LONG else ()),
    ],
)
def test_a_picture_is_always_the_same_file(tmp_path, name, suffix):
    for number in range(2):
        save(PICTURES[name](), tmp_path / f"{number}{suffix}")
    first, second = ((tmp_path / f"{number}{suffix}").read_bytes() for number in range(2))
    assert len(first) > 1000
    assert first == second


@pytest.mark.parametrize("picture", ["hit", "replay", "figure 1"], indirect=True)
def test_an_error_stands_under_the_estimate(picture):
    (error,) = [axes for axes in picture.axes if axes.get_ylabel().startswith("error")]
    others = [axes for axes in picture.axes if axes.get_ylabel().startswith("velocity")]
    assert error.get_position().y1 <= others[0].get_position().y0


def columns(figure: Figure) -> tuple[list, list]:
    """Return the panels of the whole run and of the contact, from top to bottom."""
    return figure.axes[::2], figure.axes[1::2]


def test_the_error_of_a_hit_is_the_estimate_minus_the_truth():
    _, (_, velocity, error, _) = columns(hit.draw(results.hit()))
    true, estimate = (line.get_ydata() for line in velocity.lines[:2])
    (own,) = [line for line in error.lines if "RMS" in line.get_label()]
    assert own.get_ydata() == pytest.approx((estimate - true) * 1e3)


def test_every_axis_has_its_row_with_its_name_and_its_verdict():
    made = results.hit_axes()
    figure = hit_axes.draw(made)
    left, right = columns(figure)
    assert [panel.get_title(loc="left") for panel in left] == list(made.hits)
    verdicts = [panel.get_title(loc="right").rpartition(": ")[2] for panel in right]
    assert verdicts == ["stable, at rest"] * 2 + ["unstable, RMS 4.2 µm"] + ["stable, at rest"] * 4 + [
        "unstable, at rest"
    ]
    assert "6 of 8 walls are stable" in figure.get_suptitle()


def test_hits_side_by_side_say_what_they_do():
    figure = hit_beside.draw(results.hit_beside())
    left, right = figure.axes[:2]
    said = [panel.get_title(loc="left") for panel in (left, right)]
    assert said == ["Force at 1 kHz: it bounces", "Force at 1 MHz: it stands"]
    verdicts = [panel.get_title(loc="right") for panel in figure.axes[2:4]]
    assert verdicts == ["verdict: unstable, RMS 4.2 µm", "verdict: stable, at rest"]
    loops = [panel.texts[0].get_text() for panel in (left, right)]
    assert loops == [
        "levant: velocity at 10 kHz, force at 1 kHz, 1 ms late",
        "levant: velocity at 1 MHz, force at 1 MHz",
    ]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"judged": "undecided"}, "undecided"),
        ({"touched": False}, "never touched"),
        ({"judged": "stable"}, "it stands"),
    ],
)
def test_the_headline_of_a_hit_is_its_verdict(change, said):
    made = results.hit_beside()
    figure = hit_beside.draw(replace(made, hits=(replace(made.hits[0], **change), made.hits[1])))
    assert figure.axes[0].get_title(loc="left") == f"Force at 1 kHz: {said}"


def test_a_handle_that_stays_within_an_unstable_wall_buzzes():
    made = results.hit_beside()
    first = made.hits[0]
    inside = replace(first.overview, position_m=np.abs(first.overview.position_m))
    figure = hit_beside.draw(replace(made, hits=(replace(first, overview=inside), made.hits[1])))
    assert figure.axes[0].get_title(loc="left") == "Force at 1 kHz: it buzzes"


def test_a_film_goes_on_in_real_time_and_always_is_the_same(tmp_path, monkeypatch):
    monkeypatch.setattr(hit_beside, "FRAME_S", 0.5)
    made = results.hit_beside()
    for name in ("one.gif", "two.gif"):
        hit_beside.film(made, tmp_path / name)
    assert (tmp_path / "one.gif").read_bytes() == (tmp_path / "two.gif").read_bytes()
    with Image.open(tmp_path / "one.gif") as film:
        assert film.width == hit_beside.FILM_PX
        assert film.info["loop"] == 0
        lasts_ms = []
        for number in range(film.n_frames):
            film.seek(number)
            lasts_ms.append(film.info["duration"])
    end_ms = made.hits[0].overview.time_s[-1] * 1e3
    assert sum(lasts_ms) == pytest.approx(end_ms + hit_beside.HOLD_S * 1e3, abs=hit_beside.FRAME_S * 1e3)
    assert lasts_ms[-1] >= hit_beside.HOLD_S * 1e3


@pytest.mark.parametrize(("spread", "stiffer"), [(0.0, "at 1 MHz"), (4e4, "at 1 MHz"), (6e4, "at none")])
def test_the_rates_beside_errors_say_what_the_numbers_say(spread, stiffer):
    """What the intervals of the starts leave open is not said."""
    report = results.rate_gains().report()
    for label, method in zip(("butterworth", "levant u1"), report["methods"], strict=True):
        method |= {"label": label, "rates_hz": [1_000, 1_000_000]}
        stiffest = [2e5, 3e5] if label == "levant u1" else [1e5, 4e5]
        method["largest_stiffness_n_per_m"] = stiffest
        method["largest_stiffness_interval_n_per_m"] = [[k - spread, k + spread] for k in stiffest]
    first, second = rates.draw_beside_errors(errors_at_rates(), report).get_suptitle().split("\n")
    assert first == "From 1 kHz to 1 MHz the error of fdm grows 250 times, and levant u1 gets 20 times better"
    assert f"less error than levant u1 up to 1 kHz, and stiffer walls {stiffer}" in second


def test_the_whole_run_shows_what_happens_between_its_points():
    run = results.hit()
    (_, velocity, error, force), _ = columns(hit.draw(run))
    (drawn,) = error.collections
    rows = drawn.get_paths()[0].vertices
    assert rows[:, 1].min() == pytest.approx(run.overview.error_least_m_per_s.min() * 1e3)
    assert rows[:, 1].max() == pytest.approx(run.overview.error_largest_m_per_s.max() * 1e3)
    assert len(velocity.collections) == 1
    # A force that is the same between two points is a line.
    assert force.lines[0].get_ydata() == pytest.approx(run.overview.force_n)


def test_a_truth_that_a_noisy_estimate_would_hide_is_drawn_over_it():
    noisy = results.hit()
    for share, over in ((3.0, True), (0.01, False)):
        detail = noisy.detail
        estimate = detail.velocity_m_per_s + share * (detail.estimate_m_per_s - detail.velocity_m_per_s)
        _, (_, velocity, *_) = columns(hit.draw(replace(noisy, detail=replace(detail, estimate_m_per_s=estimate))))
        true, drawn = velocity.lines[:2]
        assert (true.get_label(), drawn.get_label()) == ("true", "estimate (levant u)")
        assert (true.get_zorder() > drawn.get_zorder()) is over
        assert true.get_linewidth() > 2 * drawn.get_linewidth() or over


@pytest.mark.parametrize("picture", ["replay", "figure 1"], indirect=True)
def test_the_estimate_lies_over_a_truth_that_is_broader(picture):
    for axes in picture.axes:
        if axes.get_ylabel().startswith("velocity"):
            true, estimate = axes.lines[0], axes.lines[-1]
            assert true.get_zorder() <= estimate.get_zorder()
            assert true.get_linewidth() > 2 * estimate.get_linewidth()


@pytest.mark.parametrize(("rms_m", "text"), [(0.0, "at rest"), (4.2e-6, "4.2 µm"), (1.234e-3, "1.23 mm")])
def test_a_hit_says_how_it_settled_in_digits_that_count(rms_m, text):
    title = hit.draw(results.hit(rms_m)).get_suptitle()
    assert text in title
    assert "0.0000" not in title


@pytest.mark.parametrize("picture", ["trade"], indirect=True)
def test_the_trade_names_the_settings_that_move_an_edge_most_and_chance_beside_them(picture):
    made = results.traded()
    rows = [text.get_text() for text in picture.axes[0].get_yticklabels()]
    *moving, control = trade.moving(made)
    assert rows == [point.shortcut.label for point in (*moving, control)]
    assert len(moving) == trade.ROWS
    assert control.shortcut.axis == SCATTER
    assert all(any(move.moved for move in point.moves.values()) for point in moving)
    assert not any(" + " in row for row in rows)
    title = picture.get_suptitle()
    most, least = (pick(move.area for point in moving for move in point.moves.values()) for pick in (max, min))
    assert f"({most:.2g} times the area)" in title
    assert f"({least:.2g} times)" in title


def test_an_area_that_is_far_from_the_others_is_on_the_panel():
    made = results.traded()
    far = made.points[3]
    far.moves["adjusted"] = far.moves["adjusted"]._replace(area=9.0, low=8.0, high=float("inf"))
    axes = trade.draw(made).axes[0]
    low, high = axes.get_xlim()
    assert low < trade.MOST < high < 2 * trade.MOST


def test_the_names_of_many_maps_are_beside_the_panel_and_below_the_title():
    picture = zwidth.draw(many_maps())
    lay_out(picture)
    (axes,) = picture.axes
    names, panel = axes.get_legend().get_window_extent(), axes.get_window_extent()
    assert names.x0 >= panel.x1
    assert names.y1 < picture._suptitle.get_window_extent().y0


@pytest.mark.parametrize("picture", ["zwidth"], indirect=True)
def test_the_passivity_limit_is_seen_or_said_to_be_absent(picture):
    absent = " ".join(text.get_text() for text in words(picture))
    assert "passive walls (Colgate, Schenkel): none on this map" in absent
    plain = results.map_of("fdm-500", 2e4, 200)
    viscous = replace(plain, case=plain.case.changed({"handle.viscous_n_s_per_m": 100.0}))
    seen = zwidth.draw(results.zwidth([viscous]))
    assert "below the dash-dotted line" in " ".join(text.get_text() for text in words(seen))
    assert "-." in [line.get_linestyle() for line in seen.axes[0].lines]


def test_a_loop_without_a_limit_has_no_line_and_is_named():
    """A line at infinity, or at the end of a search, would make the map a line upon the axis."""
    plain = results.map_of("fdm-500", 2e4, 200)
    coupled = replace(plain, case=plain.case.changed(COUPLING | {"amplifier": None}))
    axes = zwidth.draw(results.zwidth([coupled])).axes[0]
    said = " ".join(text.get_text() for text in words(axes.figure))
    assert f"no limit of the linear loop: {plain.case.label}" in said
    assert "behind 20 kN/m" in said
    assert ":" not in [line.get_linestyle() for line in axes.lines]
    assert axes.get_ylim()[1] < 1e3


@pytest.mark.parametrize("picture", ["zwidth"], indirect=True)
def test_the_border_of_a_map_is_drawn_where_the_map_ends(picture):
    axes = picture.axes[0]
    (border,) = [line for line in axes.lines if line.get_color() == zwidth.BORDER]
    assert list(zip(*border.get_data(), strict=True)) == [(6, 100), (300, 100), (300, 0)]


@pytest.mark.parametrize("picture", ["gains"], indirect=True)
def test_gains_with_several_names_are_named_once(picture):
    for axes in picture.axes[:4]:
        names = [text.get_text() for text in axes.texts]
        assert "best,\nwithin the condition" in names
        assert len(names) == len(set(names)) == 5


def test_a_circle_is_at_the_derived_width():
    by_width, by_logic = bits.draw(results.bits_dropped()).axes
    assert by_width.lines[0].get_xdata().tolist() == [20, 19, 18]
    assert [line.get_xdata()[0] for line in by_logic.lines[1::2]] == [1000, 500, 1500]
    assert np.isfinite([line.get_ydata()[0] for line in by_width.lines]).all()


@pytest.mark.parametrize("picture", ["costs"], indirect=True)
def test_a_panel_of_costs_has_every_board_that_fits_and_every_published_loop(picture):
    rows = results.costs_of_boards().rows
    for axes, device in zip(picture.axes, ("ecp5-25k", "ice40-up5k"), strict=True):
        placed = [row["board"] for row in rows if row["device"] == device and row["board"]]
        boards = {(board["lut4"], board["max_sample_hz"]) for board in placed}
        assert {tuple(line.get_xydata()[0]) for line in axes.lines if len(line.get_xdata()) == 1} == boards
        published = {line.get_ydata()[0] for line in axes.lines if len(line.get_xdata()) == 2}
        assert published == {loop.sample_hz for loop in LOOPS}
        low, high = axes.get_ylim()
        assert all(low < rate < high for rate in published | {rate for _, rate in boards})
    assert "too large for it: levant-adaptive" in picture.axes[1].get_title(loc="left")
