"""The table of reports: a row for each hit, and for each axis of several."""

import json

import pytest

from hardwall.sim.scene.tables import load_any
from hardwall.sim.walls import hit_axes
from stimuli.scenes import SHORT_OF_AXES
from support.command_line import call


@pytest.fixture(scope="module")
def report() -> dict:
    """Return the report of a hit of several axes."""
    return hit_axes.run(load_any("eight-axes", SHORT_OF_AXES), "float").report()


def test_every_axis_has_a_row(monkeypatch, capsys, tmp_path, report):
    (tmp_path / "r.json").write_text(json.dumps(report))
    code, out, _ = call(monkeypatch, capsys, "table", tmp_path / "r.json", tmp_path / "r.json")
    assert code == 0
    for row in report["rows"]:
        assert out.count(row["axis"]) == 2


@pytest.mark.parametrize(
    ("rows", "said"),
    [
        ([], "rows: List should have at least 1 item"),
        ([{}] * 33, "rows: List should have at most 32 items"),
        (5, "rows: "),
        ([{"axis": 5}], "rows.0."),
    ],
)
def test_rows_that_are_none_are_refused(monkeypatch, capsys, tmp_path, report, rows, said):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "r.json").write_text(json.dumps(report | {"rows": rows}))
    code, out, err = call(monkeypatch, capsys, "table", "r.json")
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert f"is none: {said}" in err
