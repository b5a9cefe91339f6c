"""A file of samples: whole lines, whatever ends its program."""

import csv
import errno
import os
import re
from contextlib import closing

import numpy as np
import pytest

from hardwall.host.sample_file import SampleFile
from hardwall.host.samples import COLUMNS, Sample, Samples
from hardwall.host.status import State


def test_a_file_is_read_as_it_was_written(board, axis, tmp_path):
    board.show(state=State.ARMED, flags=3, count=5)
    sample = next(Samples(axis))
    with closing(SampleFile(tmp_path / "log.csv")) as file:
        file.add(sample)
        file.add(Sample(1.5, 2.5, None, 7))
    with (tmp_path / "log.csv").open(newline="") as text:
        first, second = csv.DictReader(text)
    assert tuple(first) == COLUMNS
    assert float(first["position_m"]) == sample.status.position_m
    assert (first["state"], first["flags"]) == ("ARMED", "encoder_illegal encoder_overspeed")
    assert (first["live"], second["live"], second["missed"]) == ("0", "", "7")
    assert first["acceleration_m_per_s2"] == ""
    # Numbers alone are read by what reads numbers.
    read = np.genfromtxt(tmp_path / "log.csv", delimiter=",", names=True, usecols=("time_s", "force_n", "missed"))
    assert np.isnan(read["force_n"]).tolist() == [False, True]


def test_a_file_that_is_there_is_not_touched(tmp_path):
    (tmp_path / "log.csv").write_text("of before")
    with pytest.raises(OSError, match=re.escape("log.csv: cannot be written (File exists)")):
        SampleFile(tmp_path / "log.csv")
    assert (tmp_path / "log.csv").read_text() == "of before"


@pytest.mark.parametrize("room", [0, 10])
def test_a_full_disk_leaves_whole_lines(monkeypatch, tmp_path, room):
    write = os.write

    def full(file: int, data: bytes) -> int:
        if not room:
            raise OSError(errno.ENOSPC, "No space left on device")
        return write(file, data[:room])

    with closing(SampleFile(tmp_path / "log.csv")) as file:
        file.add(Sample(1.0, 2.0, None, 1))
        before = (tmp_path / "log.csv").read_bytes()
        monkeypatch.setattr(os, "write", full)
        with pytest.raises(OSError, match=r"log.csv: cannot be written \((the disk is full|No space left on device)\)"):
            file.add(Sample(1.5, 2.5, None, 1))
        monkeypatch.undo()
    assert (tmp_path / "log.csv").read_bytes() == before
    assert len(before.splitlines()) == 2
