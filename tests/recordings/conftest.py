"""Recordings from lines of text, and the messages of those that are refused."""

import pytest

from hardwall.sim.recordings.error import RecordingError
from hardwall.sim.recordings.load import load
from hardwall.sim.recordings.recording import Reading


@pytest.fixture
def read(tmp_path):
    """Return a function that loads a column of a file of the given text, bytes or lines after a header; further
    arguments are fields of `Reading`."""

    def load_text(content, column="counts", rate_hz=None, header="time_s,counts", file="spindle.csv", **reading):
        path = tmp_path / file
        if isinstance(content, list):
            content = "\n".join([header, *content]) + "\n"
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return load(path, column, rate_hz, Reading(**reading))

    return load_text


@pytest.fixture
def refused(read):
    """Return a function that gives the message for a refused file, which is always one line that names the file."""

    def message(*args, **kwargs):
        with pytest.raises(RecordingError) as caught:
            read(*args, **kwargs)
        text = str(caught.value)
        assert "\n" not in text
        assert "spindle" in text
        return text

    return message
