"""The reports that pages of results are made of: whole, of the schema of their commands, and shown as they are."""

import json
import sys

import pytest

from support.pages import PAGES, ROOT, command_line, text_of
from support.reports import check

sys.path.insert(0, str(ROOT / "docs"))

import in_readme
import reports
import views

WANTED = reports.wanted()
KEPT = {name: found for name in WANTED if (found := reports.kept(name))}


def test_every_report_that_is_kept_is_wanted_and_shown():
    files = {path.stem for path in reports.KEPT.iterdir()}
    assert files == {*KEPT}
    pages = "".join(text_of(name) for name in PAGES if name.startswith("docs/"))
    pictures = {name: f"pictures/{each.picture})" for name, each in WANTED.items() if each.picture}
    shown = [name for name in WANTED if f"%report {name} " in pages or pictures.get(name, "none") in pages]
    assert shown == [*WANTED]


@pytest.mark.parametrize("name", KEPT)
def test_a_report_is_of_its_command(name):
    found = KEPT[name]
    check(found.command.split()[1], found.report)
    assert found.seconds > 0
    assert found.date >= "2026-11-28"


@pytest.mark.parametrize("name", WANTED)
def test_the_words_of_a_command_are_accepted(name):
    group = command_line()
    context = group.make_context("hardwall", [], resilient_parsing=True)
    called, command, options = group.resolve_command(context, WANTED[name].words)
    command.make_context(called, options, parent=context)


def test_the_readme_has_the_numbers_of_the_report():
    text = text_of("README.md")
    assert len(in_readme.ROW.findall(text)) == 17
    assert in_readme.filled(text) == text
    assert in_readme.filled(text.replace("| 4.13 |", "| 5 |")) == text


def test_a_report_is_stale_if_its_code_or_its_command_has_changed(monkeypatch, tmp_path):
    monkeypatch.setattr(reports, "KEPT", tmp_path)
    wanted = reports.Wanted("fast", "accuracy --rates 1e3")
    assert reports.is_stale(wanted)
    kept = {
        "command": "hardwall accuracy --rates 1e3", "version": "1", "date": "2026-11-28", "machine": "1 core",
        "origin": reports.origin(wanted.command), "seconds": 1.0, "report": {},
    }  # fmt: skip
    file = tmp_path / "fast.json"
    file.write_text(json.dumps(kept))
    assert not reports.is_stale(wanted)
    assert reports.is_stale(reports.Wanted("fast", "accuracy --rates 2e3"))
    file.write_text(json.dumps(kept | {"origin": "another"}))
    assert reports.is_stale(wanted)


def test_what_only_shows_is_no_source_and_the_hardware_only_of_what_runs_it():
    rooms = {path.relative_to(ROOT).parts[0] for path in reports.sources_of("accuracy --rates 1e3")}
    assert rooms == {"model", "sim"}
    assert ROOT / "model/estimators/kalman.py" in reports.sources_of("accuracy")
    assert ROOT / "hdl/axis/axis.py" in reports.sources_of("accuracy --backend rtl")
    assert ROOT / "hdl/axis/axis.py" in reports.sources_of("bench")


def test_a_command_that_fails_leaves_no_report(monkeypatch, tmp_path):
    monkeypatch.setattr(reports, "KEPT", tmp_path)
    with pytest.raises(reports.subprocess.CalledProcessError):
        reports.make(reports.Wanted("none", "accuracy --rates 0"))
    assert [*tmp_path.iterdir()] == []


def test_a_report_is_kept_with_where_it_comes_from(monkeypatch, tmp_path):
    monkeypatch.setattr(reports, "KEPT", tmp_path)
    wanted = reports.Wanted("few", "accuracy --estimators fdm --rates 1e3")
    made = reports.make(wanted)
    assert made == reports.kept("few")
    assert (made.command, made.origin) == (f"hardwall {wanted.command}", reports.origin(wanted.command))
    assert [row["estimator"] for row in made.report["rows"]] == ["fdm"]


def test_views_show_numbers_with_as_many_digits_as_matter():
    assert [views.number(value) for value in (131.38, 0.0851, 4.1312, 12345.6)] == ["131", "0.0851", "4.13", "12300"]
    assert [views.rate(value) for value in (1e6, 10e3, 500)] == ["1 MHz", "10 kHz", "500 Hz"]
    lines = views.errors_by_rate(KEPT["accuracy"].report)
    assert lines[0].count("|") == lines[1].count("|") == 6
    assert any(line.startswith("| `kalman` u | ") for line in lines)


def test_areas_are_shown_with_their_interval():
    each = {
        "label": "kalman u", "area_n2_s_per_m2": 30.6e6, "area_low_n2_s_per_m2": 30.1e6, "area_high_n2_s_per_m2": 31e6,
        "largest_stiffness_n_per_m": 123e3,
    }  # fmt: skip
    assert views.areas({"maps": [each]})[2] == "| kalman u | 30600 | 30100 to 31000 | 123 |"
