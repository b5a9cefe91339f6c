"""The command line: its output, and one line for every bad input with the fault, its place and the accepted values."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from hardwall.cli.terminal import show
from hardwall.model.runtime.result import Table
from hardwall.sim.scene import load
from stimuli.scenes import SHORT_OF_AXES
from support.command_line import call

SEED = (load.FOLDER / "seed-2011.toml").read_text()
STIFFNESS = "0, or 1.95313 (half of its word's LSB) to 200000 (what the controller is for)"
DAMPING = "0, or 0.003125 (half of its word's LSB) to 400 (what the controller is for)"
"""What the wall of the scene `seed-2011` may be."""
OF_ONE_AXIS_ALONE = (
    "assumptions",
    "bench",
    "cutoff",
    "drop",
    "fit",
    "gains",
    "lipschitz",
    "mass",
    "rates",
    "response",
    "trade",
    "verilog",
    "zwidth",
)
"""Commands that take a scene of one axis."""


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["hit", "no-such"], f"scene must be one of {', '.join(load.names())}, or a .toml file, not 'no-such'"),
        (
            ["hit", "no-such.toml"],
            f"scene must be one of {', '.join(load.names())}, or a .toml file, not 'no-such.toml'",
        ),
        (
            ["hit", "--set", "handle.mas_kg=1"],
            "seed-2011: handle.mas_kg is not a key of a scene; did you mean mass_kg?",
        ),
        (["hit", "--set", "handel.mass_kg=1"], "handel is not a key of a scene; did you mean handle?"),
        (["hit", "--set", "handle.mass_kg=-1"], "seed-2011: handle.mass_kg must be a number of 1e-06 to 1000, not -1"),
        (["hit", "--set", "handle.mass_kg=heavy"], "handle.mass_kg must be a number of 1e-06 to 1000, not 'heavy'"),
        (["hit", "--set", "handle.mass_kg=nan"], "handle.mass_kg must be a number of 1e-06 to 1000, not nan"),
        (["hit", "--set", "handle.mass_kg="], "handle.mass_kg is missing"),
        (["hit", "--set", "handle"], "--set must be KEY=VALUE, not 'handle'"),
        (["hit", "--set", "controller.sample_hz=7000"], "controller.sample_hz must divide clock_hz 12000000, not 7000"),
        (
            ["hit", "--set", "controller.sample_hz=0.5"],
            "controller.sample_hz must be a whole number of 1 to 1e+09, not 0.5",
        ),
        (
            ["hit", "--set", "controller.gains.levant.alpha_m_per_s2=1e9"],
            "controller.gains.levant.alpha_m_per_s2 must be 9.31323e-08 to 51200 at these rates, not 1000000000.0",
        ),
        (["hit", "--stiffness", "1e9"], f"wall.stiffness_n_per_m must be {STIFFNESS}, not 1000000000.0"),
        (["hit", "--stiffness", "250e3"], f"wall.stiffness_n_per_m must be {STIFFNESS}, not 250000.0"),
        (["hit", "--stiffness", "1e-6"], f"wall.stiffness_n_per_m must be {STIFFNESS}, not 1e-06"),
        (["hit", "--stiffness", "1e11"], f"wall.stiffness_n_per_m must be {STIFFNESS}, not 100000000000.0"),
        (
            ["hit", "--set", "protocol.settle_s=5e5"],
            "protocol.settle_s must be at most 100000, 1e+09 samples, not 500000.0",
        ),
        (
            ["hit", "--set", "protocol.measure_s=1e-9"],
            "protocol.measure_s must be at least one sample of 0.0001 s, not 1e-09",
        ),
        (["hit", "--set", "amplifier.delay_s=5.0"], "amplifier.delay_s must be at most protocol.settle_s, 4, not 5.0"),
        (
            ["hit", "--set", "controller.gains.fdm.x=1"],
            "controller.gains.fdm.x is not a key of a scene; its section has",
        ),
        (["hit", "--stiffness", "-5"], f"wall.stiffness_n_per_m must be {STIFFNESS}, not -5.0"),
        (["hit", "--stiffness", "nan"], f"wall.stiffness_n_per_m must be {STIFFNESS}, not nan"),
        (["hit", "--stiffness", "-5", "--set", "handle.mass_kg=0"], "handle.mass_kg must be a number of 1e-06 to 1000"),
        (["hit", "--damping", "1e6"], f"wall.damping_n_s_per_m must be {DAMPING}, not 1000000.0"),
        (["hit", "--damping", "405"], f"wall.damping_n_s_per_m must be {DAMPING}, not 405.0"),
        (["hit", "--damping", "1e-6"], f"wall.damping_n_s_per_m must be {DAMPING}, not 1e-06"),
        (
            ["hit", "--set", "controller.slew_limit_n_per_s=1e15"],
            "controller.slew_limit_n_per_s must be 0.5 (half of its word's LSB) to ",
        ),
        (
            ["hit", "--set", "controller.speed_max_m_per_s=20.0"],
            "controller.speed_max_m_per_s must be at most 8, the decoder's limit",
        ),
        (["hit", "--set", "encoder.phase_error_counts=0.99"], "encoder.phase_error_counts and duty_error_counts must"),
        (
            ["hit", "--set", "encoder.phase_error_counts=[1,2]"],
            "encoder.phase_error_counts must be a number of -1 to 1, or a list of 4, each a number of -1 to 1, not",
        ),
        (["hit", "--output", "u7"], "controller.output must be one of u, u1, not 'u7'"),
        (["hit", "--estimator", "fdm", "--output", "u1"], "controller.output must be one of u, not 'u1'"),
        (["hit", "--estimator", "nobody"], "--estimator must be one of fdm, levant, "),
        (["hit", "--backend", "vhdl"], "--backend must be one of float, fixed, rtl, not 'vhdl'"),
        (["hit", "--stiffness", "stiff"], "--stiffness"),
        (["hit", "--plot", "hit.bmp"], "--plot must end in .pdf or .png or .svg or .gif, not 'hit.bmp'"),
        (["hit", "--trace", "hit.vcd"], "--trace must end in .fst or .npz, not 'hit.vcd'"),
        (["hit", "--plot", "/proc/none/hit.png"], "--plot '/proc/none/hit.png' cannot be written"),
        (["hit", "--trace", "hit.fst", "--backend", "fixed"], "--trace hit.fst needs --backend rtl"),
        (["hit", "--set", "amplifier.delay_s=1.5e-5"], "amplifier.delay_s must be a whole number of samples"),
        (
            ["hit", "--set", "protocol.start_m=-9.0"],
            "protocol.start_m must be less than 0 and at least -0.15, for controller.travel_m, not -9.0",
        ),
        (
            ["hit", "--set", "protocol.mean_s=9.0"],
            "protocol.mean_s must be at most protocol.settle_s, 4, not 9.0",
        ),
        (
            ["table", "no-such.json"],
            "'no-such.json' must be a JSON report of `hardwall hit --json`, and is none: No such file",
        ),
        (["hit", "--beside", "no-such"], "scene must be one of "),
        (["hit", "--beside", "eight-axes"], "--beside needs scenes of one axis: eight-axes has several"),
        (["hit", "eight-axes", "--beside", "mhz"], "--beside needs scenes of one axis: eight-axes has several"),
        (["hit", "--beside", "mhz", "--trace", "a.npz"], "--trace must be absent with --beside"),
        (["hit", "--plot", "a.gif"], "--plot a.gif needs --beside: only hits side by side are drawn in motion"),
        (["rates", "--plot", "a.gif"], "--plot must end in .pdf or .png or .svg, not 'a.gif'"),
        (["shoot"], "the command must be one of hit, replay, "),
    ],
)
def test_bad_input_is_one_line_and_exit_code_2(monkeypatch, capsys, tmp_path, arguments, message):
    monkeypatch.chdir(tmp_path)
    code, out, err = call(monkeypatch, capsys, *arguments)
    assert message in err
    assert err.startswith("hardwall: error: ")
    assert err.count("\n") == 1
    assert out == ""
    assert code == 2
    assert not list(tmp_path.iterdir()), "nothing is left behind"


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "scene.toml: handle is missing"),
        (b"[handle\n", "scene.toml: must be a readable TOML file: Expected"),
        (b"\xff\xfe", "scene must be a .toml file of UTF-8 text, not 'scene.toml'"),
        (SEED.replace("mass_kg", "mass").encode(), "scene.toml: handle.mass is not a key of a scene"),
        (
            SEED.replace("mass_kg = 0.35", "mass_kg = 'a'").encode(),
            "scene.toml: handle.mass_kg must be a number of 1e-06 to 1000, not 'a'",
        ),
        (b"handle = 3\n", "scene.toml: handle must be a section, not 3"),
    ],
)
def test_bad_scene_files_are_named(monkeypatch, capsys, tmp_path, content, message):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scene.toml").write_bytes(content)
    code, out, err = call(monkeypatch, capsys, "hit", "scene.toml")
    assert message in err
    assert err.count("\n") == 1
    assert (code, out) == (2, "")


def test_a_replay_does_not_overwrite_its_recording(monkeypatch, capsys, tmp_path):
    file = tmp_path / "recording.csv"
    file.write_text("counts\n" + "0\n" * 9)
    code, out, err = call(monkeypatch, capsys, "replay", file, "--column", "counts", "--rate", "1000", "--out", file)
    assert "--out must be another file than the recording" in err
    assert (code, out) == (2, "")
    assert file.read_text().startswith("counts\n")
    code, _, err = call(monkeypatch, capsys, "replay", file, "--column", "counts", "--rate", "1e-300")
    assert (code, err.count("\n")) == (2, 1)


def test_a_name_with_markup_is_only_a_name(monkeypatch, capsys, tmp_path):
    file = tmp_path / "[red]x.toml"
    file.write_text(SEED)
    code, out, _ = call(monkeypatch, capsys, "hit", file, "--backend", "float")
    assert code == 0
    assert "[red]x" in out


def test_a_scene_file_of_ones_own_runs(monkeypatch, capsys, tmp_path):
    file = tmp_path / "mine.toml"
    file.write_text(SEED)
    code, out, _ = call(monkeypatch, capsys, "hit", file, "--json", "--backend", "float")
    report = json.loads(out)
    assert code == 0
    assert report["scene"] == "mine"


def test_json_has_the_promised_keys_and_nothing_else_is_on_stdout(monkeypatch, capsys):
    code, out, _ = call(monkeypatch, capsys, "hit", "--json", "--estimator", "levant", "--output", "u1")
    report = json.loads(out)
    assert code == 0
    assert set(report) == {
        "scene", "backend", "estimator", "output", "stiffness_n_per_m", "damping_n_s_per_m", "stable", "verdict",
        "touched", "rms_mm", "mean_mm", "offset_mm", "drift_mm_per_s",
        "samples", "seconds", "samples_per_s", "max_force_n", "estimate_rms_mm_per_s", "flags",
        "force_sha256",
    }  # fmt: skip
    assert (report["output"], report["backend"], report["samples"]) == ("u1", "fixed", 60_000)


def test_several_axes_are_hit_and_have_rows_a_picture_and_traces(monkeypatch, capsys, tmp_path):
    short = [f"--set={key}={value}" for key, value in SHORT_OF_AXES.items()]
    picture, traces = tmp_path / "axes.svg", tmp_path / "axes.npz"
    files = ["--plot", picture, "--trace", traces]
    code, out, _ = call(monkeypatch, capsys, "hit", "eight-axes", "--json", "--damping", "30", *short, *files)
    assert code == 0
    rows = json.loads(out)["rows"]
    assert len(rows) == 8
    assert {row["damping_n_s_per_m"] for row in rows} == {30.0}
    for name in ("base", "grip"):
        assert name in picture.read_text()
    with np.load(traces) as arrays:
        assert json.loads(str(arrays["report"]))["rows"] == rows
    code, out, _ = call(monkeypatch, capsys, "hit", "eight-axes", "--backend", "float", *short)
    assert code == 0
    assert "wrist-turn" in out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ["hit", "--backend", "rtl", "--trace", "x.fst"],
            "--trace x.fst is a waveform of one axis: for a scene of sev",
        ),
        (["hit", "--trace", "x.fst"], "--trace x.fst needs --backend rtl"),
        (["hit", "--estimator", "kalman"], "controller.estimator must be one of fdm, levant, window, not 'kalman'"),
        (
            ["hit", "--set", "axis.grip.wall.damping_n_s_per_m=1e9"],
            "eight-axes: axis grip: wall.damping_n_s_per_m must",
        ),
        *(([command], "eight-axes: has several axes, [[axis]], which `hardwall hit`") for command in OF_ONE_AXIS_ALONE),
    ],
)
def test_what_is_not_for_several_axes_says_so_in_a_line(monkeypatch, capsys, tmp_path, arguments, message):
    monkeypatch.chdir(tmp_path)
    command, *options = arguments
    folder = ["-o", "out"] if command == "verilog" else []
    code, out, err = call(monkeypatch, capsys, command, "eight-axes", *options, *folder)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert message in err


def test_hits_of_two_scenes_are_side_by_side_in_report_table_and_film(monkeypatch, capsys, tmp_path):
    short = [word for key in ("settle_s=0.7", "mean_s=0.1", "measure_s=0.1") for word in ("--set", f"protocol.{key}")]
    two = ["hit", "seed-2011", "--beside", "fit-2011", "--estimator", "fdm", *short]
    code, out, err = call(monkeypatch, capsys, *two, "--json", "--plot", tmp_path / "two.gif")
    assert code == 0, err
    assert [row["scene"] for row in json.loads(out)["rows"]] == ["seed-2011", "fit-2011"]
    assert (tmp_path / "two.gif").read_bytes().startswith(b"GIF89a")
    (tmp_path / "two.json").write_text(out)
    _, out, _ = call(monkeypatch, capsys, "table", tmp_path / "two.json")
    assert out.count("fdm u, fixed") == 2


def test_table_puts_reports_side_by_side(monkeypatch, capsys, tmp_path):
    files = []
    for estimator in ("fdm", "levant"):
        _, out, _ = call(monkeypatch, capsys, "hit", "--json", "--estimator", estimator)
        files.append(tmp_path / f"{estimator}.json")
        files[-1].write_text(out)
    code, out, _ = call(monkeypatch, capsys, "table", *files)
    assert code == 0
    assert "fdm u" in out
    assert "levant u" in out
    files[0].write_text("{}")
    code, _, err = call(monkeypatch, capsys, "table", *files)
    assert (code, err.count("\n")) == (2, 1)
    assert "must be a JSON report" in err


@pytest.mark.parametrize("columns", [0, 1, 20])
def test_a_terminal_of_hardly_any_width_loses_no_number(monkeypatch, capsys, columns):
    monkeypatch.setenv("COLUMNS", str(columns))
    show(Table({"estimator": "left", "RMS (mm/s)": "right"}, [["levant-semi-implicit u", "0.415703"]]))
    show(Table({}, [["rms_mm", "0.000123456"]]))
    out = capsys.readouterr().out
    assert "0.415703" in out
    assert "0.000123456" in out


def test_the_console_command_is_installed():
    script = Path(sys.executable).with_name("hardwall")
    done = subprocess.run([script, "hit", "nowhere"], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (2, "")
