"""The reports that pages of results are made of: whole, of the schema of their commands, and shown as they are."""

import json
import re
import sys
from dataclasses import replace

import pytest

from support.pages import PAGES, ROOT, command_line, text_of
from support.reports import check

sys.path.insert(0, str(ROOT / "docs"))

import for_readme
import reports
import views
from views.tables import number

WANTED = reports.wanted()
KEPT = {name: found for name in WANTED if (found := reports.kept(name))}


def test_every_report_that_is_wanted_is_kept_and_shown():
    assert {path.stem for path in reports.KEPT.iterdir()} == {*WANTED}
    pages = "".join(map(text_of, PAGES))
    pictures = {name: each.picture for name, each in WANTED.items()} | dict.fromkeys(for_readme.DRAWN, "rate-buys.png")
    assert [
        name for name in WANTED if not re.search(rf"%report {name} |pictures/{pictures[name] or '-'}\)", pages)
    ] == []


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
    assert len(for_readme.ROW.findall(text)) == 17
    assert for_readme.filled(text) == text
    assert for_readme.filled(text.replace("| 4.13 |", "| 5 |")) == text


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
    sources = reports.sources_of("accuracy --rates 1e3")
    assert {path.relative_to(ROOT).parts[0] for path in sources} == {"cli", "model", "sim"}
    assert [path.name for path in sources if path.is_relative_to(ROOT / "cli")] == ["accuracy.py"]
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


def test_numbers_have_as_many_digits_as_matter():
    assert [number(value) for value in (131.38, 0.0851, 4.1312, 12345.6)] == ["131", "0.0851", "4.13", "12300"]


def test_a_page_shows_a_report_where_it_comes_from_and_that_it_is_stale(monkeypatch):
    monkeypatch.setattr(reports, "is_stale", lambda wanted: False)
    lines = views.shown("accuracy", "errors-by-rate")
    assert lines[0].count("|") == lines[1].count("|") == 6
    (row,) = (line for line in lines if line.startswith("| `kalman` u | "))
    errors = [each["rms_mm_s"] for each in KEPT["accuracy"].report["rows"] if each["estimator"] == "kalman"]
    shown = [float(cell) for cell in row.strip("| ").split(" | ")[1:]]
    assert sorted(shown) == pytest.approx(sorted(errors), rel=5e-3)
    assert f"`{KEPT['accuracy'].command}`, version {KEPT['accuracy'].version}" in lines[-2]
    assert "Stale" not in lines[-2]
    monkeypatch.setattr(reports, "is_stale", lambda wanted: True)
    assert "**Stale: its sources have changed since.**" in views.shown("accuracy", "errors-by-rate")[-2]


def test_a_report_that_is_not_known_is_not_shown(monkeypatch):
    for name, view, said in (
        ("none", "errors-by-rate", "no such report"),
        ("accuracy", "none", "the view must be one"),
    ):
        with pytest.raises(views.UnknownError, match=said):
            views.shown(name, view)
    wrong = replace(KEPT["accuracy"], report={"rows": [{}]})
    monkeypatch.setattr(reports, "kept", lambda name: wrong)
    with pytest.raises(views.UnknownError, match=r"^accuracy: \$\.rows"):
        views.shown("accuracy", "errors-by-rate")
