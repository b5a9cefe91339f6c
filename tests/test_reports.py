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
    shown = {name for line in re.findall(r"^%report (.*) [\w-]+%$", pages, re.MULTILINE) for name in line.split()}
    shown |= {for_readme.FILLED} | {name for name, picture in pictures.items() if f"pictures/{picture})" in pages}
    assert {*WANTED} == shown


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
    lines = views.shown(["situations"], "situations")
    assert lines[0].count("|") == lines[1].count("|") == 8
    (row,) = (line for line in lines if line.startswith("| `kalman` | "))
    errors = [each["rms_mm_s"] for each in KEPT["situations"].report["rows"] if each["estimator"] == "kalman"]
    assert [float(cell) for cell in row.strip("| ").split(" | ")[1:-1]] == pytest.approx(errors, rel=5e-2)
    assert f"`{KEPT['situations'].command}`, version {KEPT['situations'].version}" in lines[-2]
    assert not any("Stale" in line for line in lines)
    monkeypatch.setattr(reports, "is_stale", lambda wanted: True)
    assert "**Stale: its sources have changed since.**" in views.shown(["situations"], "situations")


def test_a_table_of_several_reports_names_the_commands_by_what_differs(monkeypatch):
    monkeypatch.setattr(reports, "is_stale", lambda wanted: wanted.name == "friction-twice")
    names = ["friction-usual", "friction-half", "friction-twice"]
    lines = views.shown(names, "frictions")
    assert lines[0].count("|") == len(KEPT[names[0]].report["maps"]) + 2
    assert [line.split("|")[1].strip() for line in lines[2:5]] == ["the scene's, 0.1 N", "0.05 N", "0.2 N"]
    (made,) = (line for line in lines if line.startswith("*`"))
    assert f"`{KEPT[names[0]].command}`" in made
    assert made.endswith("Also with `handle.coulomb_n=0.05`, `handle.coulomb_n=0.2`.*")
    assert lines[-2] == "**Stale: its sources have changed since.**"


def test_every_table_of_a_page_is_whole_and_narrow():
    for names, view in re.findall(r"^%report (.*) ([\w-]+)%$", "\n".join(map(text_of, PAGES)), re.MULTILINE):
        rows = [line for line in views.shown(names.split(), view) if line.startswith("|")]
        assert len({row.count("|") for row in rows}) == 1, view
        assert len(rows) > 2, view
        assert rows[0].count("|") <= 10, view


def test_a_report_that_is_not_known_is_not_shown(monkeypatch):
    for name, view, said in (
        ("none", "situations", "no such report"),
        ("accuracy", "none", "the view must be one"),
    ):
        with pytest.raises(views.UnknownError, match=said):
            views.shown([name], view)
    wrong = replace(KEPT["accuracy"], report={"rows": [{}]})
    monkeypatch.setattr(reports, "kept", lambda name: wrong)
    with pytest.raises(views.UnknownError, match=r"^accuracy: \$\.rows"):
        views.shown(["accuracy"], "situations")
