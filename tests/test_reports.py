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
    assert len(for_readme.ROW.findall(text)) == 13
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


def test_the_estimators_that_a_report_names_are_its_sources():
    said = {"maps": [{"label": "a", "estimator": "mt"}], "area": {"kalman": 1.0}}
    for command, found in (
        ("zwidth", {"kalman", "mt", "levant"}),
        ("zwidth --estimators foaw", {"foaw", "kalman", "mt"}),
    ):
        sources = {path.stem for path in reports.sources_of(command, said)}
        assert found <= sources
        assert not {"butterworth", "tracking_loop"} & sources
    # A command of every estimator has the next one, too.
    assert {"butterworth", "tracking_loop"} <= {path.stem for path in reports.sources_of("bench", said)}
    assert {"butterworth", "tracking_loop"} <= {path.stem for path in reports.sources_of("zwidth")}


def test_what_only_people_read_is_no_part_of_an_origin():
    first, same, other = (
        f"def f(x: Annotated[int, Option(help={text!r}, min={least})]):\n"
        f"    if x > {least}:\n        raise ValueError(f'{text}, not {{x}}') from None\n    return x\n"
        for text, least in (("the length", 1), ("how long it is", 1), ("the length", 2))
    )
    code = [reports._read(source.encode(), "hardwall")[0] for source in (first, same, other)]
    assert code[0] == code[1] != code[2]


def test_what_only_shows_is_no_source_and_the_hardware_only_of_what_runs_it():
    sources = reports.sources_of("accuracy --rates 1e3")
    assert {path.relative_to(ROOT).parts[0] for path in sources} == {"cli", "model", "sim"}
    assert [path.name for path in sources if path.is_relative_to(ROOT / "cli")] == ["accuracy.py"]
    assert ROOT / "model/estimators/kalman.py" in reports.sources_of("accuracy")
    assert ROOT / "sim/estimates/accuracy.py" in set(sources) - set(reports.sources_of("zwidth"))
    assert ROOT / "hdl/axis/axis.py" in reports.sources_of("accuracy --backend rtl")
    assert ROOT / "hdl/axis/axis.py" in reports.sources_of("bench")


def test_what_reads_recordings_is_a_source_only_of_a_command_that_names_one():
    room = ROOT / "sim/recordings"
    for command, reads in (
        ("accuracy --signal paper", False),
        ("accuracy --signal README.md:count", True),
        ("replay README.md --column count", True),
        ("zwidth docs/results/tuned.toml", False),
    ):
        assert any(path.is_relative_to(room) for path in reports.sources_of(command)) == reads


@pytest.mark.parametrize(
    ("command", "own", "others"),
    [
        ("accuracy", {"kalman", "levant", "mt", "tracking_loop"}, set()),
        ("rendered --estimators all", {"kalman", "levant", "mt", "tracking_loop"}, set()),
        ("accuracy --estimators kalman,foaw:best-fit", {"kalman", "foaw", "levant"}, {"mt", "tracking_loop"}),
        ("zwidth --estimators adjusted,fdm-500", {"levant", "butterworth"}, {"kalman", "mt", "tracking_loop"}),
    ],
)
def test_an_estimator_that_a_command_does_not_name_is_no_source(command, own, others):
    for room, of in (("model", command), ("hdl", f"{command} --backend rtl")):
        found = {path.stem for path in reports.sources_of(of) if path.is_relative_to(ROOT / room / "estimators")}
        assert own <= found
        assert not others & found
        assert ("registry" in found) == (not others)


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


def test_every_table_of_a_page_is_whole_and_narrow(monkeypatch):
    # Whether a report is stale is in no table, and takes a look at all its sources.
    monkeypatch.setattr(reports, "is_stale", lambda wanted: False)
    for names, view in re.findall(r"^%report (.*) ([\w-]+)%$", "\n".join(map(text_of, PAGES)), re.MULTILINE):
        rows = [line for line in views.shown(names.split(), view) if line.startswith("|")]
        assert len({row.count("|") for row in rows}) == 1, view
        assert len(rows) > 2, view
        assert rows[0].count("|") <= 10, view


def cells(names: list[str], view: str) -> dict[str, list[str]]:
    """Return the cells of a view's table by the first of their row, without what marks them."""
    rows = [line.strip("| ").split(" | ") for line in views.shown(names, view) if line.startswith("|")][2:]
    return {row[0].strip("`"): [re.sub(r"[*+`]| \(.*| %$", "", cell) for cell in row[1:]] for row in rows}


def close(text: str, value: float) -> bool:
    """Return whether a number of two digits or more is the one that is expected."""
    return float(text) == pytest.approx(value, rel=5e-2, abs=5e-3)


def test_a_row_of_a_device_has_its_name_and_the_areas_of_its_own_report():
    wanted = {
        "weak-damping-3": "`seed-2011`",
        "weak-damping-bristles": "`seed-2011`, on bristles",
        "weak-damping-encoder-2": "`seed-2011`, encoder 2 with errors",
        "weak-damping-drive": "`drive-2011`",
    }
    rows = [line.strip("| ").split(" | ") for line in views.shown([*wanted], "conditions") if line.startswith("|")][2:]
    for (name, called), (device, *areas) in zip(wanted.items(), rows, strict=True):
        assert device == called
        maps = KEPT[name].report["maps"]
        for area, of in zip(areas, maps, strict=True):
            assert close(area.split(" (")[0].rstrip("+"), of["area_n2_s_per_m2"] / 1000)


def test_tables_of_walls_have_the_numbers_of_their_reports():
    found = {each["label"]: each for each in KEPT["estimators-map"].report["maps"]}
    table = cells(["estimators-map"], "regions")
    assert [*table] == sorted(found, key=lambda label: -found[label]["area_n2_s_per_m2"])
    for label, (area, share, stiffest, end) in table.items():
        of = found[label]
        assert close(area, of["area_n2_s_per_m2"] / 1000)
        assert close(share, 100 * of["area_held_n2_s_per_m2"] / of["area_n2_s_per_m2"])
        assert close(stiffest, of["largest_stiffness_n_per_m"] / 1000)
        assert close(end, max(damping for damping, stiffness, *_ in of["boundary"] if stiffness))
    names = ["cutoff", "cutoff-without-friction"]
    for name, row in zip(names, cells(names, "cutoffs").values(), strict=True):
        (device,) = KEPT[name].report["devices"]
        assert int(row[0]) == round(device["best_cutoff_hz"])
        best = max(each["area_n2_s_per_m2"] for each in device["maps"])
        assert close(row[2], best / 1000)
        assert close(row[3], device["unfiltered"]["area_n2_s_per_m2"] / 1000)
    for fact, row in zip(KEPT["figure-5"].report["facts"], cells(["figure-5", "fit"], "facts").values(), strict=True):
        assert close(row[0], 100 * fact["share"])


def test_equal_verdicts_are_counted_wall_by_wall(monkeypatch):
    """Also if some are not equal: then one wall less."""
    names = ["map-rtl", "map-fixed"]
    table = cells(names, "same-verdicts")
    assert all(walls == equal and int(walls) > 10 for *_, walls, equal in table.values())
    changed = json.loads(json.dumps(KEPT["map-rtl"].report))
    changed["maps"][0]["p_stable"][0][2] -= 1
    monkeypatch.setattr(
        views, "_kept", lambda name: replace(KEPT[name], report=changed) if name == "map-rtl" else KEPT[name]
    )
    (*_, walls, equal), *others = cells(names, "same-verdicts").values()
    assert int(equal) == int(walls) - 1
    assert all(row[-2] == row[-1] for row in others)


def test_tables_of_hardware_have_the_numbers_of_their_reports():
    table = cells(["costs"], "costs")
    for row in KEPT["costs"].report["rows"]:
        own = table[row["estimator"]]
        assert own[:3] == [str(row[key]) for key in ("latency_clocks", "lut4", "dsp")]
        assert row["board"] is None or close(own[-1], row["board"]["max_sample_hz"] / 1e6)
    for each in (KEPT[name].report for name in ("synth-ecp5", "synth-ice40", "synth-gowin")):
        row = cells(["synth-ecp5", "synth-ice40", "synth-gowin"], "placed")[each["device"]]
        assert row[0] == f"{each['lut4']} of {each['available']['lut4']}"
        assert close(row[-2], each["pin_to_force_ns"])
        assert close(row[-1], each["max_sample_hz"] / 1e6)
    for row in KEPT["axes"].report["rows"]:
        own = cells(["axes"], "axes")[str(row["axes"])]
        assert close(own[3], row["fmax_mhz"])
        assert close(own[6], row["axes"] * row["max_sample_hz"] / 1e6)
    rows = {(f"{row['estimator']}` {row['output']}", row["bits_dropped"]): row for row in KEPT["bits"].report["rows"]}
    for name, own in cells(["bits"], "bits").items():
        whole, less = rows[name, 0], rows[name, 6]
        assert close(own[2], less["rms_mm_s"] / whole["rms_mm_s"])
        assert int(own[-1]) == round(100 - 100 * less["lut4"] / whole["lut4"])


def test_tables_of_time_have_the_numbers_of_their_reports():
    bench, trade = KEPT["bench"].report, KEPT["trade-direct"].report
    for name, (rate, _) in cells(["bench"], "speed").items():
        number_of, unit = rate.split()
        assert close(number_of, bench["samples_per_s"][name] / {"M": 1e6, "k": 1e3}[unit])
    for part, (time,) in cells(["bench"], "costs-of-parts").items():
        assert close(time, bench["ns_per_sample_of_parts"][part])
    settings = {each["label"]: each for each in trade["settings"]}
    for label, (hit, times, *areas) in cells(["trade-direct"], "shortcuts").items():
        assert close(hit, 1000 * settings[label]["hit_s"])
        assert close(times, trade["settings"][0]["hit_s"] / settings[label]["hit_s"])
        moves = settings[label]["moves"].values()
        assert all(close(area, move["area_ratio"]) for area, move in zip(areas, moves, strict=True))


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
