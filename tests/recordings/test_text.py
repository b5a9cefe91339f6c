"""Text files: compressed, damaged, with lines that are too long, columns by number, and both ways to read rows."""

import csv
import gzip
from unittest import mock

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hardwall.sim.recordings import text as module
from hardwall.sim.recordings.error import RecordingError
from stimuli.forms import COUNTS, rows

TEXT = "\n".join(["time_s,counts", *rows()]) + "\n"


def test_a_compressed_file_is_read_whatever_its_name(read):
    for file in ("spindle.csv.gz", "spindle.csv"):
        assert (read(gzip.compress(TEXT.encode()), file=file).counts == COUNTS).all()


def test_a_damaged_compressed_file_is_refused(refused):
    packed = gzip.compress(TEXT.encode())
    assert "its gzip is damaged, or ends early" in refused(packed[: len(packed) // 2])
    assert "its gzip is damaged, or ends early" in refused(packed[:-8] + bytes(8))


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_lines_may_end_in_any_way(read, end):
    assert (read(TEXT.replace("\n", end)).counts == COUNTS).all()


def test_a_byte_order_mark_is_no_part_of_a_name(read):
    assert (read("\ufeff" + TEXT).counts == COUNTS).all()


def test_columns_are_found_by_number_where_no_name_fits(read, refused):
    assert (read(TEXT, "2").counts == COUNTS).all()
    assert read(TEXT, "2").column == "counts"
    assert read("2,1\n5,6\n7,8\n", "2", rate_hz=10).counts.tolist() == [1, 6, 8]
    assert read("x,1\n5,6\n7,8\n", "1", rate_hz=10).counts.tolist() == [6, 8]  # the name comes first
    assert "line 1: column must be one of time_s, counts, not '3'" in refused(TEXT, "3")
    bare = "\n".join(rows())
    assert "has no line with names, so column must be a number of 1 to 2, not 'counts'" in refused(bare)
    assert "not '0'" in refused(bare, "0")


def test_a_line_without_end_is_refused_before_it_fills_the_memory(refused, monkeypatch):
    monkeypatch.setattr(module, "LINE_MAX", 100)
    assert "line 3: must have at most 100 characters, not" in refused(["0.000,1", f"0.001,{'1' * 200}"])


def test_chunks_join_at_their_ends(read, monkeypatch):
    monkeypatch.setattr(module, "CHUNK", 7)
    found = read(TEXT)
    assert (found.counts == COUNTS).all()
    assert found.rate_hz == 1000.0


def test_a_row_with_other_cells_is_refused_by_its_line(refused):
    assert "line 3: must have 2 cells as the first, not 3" in refused("1,2\n3,4\n5,6,7\n", "1", rate_hz=1)
    assert "line 3: must have 2 cells as the header, not 1" in refused("a b\n3 4\n5\n", "a", rate_hz=1)


def test_any_number_of_comments_may_stand_before_the_first_row(read, refused, monkeypatch):
    """With 200 of them, the file was said to be empty."""
    comments = "# a remark\n\n" * 300
    assert (read(comments + TEXT).counts == COUNTS).all()
    assert (read(comments + "# time_s,counts\n" + "\n".join(rows())).counts == COUNTS).all()
    monkeypatch.setattr(module, "ABOVE_MAX", 599)
    assert "must have a row of data within its first 599 lines" in refused(comments + TEXT)


def test_a_text_in_the_first_row_costs_no_sample(read):
    lines = [f"{row},{'moves' if k % 7 else 'rests'}" for k, row in enumerate(rows())]
    found = read("\n".join(lines), "2", time="1", time_unit="s")
    assert (found.counts == COUNTS).all()


CELLS = st.sampled_from(
    ["0", "1", "-12", "1.5", "", " ", " 7", "8 ", "a", '"9"', '"', "\t", "#", "2/3", "1,5", "\x85", "é"]
)
LINES = st.one_of(
    st.tuples(CELLS, CELLS),
    st.lists(CELLS, max_size=3).map(tuple),
    st.sampled_from([("1", "2"), ("", ""), (" ", "")]),
)


def columns(path, by_row: bool) -> list | str:
    """Return the rows that are read of a file, with their lines, or the refusal."""
    with mock.patch.object(module, "CHUNK", 3):
        try:
            table = module.Text("file", path)
            if by_row:
                table._columns = lambda lines, places: None
            return [
                row for lines, cells in table.chunks([0, 1][: table.width]) for row in zip(lines, *cells, strict=True)
            ]
        except RecordingError as error:
            return str(error)


@given(
    st.sampled_from([",", ";", "\t", " "]),
    st.sampled_from(["", "t,x", "t x", "# t;x"]),
    st.lists(LINES, max_size=12),
    st.sampled_from(["", "\n", "\n\n", "\r\n"]),
)
def test_whole_chunks_and_single_rows_are_read_alike(tmp_path_factory, separator, above, lines, end):
    path = tmp_path_factory.getbasetemp() / "alike.csv"
    # Plain rows first, so that a chunk is read at once before another is read by its rows.
    path.write_text("\n".join([above, *([separator.join("12")] * 4), *map(separator.join, lines)]) + end)
    assert columns(path, by_row=False) == columns(path, by_row=True)


def test_a_cell_longer_than_csv_allows_is_refused_both_ways(tmp_path):
    path = tmp_path / "long.csv"
    path.write_text("1,2,3\n" * 5 + f"1,2,{'3' * (csv.field_size_limit() + 1)}\n")
    at_once = columns(path, by_row=False)
    assert at_once == columns(path, by_row=True)
    assert "line 6: is not CSV (field larger than field limit" in at_once


def test_plain_rows_are_read_at_once_and_others_by_the_row(tmp_path):
    path = tmp_path / "rows.csv"
    for text, at_once in (
        ("1,2\n" * 9, True),
        ("1 2\n" * 9, True),
        ("1,2\n" * 8 + '1,"2"\n', False),
        ("1, 2\n" * 9, True),
    ):
        path.write_text(text)
        with mock.patch.object(module.Text, "_rows", side_effect=AssertionError) as by_row:
            try:
                list(module.Text("file", path).chunks([0]))
            except AssertionError:
                assert by_row.called
        assert by_row.called != at_once
