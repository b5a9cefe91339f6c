"""Files that are read whole: what is no regular file, or too large, is refused at once."""

import os
import socket
import tracemalloc

import pytest

from hardwall.model.runtime.regular_file import content_of


def test_a_file_is_read_whole_up_to_its_bound(tmp_path):
    path = tmp_path / "file"
    path.write_bytes(b"12345")
    assert content_of(path, 5) == b"12345"
    with pytest.raises(OSError, match="it has more than 4e-06 MB"):
        content_of(path, 4)
    with pytest.raises(FileNotFoundError):
        content_of(tmp_path / "none", 5)


def test_a_small_file_takes_little_memory_whatever_its_bound(tmp_path):
    path = tmp_path / "file"
    path.write_bytes(b"12345")
    tracemalloc.start()
    try:
        assert content_of(path, 1 << 32) == b"12345"
        assert tracemalloc.get_traced_memory()[1] < 1 << 22
    finally:
        tracemalloc.stop()
    path.write_bytes(bytes(range(256)) * 20_000)
    assert content_of(path, 1 << 32) == path.read_bytes()


def test_what_has_no_end_or_no_writer_is_not_read(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # the path of a socket must be short
    os.mkfifo("pipe")
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind("socket")
        for path in ("/dev/zero", "pipe", "."):
            with pytest.raises(OSError, match="it is not a regular file"):
                content_of(path, 10)
        with pytest.raises(OSError, match="No such device"):
            content_of("socket", 10)
