"""Options whose values are refused: before any work, in one short line, whatever their length."""

import json
import os
import subprocess
import sys

import pytest

from hardwall.cli import options, scenes
from hardwall.cli.errors import BadInput, one_line
from hardwall.sim.boards.parts import PARTS
from support.command_line import call

LONG = "x" * 5000
DIGITS = "9" * 5000


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["hit", "--set", "handle.coulmb_n="], "seed-2011: handle.coulmb_n is not a key of a scene; did you mean coul"),
        (["hit", "--set", "name=anything"], "seed-2011: name is not a key of a scene; its section has handle"),
        (
            ["hit", "--set", "handle.mass_kg=1.0\nhandle.coulomb_n=2.0"],
            "--set 'handle.mass_kg' must be one value on one line, not '1.0\\nhandle.coulomb_n=2.0'",
        ),
        (
            ["hit", "--set", "handle.mass_kg=1.0, other = 2"],
            "--set 'handle.mass_kg' must be one value, not '1.0, other = 2'",
        ),
        (["hit", "--set", "handle.mass_kg=1.0 # heavy"], "seed-2011: handle.mass_kg must be a number of 1e-06 to 1000"),
        (["hit", "--set", "handle.mass_kg=1 2"], "seed-2011: handle.mass_kg must be a number of 1e-06 to 1000, not '1"),
        (["hit", "--set", f"handle.mass_kg={DIGITS}"], "seed-2011: handle.mass_kg must be a number of 1e-06 to 1000"),
        (["hit", "--set", f"handle.mass_kg={'[' * 5000}"], "seed-2011: handle.mass_kg must be a number of 1e-06 to"),
        (
            ["hit", "--set", "handle.mass_kg=1.0", "--set", "handle.mass_kg=2.0"],
            "--set must change each key once, not 'handle.mass_kg' after 'handle.mass_kg'",
        ),
        (
            ["hit", "--set", "amplifier.delay_s=0.0", "--set", "amplifier="],
            "--set must change each key once, not 'amplifier' after 'amplifier.delay_s'",
        ),
        (
            ["hit", "--set", "wall.stiffness_n_per_m=1e3", "--stiffness", "2e3"],
            "--stiffness must change each key once, not 'wall.stiffness_n_per_m' after 'wall.stiffness_n_per_m'",
        ),
        (["hit", "--output", ""], "seed-2011: controller.output must be one of u, u1, not ''"),
        (["hit", "--plot", "pipe.png"], "--plot must be a regular file, not 'pipe.png'"),
        (["hit", "--plot", "new/folder/x.png", "--set", "handle.mass_kg=-1"], "seed-2011: handle.mass_kg must be a"),
        (["hit", "--plot", "r.csv/x.png"], "--plot 'r.csv/x.png' cannot be written: Not a directory"),
        (["hit", "--plot", "/proc/none/x.png"], "--plot '/proc/none/x.png' cannot be written: No such file"),
        (["hit", "--plot", f"{LONG}/x.png"], "--plot 'xxxx"),
        (["replay", "absent.csv", "--column", "c", "--out", "new/x.csv"], "absent.csv: there is no such file"),
        (["hit", "--trace", "pipe.npz"], "--trace must be a regular file, not 'pipe.npz'"),
        (["hit", "--plot", f"{LONG}.png"], "--plot 'xxxx"),
        (["hit", "a\nb"], "scene must be one of desktop-arm, "),
        (["hit", LONG], "scene must be one of desktop-arm, "),
        (
            ["hit", "drive-2011", "--set", "motor.torque_constant_n_m_per_a=1e300"],
            "drive-2011: motor.torque_constant_n_m_per_a must be",
        ),
        (["synth", "--axes", DIGITS], "--axes must be a whole number of 1 to 32, not '9999"),
        (["virtual", "--baud", DIGITS], "--baud must be a whole number of 115200 to 3e+06, not '9999"),
        (["capture", "p", "--before", DIGITS], "--before must be a whole number of 0 to 4096, not '9999"),
        (["capture", "p", "--decimation", "0"], "--decimation must be a whole number of 1 to 4095, not '0'"),
        (["replay", "r.csv", "--column", "c", "--coarsen", DIGITS], "--coarsen must be a whole number of 1 to 21474"),
        (["rates", "--rates", ""], "--rates must be whole numbers of 1000 to 1e+07 Hz, not ''"),
        (["rates", "--estimators", ""], "--estimators: estimator must be one of fdm, "),
        (["rates", "--estimators", "abc"], "--estimators: estimator must be one of fdm, "),
        (["accuracy", "--estimators", "levant:"], "--estimators: output of levant must be one of u, u1, not ''"),
        (["accuracy", "--signal", ""], "--signal: signal must be one of paper, "),
        (["accuracy", "--acceleration-max", "1e-300"], "--acceleration-max must be 1e-09 to 1e+06 m/s^2, not 1e-300"),
        (["accuracy", "--rates", LONG], "--rates must be whole numbers of 1000 to 1e+07 Hz, not 'xxxx"),
        (["accuracy", "--workers", "100000"], "--workers must be a whole number of 1 to 1024, not '100000'"),
        (["lipschitz", "--after", "inf"], "--after must be 0.001 to 1e+06 s, not inf"),
        (["lipschitz", "--before", "1e400"], "--before must be 0 to 1e+06 s, not inf"),
        (["lipschitz", "--before", "nan"], "--before must be 0 to 1e+06 s, not nan"),
        (["replay", "r.csv", "--column", "c", "--out", f"{LONG}.csv"], "--out 'xxxx"),
        (["replay", "r.csv", "--column", "c", "--out", "r.csv"], "--out must be another file than the recording"),
        (["replay", LONG, "--column", "c"], "'xxxx"),
        (["replay", "pipe.png", "--column", "c"], "pipe.png: cannot be read (it is not a regular file); must be a CSV"),
        (["replay", "r.csv", "--column", "c"], "r.csv: is empty; must be a CSV file"),
        (["table", "/dev/zero"], "'/dev/zero' must be a JSON report of `hardwall hit --json`, and is none: it is not"),
        (["verilog", "-o", f"{LONG}"], "-o 'xxxx"),
        (["hit", "mhz", "9" * 5000], "Got unexpected extra argument(s) (9999"),
        (["verilog", "--set", f"{LONG}=1"], "seed-2011: xxxx"),
        (["verilog", "-o", ""], "-o must be a folder, not ''"),
    ],
)
def test_it_is_refused_in_a_short_line_before_any_work(monkeypatch, capsys, tmp_path, arguments, message):
    monkeypatch.chdir(tmp_path)
    for name in ("pipe.png", "pipe.npz"):
        os.mkfifo(name)
    (tmp_path / "r.csv").touch()
    code, out, err = call(monkeypatch, capsys, *arguments)
    assert (code, out) == (2, "")
    assert err.startswith(f"hardwall: error: {message}")
    assert err.count("\n") == 1
    assert len(err) < 500
    assert {path.name for path in tmp_path.iterdir()} == {"pipe.png", "pipe.npz", "r.csv"}


def test_a_link_is_followed_and_one_that_leads_nowhere_is_refused(tmp_path):
    links = {"loop.csv": "loop.csv", "pipe.csv": "pipe", "far.csv": "new/target.csv", "near.csv": "target.csv"}
    os.mkfifo(tmp_path / "pipe")
    for name, target in links.items():
        (tmp_path / name).symlink_to(target)
    before = sorted(tmp_path.iterdir())
    for name in ("loop.csv", "pipe.csv"):
        with pytest.raises(BadInput, match=r"^--out must be a regular file, not "):
            options.output_file(tmp_path / name, "--out", (".csv",))
    for name in ("far.csv", "near.csv"):
        assert options.output_file(tmp_path / name, "--out", (".csv",)) == tmp_path / name
    assert sorted(tmp_path.iterdir()) == before


def test_a_part_that_is_in_the_table_is_a_device():
    program = "from hardwall.sim.boards.parts import PARTS; PARTS['more'] = None; "
    program += "from hardwall.cli.scenes import PartName; print(*PartName.__args__)"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.split() == [*PARTS, "more"]


@pytest.mark.parametrize(
    ("text", "value"),
    [("1", 1), ("[1, 2]", [1, 2]), ("{ a = 1 }", {"a": 1}), ("levant", "levant"), ("'u1'", "u1"), ("1, a = 2", None)],
)
def test_a_value_is_one_toml_value_or_a_text(text, value):
    if value is not None:
        assert scenes.value_of("key", text) == value
    else:
        with pytest.raises(BadInput, match=r"^--set 'key' must be one value, not '1, a = 2'$"):
            scenes.value_of("key", text)


@pytest.mark.parametrize(("text", "value"), [(".35", 0.35), ("-.5e-1", -0.05), ("+2.", 2.0), ("1.e3", 1000.0)])
def test_a_number_may_be_written_as_people_do(text, value):
    assert scenes.value_of("key", text) == value
    for other in (".", "e5", ".5.", "1.2.3", "5 .", ".5,"):
        assert scenes.value_of("key", other) == other


def test_a_replay_names_its_options(monkeypatch, capsys, tmp_path):
    (tmp_path / "r.csv").write_text("c\n" + "".join(f"{k * k // 50}\n" for k in range(1200)))
    for words, said in (
        (
            ("--acceleration-max", "0"),
            "--acceleration-max must be 9.53674e-31 to 9.53674e+29 counts/s^2 at 1000 Hz, not",
        ),
        (("--acceleration-max", "1e12"), "--acceleration-max must give gains that fit this recording ("),
        (("--output", "v"), "--output of levant must be one of u, u1, not 'v'"),
        (("--coarsen", "0"), "--coarsen must be a whole number of 1 to 2147483647, not '0'"),
    ):
        file = (tmp_path / "r.csv", "--column", "c", "--rate", "1000")
        code, out, err = call(monkeypatch, capsys, "replay", *file, *words)
        assert (code, out, err.count("\n")) == (2, "", 1)
        assert err.startswith(f"hardwall: error: {said}")


def test_what_does_not_print_is_escaped():
    assert one_line("a\nb\x1b[31m\udcffé") == "a\\nb\\x1b[31m\\udcffé"


REPORT = {
    "estimator": "fdm",
    "output": "u",
    "backend": "fixed",
    "scene": "seed-2011",
    "stiffness_n_per_m": 1e3,
    "damping_n_s_per_m": 2.0,
    "verdict": "undecided",
    "rms_mm": 0.1,
    "max_force_n": 3.0,
    "estimate_rms_mm_per_s": None,
    "force_sha256": None,
}


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"stiffness_n_per_m": "stiff"}, "stiffness_n_per_m: "),
        ({"verdict": "no"}, "verdict: "),
        ({"rms_mm": float("inf")}, "rms_mm: "),
        ({"force_sha256": 5}, "force_sha256: "),
        ({"scene": "x" * 10**5}, "scene: "),
        ({"max_force_n": 10**400}, "max_force_n: "),
    ],
)
def test_a_report_of_wrong_types_is_refused(monkeypatch, capsys, tmp_path, change, said):
    file = tmp_path / "r.json"
    monkeypatch.chdir(tmp_path)
    file.write_text(json.dumps(REPORT))
    assert call(monkeypatch, capsys, "table", "r.json")[0] == 0
    file.write_text(json.dumps(REPORT | change))
    code, out, err = call(monkeypatch, capsys, "table", "r.json")
    assert (code, out) == (2, "")
    assert err.startswith(
        f"hardwall: error: 'r.json' must be a JSON report of `hardwall hit --json`, and is none: {said}"
    )
    assert err.count("\n") == 1
    assert len(err) < 300


@pytest.mark.parametrize("text", ["", "5", "[" * 10**5, '{"rms_mm": ' + DIGITS + "}", "\xff", "null"])
def test_what_is_no_report_is_refused(monkeypatch, capsys, tmp_path, text):
    (tmp_path / "r.json").write_text(text, encoding="latin-1")
    code, _, err = call(monkeypatch, capsys, "table", tmp_path / "r.json")
    assert (code, err.count("\n")) == (2, 1)
    assert len(err) < 400
