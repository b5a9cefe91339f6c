"""The looks of text files: separators, decimal commas, comments, and lines that name columns or do not."""

import pytest

from hardwall.sim.recordings.dialect import dialect_of
from stimuli.forms import COUNTS, rows


@pytest.mark.parametrize("separator", [",", ";", "\t", " ", "   ", ", ", ",\t", " ; "])
@pytest.mark.parametrize("named", [True, False], ids=["names", "no names"])
def test_every_separator_is_found_with_names_and_without(read, separator, named):
    lines = list(rows(separator))
    if named:
        found = read(lines, header=separator.join(["time_s", "counts"]))
    else:
        found = read("\n".join(lines), "2", time="1", time_unit="s")
    assert (found.counts == COUNTS).all()
    assert found.rate_hz == 1000.0
    word = {",": "commas", ";": "semicolons", "\t": "tabs", "": "spaces"}[separator.strip(" ")[:1]]
    assert f"separated by {word}" in found.notes[0]
    assert ("names in line 1" in found.notes[0]) == named


@pytest.mark.parametrize("separator", [";", "\t", " "])
@pytest.mark.parametrize("named", [True, False], ids=["names", "no names"])
def test_a_decimal_comma_is_found_where_no_comma_separates(read, separator, named):
    lines = list(rows(separator, ","))
    if named:
        found = read(lines, header=f"time_s{separator}counts")
    else:
        found = read("\n".join(lines), "2", time="1", time_unit="s")
    assert (found.counts == COUNTS).all()
    assert found.rate_hz == 1000.0
    assert "decimal comma" in found.notes[0]


@pytest.mark.parametrize("mark", ["#", "# ", "% ", "// ", "  # "])
def test_comments_are_passed_over_wherever_they_are(read, mark):
    lines = list(rows())
    lines[200:200] = [f"{mark}a remark, with a comma"]
    found = read("\n".join([f"{mark}made by a robot", "", "time_s,counts", *lines]))
    assert (found.counts == COUNTS).all()
    assert "names in line 3" in found.notes[0]


@pytest.mark.parametrize("mark", ["#", "% "])
def test_the_last_comment_may_name_the_columns(read, mark):
    """NumPy and MATLAB write the names so."""
    found = read("\n".join([f"{mark}made by a robot", f"{mark}time_s,counts", *rows()]))
    assert (found.counts == COUNTS).all()
    assert "names in line 2" in found.notes[0]


def test_numbers_in_a_comment_name_nothing():
    assert dialect_of(["# 1,2", "3,4", "5,6"]).names == []


def test_a_comment_of_sigrok_names_columns_that_are_logic():
    said = ["; Channels (2/8): left, right", "; Samplerate: 24 MHz", "logic,logic", "0,1"]
    found = dialect_of(said)
    assert (found.names, found.rate_hz, found.skipped) == (["left", "right"], 24e6, 3)
    said[2] = "Time,logic,logic"
    assert dialect_of([*said[:3], "0.1,0,1"]).names == ["Time", "left", "right"]
    said[2] = "one,two"
    assert dialect_of(said).names == ["one", "two"]


@pytest.mark.parametrize(
    ("text", "rate"),
    [
        ("1e+06Hz", 1e6),
        ("100 kHz", 1e5),
        ("250Hz", 250.0),
        ("fast", None),
        ("0 Hz", None),
        ("1.2.3 MHz", None),
        ("1e400 Hz", None),
    ],
)
def test_a_comment_may_state_the_rate(text, rate):
    assert dialect_of([f"#Sample rate: {text}", "A,B", "0,1"]).rate_hz == rate


def test_files_of_nothing_have_no_dialect():
    assert dialect_of([]) is None
    assert dialect_of(["", "# a comment"]) is None


@pytest.mark.parametrize(
    ("lines", "names"),
    [
        (["0.000,1,ok", "0.001,2,ok"], []),
        (["0,1,ok", "1,2,late"], []),
        (["0.000,start,1", "0.001,2,2"], []),
        (["-1,start", "2,3"], []),
        (["2024-05-01T12:00:00,start", "2024-05-01T12:00:01,2"], []),
        (["---,1", "2,3"], []),
        (["n/a;1", "2;3"], []),
        (["0 ? 3", "1 2 4"], []),
        (["x,1", "5,6"], ["x", "1"]),
        (["x,1,note", "5,6,ok"], ["x", "1", "note"]),
        (["x,1,note", "5,6,"], ["x", "1", "note"]),
        (["x,note", "5,ok"], ["x", "note"]),
        (["x,1"], ["x", "1"]),
        (["a b 3", "1 2 4"], ["a", "b", "3"]),
    ],
)
def test_a_row_with_a_text_is_no_line_of_names(lines, names):
    """The first row of a log with a column of texts was taken for names, and lost."""
    assert dialect_of(lines).names == names
    assert dialect_of(lines).skipped == (1 if names else 0)
