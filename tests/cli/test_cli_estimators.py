"""The commands that compare estimators: their output, the input that they refuse, and interrupted runs."""

import json
import math
import signal

import pytest

from hardwall.model.runtime.build_folder import build_dir
from hardwall.sim.studies import accuracy
from stimuli.lengths import LONG
from support.command_line import call, said
from support.processes import HARDWALL, ended_by, session, started, stored, wait_until

KEYS = {
    "estimator", "output", "backend", "sample_hz", "signal", "rms_mm_s", "max_mm_s", "delay_s", "chatter_mm_s",
}  # fmt: skip
SHORT = ["--estimators", "fdm,levant:u1", "--rates", "1e3,2000"]


def test_rows_as_json_and_as_a_table(monkeypatch, capsys):
    arguments = ["accuracy", *SHORT, "--workers", 1, "--signal", "hit", "--signal", "steady:10"]
    code, out, err = call(monkeypatch, capsys, *arguments, "--json")
    assert (code, said(err)) == (0, [])
    rows = json.loads(out)["rows"]
    assert len(rows) == 8
    assert all(set(row) >= KEYS for row in rows)
    assert {(row["estimator"], row["output"]) for row in rows} == {("fdm", "u"), ("levant", "u1")}
    assert [row["delay_s"] is None for row in rows] == [row["signal"] == "steady:10" for row in rows]
    code, out, err = call(monkeypatch, capsys, *arguments)
    assert (code, said(err)) == (0, [])
    assert "levant u1" in out
    assert "mm/s" in out


def test_the_errors_of_the_encoder_are_in_rows_and_beside_the_table(monkeypatch, capsys):
    arguments = ["accuracy", "--estimators", "fdm", "--rates", "1e4", "--signal", "steady:10", "--workers", 1]
    own = ["--set", "encoder.edge_error_counts=0.15", "--set", "encoder.hysteresis_counts=0.5"]
    row = json.loads(call(monkeypatch, capsys, *arguments, *own, "--json")[1])["rows"][0]
    assert row["encoder"] == {"edge_error_counts": 0.15, "hysteresis_counts": 0.5}
    assert row["encoder_phase_error_counts"] == 0
    _, out, err = call(monkeypatch, capsys, *arguments, *own, "--encoder-phase-error", "0.1")
    assert "encoder: edge_error_counts 0.15, hysteresis_counts 0.5, phase_error_counts 0.1" in out + err
    plain = json.loads(call(monkeypatch, capsys, *arguments, "--json")[1])["rows"][0]
    assert "encoder" not in plain
    assert plain["rms_mm_s"] != row["rms_mm_s"]


def test_fixed_is_rtl(monkeypatch, capsys):
    arguments = ["accuracy", "--estimators", "fdm", "--rates", "1e4", "--signal", "hit", "--workers", 1, "--json"]
    fixed, rtl = (
        json.loads(call(monkeypatch, capsys, *arguments, "--backend", each)[1])["rows"][0] for each in ("fixed", "rtl")
    )
    assert {**fixed, "backend": "rtl"} == rtl


# The curves of the second are nine loops to compile; their figures and their picture have shorter tests of their own.
@pytest.mark.parametrize("figure", [1, 2] if LONG else [1])
def test_figures_are_drawn(monkeypatch, capsys, tmp_path, figure):
    picture = tmp_path / "figure.svg"
    few = [] if figure == 1 else ["--rates", "1e3,2e3"]
    arguments = ["accuracy", "--figure", figure, *few, "--plot", picture, "--workers", 1, "--json"]
    code, out, _ = call(monkeypatch, capsys, *arguments)
    assert code == 0
    rows, text = json.loads(out)["rows"], picture.read_text()
    if figure == 1:
        assert {row["sample_hz"] for row in rows} == {10_000}
        wanted = ("velocity (mm/s)", "time (s)", "exact derivative", "Levant u, adjusted gains")
    else:
        assert {row["sample_hz"] for row in rows} == {1_000, 2_000}
        wanted = ("RMS error (mm/s)", "sample rate (Hz)", "butterworth, 0.1 fs", "levant u, proposed gains", "2√(ε/C)")
    assert [label for label in wanted if label not in text] == []


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["accuracy", "--signal", "noise"], "--signal: signal must be one of paper, "),
        (["accuracy", "--figure", "3"], "--figure must be a whole number of 1 to 2, not '3'"),
        (["accuracy", "--figure", "2", "--signal", "hit"], "--figure 2 has a signal of its own"),
        (["accuracy", "--estimators", "nobody"], "--estimators: estimator must be one of fdm, "),
        (["accuracy", "--estimators", "levant:v"], "--estimators: output of levant must be one of u, u1, not 'v'"),
        (["accuracy", "--rates", "1e2"], "--rates must be whole numbers of 1000 to 1e+07 Hz, not '1e2'"),
        (["accuracy", "--rates", "1e3,fast"], "--rates must be whole numbers of 1000 to 1e+07 Hz, not 'fast'"),
        (["accuracy", "--rates", ""], "--rates must be whole numbers of 1000 to 1e+07 Hz, not ''"),
        (["accuracy", "--rates", "nan"], "--rates must be whole numbers of 1000 to 1e+07 Hz, not 'nan'"),
        (["accuracy", "--encoder-phase-error", "2"], "phase_error_counts and duty_error_counts must leave each edge"),
        (
            ["accuracy", "--encoder-phase-error", "0.1", "--set", "encoder.phase_error_counts=0.1"],
            "--encoder-phase-error must be absent beside --set encoder.phase_error_counts: both set the same error",
        ),
        (["accuracy", "--set", "handle.mass_kg=1"], "--set must be of an error of the encoder, encoder.KEY=VALUE, not"),
        (["accuracy", "--set", "encoder.count_m=1e-5"], "--set must be of an error of the encoder, encoder.KEY=VALUE,"),
        (["accuracy", "--set", "encoder.cycles=[{edges=1,error_counts=0.1}]"], "mhz: encoder.cycles[0].edges must be"),
        (["choose", "--set", "encoder.dead=a"], "mhz: encoder.dead_s is missing, which encoder.dead needs"),
        (["accuracy", "--acceleration-max", "0"], "--acceleration-max must be 1e-09 to 1e+06 m/s^2"),
        (["accuracy", "--acceleration-max", "nan"], "--acceleration-max must be 1e-09 to 1e+06 m/s^2"),
        (["accuracy", "--jerk-max", "0"], "--jerk-max must be 1e-09 to 1e+12 m/s^3"),
        (
            ["accuracy", "--jerk-max", "1e-9", "--estimators", "levant-2", "--rates", "2e3"],
            "levant-2 at 2000 Hz with C 1.67848 m/s^2: jerk_m_per_s3 must be 1.45519e-08 to 500 ",
        ),
        (["accuracy", "--acceleration-max", "1e-9", *SHORT], "levant at 2000 Hz with C 1e-09 m/s^2: "),
        (["accuracy", "--signal", "none.csv:a:b", "--estimators", "fdm"], "none.csv: there is no such file"),
        (["accuracy", "--signal", "none.csv:counts", "--rates", "1e3"], "--rates, --encoder-phase-error, --acceler"),
        (["accuracy", "--figure", "1", "--rates", "1e3,1e4", "--plot", "a.png"], "--figure 1 is drawn at one rate of"),
        (["accuracy", "--signal", "none.csv:counts", "--plot", "a.png"], "--plot draws the error of one known motion"),
        (["accuracy", "--plot", "a.gif"], "--plot must end in .pdf or .png or .svg, not 'a.gif'"),
        (["choose", "--rate", "1"], "--rate must be whole numbers of 1000 to 1e+07 Hz, not '1.0'"),
        (["bits", "--estimators", ""], "--estimators: estimator must be one of fdm, "),
        (["axes", "--estimators", "kalman"], "--estimators must be of fdm, levant, window, not 'kalman'"),
        (["axes", "--axes", "8,33"], "--axes must be whole numbers of 1 to 32, not '33'"),
        (["axes", "--axes", ""], "--axes must be whole numbers of 1 to 32, not ''"),
        (
            ["costs", "--device", "z80"],
            "--device must be one of ecp5-12k, ecp5-25k, ecp5-45k, ecp5-85k, ice40-up5k, gw1nr-9, not 'z80'",
        ),
    ],
)
def test_bad_input_is_one_line(monkeypatch, capsys, tmp_path, arguments, message):
    monkeypatch.chdir(tmp_path)
    code, out, err = call(monkeypatch, capsys, *arguments)
    assert (code, out) == (2, "")
    assert err.startswith(f"hardwall: error: {message}")
    assert err.count("\n") == 1


@pytest.mark.parametrize(
    ("high", "estimators", "said"),
    [
        (10**9, "fdm,levant-edge", "for levant-edge, which times edges, the count must change by at most 100000 of 16"),
        (0, "all", "levant-edge cannot take this recording, for no gains fit its acceleration of 3.55556 counts/s^2"),
    ],
)
def test_a_recording_that_cannot_be_taken_is_refused_before_any_work(
    monkeypatch, capsys, tmp_path, high, estimators, said
):
    monkeypatch.chdir(tmp_path)
    rows = (f"{number / 1000:.3f},{number % 2 * high}\n" for number in range(3000))
    (tmp_path / "made.csv").write_text("time_s,c\n" + "".join(rows))
    for name in ("measure", "measure_recording"):
        monkeypatch.setattr(f"hardwall.sim.studies.accuracy.{name}", lambda **_: pytest.fail("it measures"))
    signals = ("--signal", "paper", "--signal", "made.csv:c")
    code, out, err = call(
        monkeypatch, capsys, "accuracy", *signals, "--rates", "1e4", "--estimators", estimators, "--workers", 1
    )
    assert (code, out) == (2, "")
    assert err.startswith(f"hardwall: error: made.csv, column c: {said}")
    assert err.count("\n") == 1


def test_a_recording_that_changes_meanwhile_counts_as_it_was_read(monkeypatch, capsys, tmp_path, fresh):
    """What is stored under the digest of a file is of the bytes with that digest."""
    file, plan = tmp_path / "made.csv", accuracy.plan

    def recorded(height: int) -> str:
        rows = (f"{number / 1000:.3f},{round(height * math.sin(number / 100))}\n" for number in range(3000))
        return "time_s,c\n" + "".join(rows)

    def row() -> dict:
        words = ("accuracy", "--signal", f"{file}:c", "--estimators", "fdm", "--workers", 1, "--json")
        code, out, err = call(monkeypatch, capsys, *words)
        assert code == 0, err
        return json.loads(out)["rows"][0]

    def planned(*arguments: object) -> object:
        file.write_text(recorded(9000))
        return plan(*arguments)

    file.write_text(recorded(3000))
    with monkeypatch.context() as patch:
        patch.setattr(accuracy, "plan", planned)
        low = row()
    assert row()["acceleration_max_counts_s2"] > 2 * low["acceleration_max_counts_s2"]
    file.write_text(recorded(3000))
    (stored,) = (tmp_path / "build" / "results").iterdir()
    assert row() == low, "from the store"
    stored.unlink()
    assert row() == low, "computed again"


def test_an_interrupted_run_loses_nothing_and_ends_its_workers(tmp_path):
    command = [HARDWALL, "accuracy", "--estimators", "fdm", "--rates", "1e3,1e4,1e5,1e6,1e7", "--workers", "2"]
    (tmp_path / "numba").symlink_to(build_dir() / "numba")
    with started(*command, HARDWALL_BUILD=str(tmp_path)) as run:
        wait_until(lambda: len(stored(tmp_path)) > 1)
        run.send_signal(signal.SIGTERM)
        out, before, remark = ended_by("SIGTERM", run)
        wait_until(lambda: session(run) == [])
    assert (out, "Traceback" in before) == ("", False)
    assert remark.endswith(" kept, and the same command goes on from there")
    assert all(len(json.loads(line)) == 3 for line in stored(tmp_path))
