"""VCD files that are refused, and names of wires in scopes."""

import sys

import pytest

from hardwall.sim.recordings import capture
from hardwall.sim.recordings.vcd_file import Vcd
from stimuli.forms import edges, vcd

pytest.importorskip("vcd", reason="the extra [data] is not installed")


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("$timescale 1 us $end\n", "$comment x $end\n", "must have a timescale, and wires of one bit"),
        ("wire 1 ", "wire 4 ", "must have a timescale, and wires of one bit"),
        ("$scope module", "$scope nothing", "is not VCD ("),
        ("#100\n0!", "#100\nx!", "its channels have no levels"),
    ],
)
def test_files_that_are_refused(refused, old, new, said):
    text = vcd().replace(old, new)
    if "levels" in said:
        text = text[: text.index("#100\n") + len("#100\nx!\n")]
    assert said in refused(text, None, 1000.0, file="spindle.vcd")


def test_a_level_that_is_lost_is_refused_by_its_time(refused):
    text = vcd()
    first = f"#{edges()[0][0] + 100}"
    said = f"at {first}: a level must be 0 or 1 once all are known, not 'x'"
    assert said in refused(text.replace(f"{first}\n1!", f"{first}\nx!"), None, 1000.0, file="spindle.vcd")


@pytest.mark.parametrize("time", ["#x", "#-1", f"#{10**30}", "#"])
def test_times_that_are_none_are_refused(refused, time):
    text = vcd() + f"{time}\n1!\n"
    assert "a time must be a number of at most 18 digits, not" in refused(text, None, 1000.0, file="spindle.vcd")


def test_comments_vectors_and_blocks_are_no_changes(read):
    """A word of a comment, or the code of a vector, may look like a change."""
    plain = read(vcd(), None, 1000.0, file="spindle.vcd")
    noise = "$comment 1! 0# #5 $end b1 ! r0.5 # $dumpvars $end\n"
    first = f"#{edges()[0][5] + 100}\n"
    found = read(vcd().replace(first, first + noise), None, 1000.0, file="spindle.vcd")
    assert found.content == plain.content


def test_wires_of_one_name_have_their_scopes(tmp_path):
    path = tmp_path / "made.vcd"
    text = vcd().replace("$upscope $end", "$upscope $end\n$scope module b $end\n$var wire 1 ' A $end\n$upscope $end")
    path.write_text(text)
    assert Vcd("made.vcd", path).channels == ["A", "B", "b.A"]


def test_the_capture_begins_where_all_levels_are_known(read):
    found = read(vcd(), None, 1000.0, file="spindle.vcd")
    assert found.start_s == 100e-6
    assert found.edges.ticks[0] == edges()[0][0]


def test_without_the_extra_its_module_is_named(read, monkeypatch):
    monkeypatch.setitem(sys.modules, "vcd.reader", None)
    with pytest.raises(ModuleNotFoundError) as error:
        read(vcd(), None, 1000.0, file="spindle.vcd")
    assert error.value.name == "pyvcd"


def test_of_several_changes_at_one_time_the_last_levels_count(read):
    """A simulator writes the steps between two settled levels, too."""
    plain = read(vcd(), None, 1000.0, file="spindle.vcd")
    first, second = (edges()[0][place] + 100 for place in (0, 1))
    noise = vcd().replace(f"#{first}\n", f"#{first}\n1!\n1#\n0!\n0#\n").replace(f"#{second}\n", f"#{second}\n0!\n1!\n")
    assert noise != vcd()
    assert read(noise, None, 1000.0, file="spindle.vcd").content == plain.content


def test_changes_are_bounded(refused, monkeypatch):
    monkeypatch.setattr(capture, "CHANGES_MAX", 399)
    said = refused(vcd(), None, 1000.0, file="spindle.vcd")
    assert said.endswith("must have at most 399 changes of its channels")
