"""The options of a recording, as `replay` and `accuracy` are called with them; what was understood is said."""

import json
import sys

import pytest

from hardwall.model.runtime.extras import absent
from stimuli.forms import COUNTS, SIZE_RAD, edges, session, sigrok_csv
from support import command_line
from support.command_line import call


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Return a folder with a swing of 2 s as angles every 2 ms, in semicolons and decimal commas, and with captures."""
    lines = [
        f"{2 * k};{f'{count * SIZE_RAD:.6f}'.replace('.', ',')}" for k, count in enumerate([*COUNTS, *COUNTS[::-1]])
    ]
    (tmp_path / "log.csv").write_text("Zeit;angle\n" + "\n".join(lines) + "\n")
    (tmp_path / "made.sr").write_bytes(session())
    (tmp_path / "made.csv").write_text(sigrok_csv())
    monkeypatch.chdir(tmp_path)
    return tmp_path


ANGLES = "--column", "angle", "--unit", "rad", "--count", "2pi/2000", "--time", "Zeit", "--time-unit", "ms"


def test_a_log_of_angles_is_replayed_by_one_command(monkeypatch, capsys, folder):
    code, out, err = call(monkeypatch, capsys, "replay", "log.csv", *ANGLES, "--json")
    report = json.loads(out)
    assert (code, report["rate_hz"], report["samples"]) == (0, 500.0, 1000)
    assert err.splitlines()[-1].startswith(
        "log.csv: text, separated by semicolons, decimal comma, names in line 1; rad, 0.00314"
    )
    assert "times in column Zeit (ms), 500 Hz" in err


@pytest.mark.parametrize("words", [["made.sr"], ["made.csv"], ["made.csv", "--channels", "A,B"]])
def test_a_capture_is_replayed_by_one_command(monkeypatch, capsys, folder, words):
    code, out, err = call(monkeypatch, capsys, "replay", *words, "--rate", "5000", "--estimator", "period", "--json")
    report = json.loads(out)
    assert (code, report["samples"], report["column"]) == (0, (edges()[0][-1] + 999) // 200 + 1, "A,B")
    assert report["clock_hz"] >= 1e6
    assert "A A, B B; 400 edges in" in err


def test_an_estimator_that_is_worse_than_the_difference_is_named(monkeypatch, capsys, folder):
    gains = [f"controller.gains.levant.{name}=1e-3" for name in ("lambda_sqrt_counts_per_s", "alpha_counts_per_s2")]
    slow = ["--set", gains[0].replace("1e-3", "100"), "--set", gains[1].replace("1e-3", "10")]
    code, _, err = call(monkeypatch, capsys, "replay", "log.csv", *ANGLES, *slow)
    assert code == 0
    assert "levant is worse than the plain difference on this recording: its RMS error is" in err
    code, _, err = call(monkeypatch, capsys, "replay", "log.csv", *ANGLES, "--estimator", "fdm")
    assert code == 0
    assert "worse" not in err


@pytest.mark.parametrize("signal", ["made.sr", "made.csv"])
def test_accuracy_takes_captures_by_their_file(monkeypatch, capsys, folder, fresh, signal):
    words = "--signal", signal, "--rate", "5000", "--estimators", "period,fdm", "--json"
    code, out, err = call(monkeypatch, capsys, "accuracy", *words)
    rows = json.loads(out)["rows"]
    assert (code, [row["signal"] for row in rows]) == (0, [f"{signal}:A,B"] * 2)
    assert "400 edges in" in err


def test_accuracy_takes_a_column_in_other_units(monkeypatch, capsys, folder, fresh):
    words = [*ANGLES[2:], "--estimators", "fdm", "--json"]
    code, out, _ = call(monkeypatch, capsys, "accuracy", "--signal", "log.csv:angle", *words)
    (row,) = json.loads(out)["rows"]
    assert (code, row["signal"], row["sample_hz"]) == (0, "log.csv:angle", 500.0)


def test_a_counter_of_a_turn_is_read_by_its_modulus(monkeypatch, capsys, folder):
    (folder / "turn.csv").write_text("counts\n" + "".join(f"{7 * k % 4000}\n" for k in range(2000)))
    words = ["turn.csv", "--column", "counts", "--rate", "1000", "--estimator", "fdm"]
    code, _, err = call(monkeypatch, capsys, "replay", *words)
    assert (code, "give the exact number, as --counter-modulus 4000" in " ".join(err.split())) == (2, True)
    code, _, err = call(monkeypatch, capsys, "replay", *words, "--counter-modulus", "4000")
    assert (code, "a counter of 4000 counts that wrapped 3 times" in err) == (0, True)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--column", "angle", "--rate", "500"], "say its unit and the size of a count (--unit, --count)"),
        (["--column", "angle", "--unit", "rad", "--time", "Zeit", "--time-unit", "ms"], "as --count 2pi/2000 would be"),
        (["--column", "angle", "--count", "1"], "--count needs --unit rad, deg, turns or m"),
        (["--column", "angle", "--unit", "rad", "--count", "x"], "--count must be a positive number, or as 360/40000"),
        (["--column", "angle", "--unit", "feet"], "--unit must be "),
        (["--column", "angle", "--gaps", "fill"], "--gaps must be "),
        (["--column", "angle", "--counter-bits", "7"], "--counter-bits must be "),
        (
            ["--column", "angle", "--counter-modulus", "3"],
            "--counter-modulus must be a whole number of 4 to 4611686018427387904, not '3'",
        ),
        (
            ["--column", "angle", "--counter-modulus", "9", "--counter-bits", "8"],
            "both the range of the counter: give one",
        ),
        (["--channels", "A"], "--channels must be two or three names or numbers, A,B or A,B,Z, not 'A'"),
        (
            ["--channels", "A,B", "--rate", "1", "--time", "Zeit"],
            "a channel must be one of angle, or a number of 1 to 1, not 'A'",
        ),
        (
            ["--set", "gains.x=1", "--column", "angle"],
            "--set 'gains.x' is not a key of a replay with levant, which has",
        ),
    ],
)
def test_options_that_are_refused(monkeypatch, capsys, folder, words, said):
    code, out, err = call(monkeypatch, capsys, "replay", "log.csv", *words)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert said in err


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--rate", "1000"], "--rate must be absent without a recording: the rates of known motions are --rates"),
        (["--rate", "1000", "--rates", "1e4"], "--rate must be absent without a recording"),
        (["--gaps", "hold", "--counter-bits", "16"], "--counter-bits, --gaps must be absent without a recording"),
        (["--signal", "hit", "--channels", "A,B"], "--channels must be absent without a recording"),
        (["--unit", "rad", "--count", "0.1"], "--unit, --count must be absent without a recording"),
    ],
)
def test_accuracy_refuses_options_of_a_recording_without_one(monkeypatch, capsys, folder, words, said):
    """They were taken, and changed nothing."""
    code, out, err = call(monkeypatch, capsys, "accuracy", *words)
    assert (code, out) == (2, "")
    (line,) = command_line.said(err)
    assert said in line


def test_without_the_extra_a_file_that_needs_it_names_it(monkeypatch, capsys, folder):
    (folder / "log.parquet").write_bytes(b"PAR1" + bytes(50))
    monkeypatch.setitem(sys.modules, "pyarrow.parquet", None)
    code, out, err = call(monkeypatch, capsys, "replay", "log.parquet", "--column", "x")
    assert (code, out) == (1, "")
    assert err == f"hardwall: error: {absent('pyarrow', 'data')}\n"
