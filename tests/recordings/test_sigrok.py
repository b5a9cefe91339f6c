"""Sessions of sigrok that are refused, and channels at any bit."""

import io
import zipfile

import pytest

from hardwall.sim.recordings import capture
from hardwall.sim.recordings import sigrok as module
from hardwall.sim.recordings.sigrok import Sigrok
from stimuli.forms import edges, session


@pytest.mark.parametrize(
    ("metadata", "said"),
    [
        ({"samplerate": ""}, "its metadata must have a samplerate, such as 1 MHz"),
        ({"unitsize": "99"}, "its metadata must have a unitsize of 1 to 8, not '99'"),
        ({"capturefile": "elsewhere"}, "must have at least 2 samples, not 0"),
    ],
)
def test_sessions_that_are_refused(refused, metadata, said):
    assert said in refused(session(**metadata), None, 1000.0, file="spindle.sr")


def test_a_session_of_analogue_channels_is_refused(refused):
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as archive:
        archive.writestr("metadata", "[global]\nsigrok version=0.6.0\n")
    assert "has no logic channels: capture A and B as digital channels" in refused(file.getvalue(), None, 1.0)


def test_a_damaged_session_is_refused(refused):
    content = session()
    at = content.index(b"logic-1-1") + 60
    broken = content[:at] + bytes(20) + content[at + 20 :]
    assert "cannot be read as a session of sigrok (" in refused(broken, None, 1000.0, file="spindle.sr")
    assert "cannot be read as a ZIP (" in refused(content[: len(content) // 2], None, 1000.0, file="spindle.sr")


def test_channels_are_bits_by_their_numbers(tmp_path):
    path = tmp_path / "spindle.sr"
    path.write_bytes(session(unit=2, probe1="x", probe12="Z", probe2="y"))
    assert Sigrok("spindle.sr", path).channels == ["x", "y", "Z"]
    assert Sigrok("spindle.sr", path).changes([2]).ticks.tolist() == []


@pytest.mark.parametrize("unit", [1, 3, 8])
@pytest.mark.parametrize("turned", [False, True], ids=["in order", "turned"])
def test_pieces_go_by_their_numbers(read, unit, turned):
    """Piece 10 follows piece 9, wherever it is in the file, and a sample may be cut between two of them."""
    content = session(unit=unit, pieces=23)
    if turned:
        file = io.BytesIO()
        with zipfile.ZipFile(io.BytesIO(content)) as whole, zipfile.ZipFile(file, "w") as archive:
            for member in reversed(whole.namelist()):
                archive.writestr(member, whole.read(member))
        content = file.getvalue()
    found = read(content, None, 1000.0, file="spindle.sr")
    assert found.edges.counts.tolist() == edges()[2].tolist()
    assert found.edges.ticks.tolist() == edges()[0].tolist()


def test_changes_and_metadata_are_bounded(refused, monkeypatch):
    monkeypatch.setattr(capture, "CHANGES_MAX", 399)
    assert refused(session(), None, 1000.0, file="spindle.sr").endswith("must have at most 399 changes of its channels")
    monkeypatch.setattr(module, "METADATA_MAX", 100)
    assert refused(session(), None, 1000.0, file="spindle.sr").endswith("its metadata must have at most 100 bytes")
