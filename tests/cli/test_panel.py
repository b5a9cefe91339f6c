"""The command `panel`: its end, and what it refuses; the page itself is tested in a browser."""

from pathlib import Path

import psutil
import pytest

from hardwall.cli.errors import BadInput
from hardwall.sim.scene.load import read
from hardwall.sim.scene.schema import Scene
from support.command_line import call
from support.processes import HARDWALL, ended, line, started, wait_until
from support.virtual_boards import SCENE


def changes(*assignments: str) -> list[str]:
    return [word for each in assignments for word in ("--set", each)]


WORDS = [str(HARDWALL), "panel", "virtual", *changes(*(f"{key}={value}" for key, value in SCENE.items()))]


def test_its_end_leaves_no_process_and_a_board_is_not_asked_for_twice():
    with started(*WORDS, "--seconds", "0.5") as process:
        line(process)
        children = psutil.Process(process.pid).children(recursive=True)
        code, _, err = ended(process)
    assert code == 0, err
    assert children
    wait_until(lambda: not any(child.is_running() and child.status() != "zombie" for child in children))


def test_a_board_that_starts_later_runs_the_scene_that_was_read(monkeypatch, capsys, tmp_path):
    file, text, seen = tmp_path / "mine.toml", read("mhz"), []
    file.write_text(text)

    def bench(_: str, words: list[str], scene: Scene, identity: str | None) -> None:
        file.write_text("another")
        seen.append((scene.name, Path(words[0]).stem, Path(words[0]).read_text()))
        raise BadInput("seen")

    monkeypatch.setattr("hardwall.cli.virtual_bench.VirtualBench", bench)
    code, out, err = call(monkeypatch, capsys, "panel", "virtual", file)
    assert (code, out, err) == (2, "", "hardwall: error: seen\n")
    assert seen == [("mine", "mine", text)]


@pytest.mark.parametrize(
    ("words", "code", "message"),
    [
        (["/dev/hardwall-absent"], 1, "cannot be opened: there is none of that name"),
        (["/dev/hardwall-absent", "mhz"], 2, "SCENE, --estimator and --set are for `hardwall panel virtual`"),
        (["virtual", "nowhere"], 2, "nowhere"),
        (["virtual", "--baud", "9600"], 2, "--baud and --pace are for a board at a port, not for `hardwall panel virt"),
        (["virtual", "--pace", "0.5"], 2, "--baud and --pace are for a board at a port, not for `hardwall panel virtu"),
        (["virtual", "--host", "nosuch.invalid"], 2, "--host must be an address of this machine, not 'nosuch.invalid'"),
        (["virtual", "--host", "192.0.2.1"], 2, "--host must be an address of this machine, not '192.0.2.1'"),
        (["virtual", "--host", "a" * 300], 2, "--host must be an address of this machine, not 'aaa"),
    ],
)
def test_what_cannot_be_is_one_line(monkeypatch, capsys, words, code, message):
    done, out, err = call(monkeypatch, capsys, "panel", *words)
    assert (done, out) == (code, ""), err
    (said,) = err.splitlines()
    assert said.startswith("hardwall: error: ")
    assert message in said


def test_what_the_virtual_board_finds_is_one_line():
    wrong = changes("controller.clock_hz=400000", "encoder.count_m=20e-6")
    with started(HARDWALL, "panel", "virtual", *wrong) as process:
        code, out, err = ended(process)
    assert (code, out) == (2, "")
    (said,) = err.splitlines()
    assert said.startswith("hardwall: error: ")
    assert "must be 460800 or more" in said
