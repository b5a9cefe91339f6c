"""Text files: compressed, damaged, with lines that are too long, and columns by number."""

import gzip

import pytest

from hardwall.sim.recordings import text as module
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
