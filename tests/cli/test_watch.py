"""The command `watch`, with a board in simulation: samples as lines and in a file, whatever ends it."""

import csv
import json
import signal
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import pytest

from hardwall.host.samples import COLUMNS
from stimuli.lengths import LONG
from support.command_line import call
from support.processes import HARDWALL, ended, started, wait_until
from support.reports import check_text
from support.virtual_boards import PACE, SCENE, VirtualBoard, running

AT = "--pace", PACE
RATE_HZ = 20.0
ENDS = {"SIGINT": 130, "SIGTERM": 143, "SIGKILL": -9}
"""The signals that end it, each with its exit code; another test interrupts it, too."""


@pytest.fixture(scope="module")
def virtual() -> Iterator[VirtualBoard]:
    with running(SCENE, "--tcp", "0", "--speed", str(2 * PACE)) as board:
        yield board


def rows_of(path: Path) -> list[dict[str, str]]:
    """Return the rows of a file of samples, all of whose lines must be whole."""
    text = path.read_text()
    assert text.endswith("\n")
    rows = list(csv.reader(text.splitlines()))
    assert tuple(rows[0]) == COLUMNS
    assert {len(row) for row in rows} == {len(COLUMNS)}
    return [dict(zip(COLUMNS, row, strict=True)) for row in rows[1:]]


def missed_in(rows: list[dict[str, str]]) -> int:
    return sum(int(row["missed"]) for row in rows)


def test_samples_are_lines_of_json_and_of_a_file(virtual, monkeypatch, capsys, tmp_path):
    file = tmp_path / "new" / "log.csv"
    words = "watch", virtual.path, "--rate", RATE_HZ, "--seconds", "1", "--json", "--csv", file, *AT
    code, out, err = call(monkeypatch, capsys, *words)
    assert code == 0, err
    *samples, end = map(json.loads, out.splitlines())
    rows = rows_of(file)
    assert [float(row["time_s"]) for row in rows] == [sample["time_s"] for sample in samples]
    assert {sample["state"] for sample in samples} <= {"DISARMED", "TRIPPED", None}
    # Every sample that was due is there, or is counted as missed.
    assert end["samples"] + end["missed"] == RATE_HZ
    assert end["missed"] == missed_in(rows) == sum(sample["missed"] for sample in samples)
    assert err.splitlines()[-1].startswith(f"{end['samples']} samples at 20 Hz, {end['missed']} missed")


def test_what_a_silent_board_misses_is_said(virtual, tmp_path):
    file = tmp_path / "log.csv"
    with started(HARDWALL, "watch", virtual.path, "--rate", RATE_HZ, "--csv", file, *AT) as process:
        wait_until(lambda: file.exists() and len(rows_of(file)) > 3)
        virtual.order("drop 400")
        wait_until(lambda: any(not row["state"] for row in rows_of(file)))
        virtual.order("drop 1")
        wait_until(lambda: rows_of(file)[-1]["state"])
        process.send_signal(signal.SIGINT)
        code, out, err = ended(process)
    assert code == 130, err
    rows = rows_of(file)
    assert missed_in(rows) > 0
    first = next(place for place, row in enumerate(rows) if not row["state"])
    assert int(rows[first]["missed"]) >= 1
    assert "SILENT" in out or first < RATE_HZ
    assert f"{len([row for row in rows if row['state']])} samples at 20 Hz, {missed_in(rows)} missed: " in err


@pytest.mark.parametrize(
    ("way", "code"), ENDS.items() if LONG else [(way, ENDS[way]) for way in ("SIGTERM", "SIGKILL")]
)
def test_however_it_is_ended_what_was_sampled_is_there(virtual, tmp_path, way, code):
    file = tmp_path / "log.csv"
    words = "watch", virtual.path, "--rate", "100", "--csv", file, "--json", *AT
    with started(HARDWALL, *words) as process:
        wait_until(lambda: file.exists() and len(rows_of(file)) > 10)
        process.send_signal(signal.Signals[way])
        found, out, err = ended(process)
    assert found == code, err
    rows = rows_of(file)
    times = [float(row["time_s"]) for row in rows]
    assert all(before < after for before, after in pairwise(times))
    lines = out.splitlines()
    if way == "SIGKILL":
        check_text("watch", "\n".join(lines[:-1] if not out.endswith("\n") else lines))
        return
    assert out.endswith("\n")
    check_text("watch", out)
    end = json.loads(lines[-1])
    assert end["missed"] >= missed_in(rows)
    assert len(lines) - 1 in (len(rows), len(rows) - 1)
    assert f"{end['samples']} samples at 100 Hz, " in err.splitlines()[-1]


def test_a_reader_that_goes_ends_it_in_silence(virtual):
    with started(HARDWALL, "watch", virtual.path, "--rate", "50", "--json", *AT) as process:
        assert json.loads(process.stdout.readline())["missed"] == 0
        process.stdout.close()
        assert process.wait(60) == 141
        assert process.stderr.read() == ""


def test_a_file_that_is_there_is_refused(virtual, monkeypatch, capsys, tmp_path):
    monkeypatch.chdir(tmp_path)
    file = Path("log.csv")
    file.write_text("of before")
    for words, said in (
        (["--csv", file], "--csv must be a new file, not 'log.csv', which exists"),
        (["--csv", "log.txt"], "--csv must end in .csv, not 'log.txt'"),
        (["--rate", "0"], "--rate must be 0.001 to 1000 Hz, not 0.0"),
        (["--rate", "nan"], "--rate must be 0.001 to 1000 Hz, not nan"),
    ):
        code, out, err = call(monkeypatch, capsys, "watch", virtual.path, *words, *AT)
        assert (code, out, err) == (2, "", f"hardwall: error: {said}\n")
    assert file.read_text() == "of before"
