"""The command `panel`: its end, and what it refuses; the page itself is tested in a browser."""

import re
import socket
import urllib.request
from collections.abc import Callable, Iterator
from pathlib import Path

import psutil
import pytest
from host.twin_board import TwinBoard

from hardwall.cli.errors import BadInput
from hardwall.model.axis.registers import RegisterMap
from hardwall.sim.scene.load import load, read
from hardwall.sim.scene.schema import Scene
from stimuli.lengths import LONG
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


@pytest.mark.parametrize(("estimator", "said"), [("kalman", "true"), ("levant", "false")])
def test_the_page_knows_whether_the_board_has_an_acceleration(estimator, said):
    with (
        TwinBoard(RegisterMap(load("mhz", {"controller.estimator": estimator}).spec)) as board,
        started(HARDWALL, "panel", board.name) as process,
        urllib.request.urlopen(line(process).removeprefix("page: "), timeout=60) as page,
    ):
        assert f"window.hardwallAccelerates = {said}<" in page.read().decode()


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as found:
        return found.getsockname()[1]


@pytest.fixture
def served(tmp_path) -> Iterator[Callable[..., tuple[str, str]]]:
    """Starts the page of a board of the model once, for a moment; returns its address and what is on stderr."""
    with TwinBoard(RegisterMap(load("mhz").spec)) as board:

        def serve(*words: object) -> tuple[str, str]:
            command = HARDWALL, "panel", board.name, "--seconds", "0.1", *words
            with started(*command, XDG_STATE_HOME=str(tmp_path / "state")) as process:
                code, out, err = ended(process)
            assert code == 0, err
            return out.removeprefix("page: ").strip(), err

        yield serve


def test_a_page_at_a_fixed_port_has_its_address_again_until_it_is_renewed(served, tmp_path):
    port = free_port()
    url, err = served("--http", port)
    assert re.fullmatch(rf"http://127\.0\.0\.1:{port}/[\w-]{{22}}/", url)
    file = tmp_path / "state" / "hardwall" / f"panel-{port}.token"
    assert f"It stays the same at this port: {file} has its token." in err
    renewed = served("--http", port, "--new-token")[0]
    assert renewed != url
    assert served("--http", port)[0] == renewed
    file.chmod(0o644)
    leaked, err = served("--http", port)
    assert leaked != renewed
    assert f"{file} was no token of yours alone: the page has a new address" in err


def test_a_page_that_others_may_reach_and_one_at_any_port_has_a_new_address_at_each_start(served, tmp_path):
    # At any port, no token is kept for the next start.
    assert "stays the same" not in served()[1]
    wide = "--http", free_port(), "--host", "0.0.0.0"
    for words in ((), wide) if LONG else (wide,):
        (first, err), (second, _) = served(*words), served(*words)
        assert first.split("/")[-2] != second.split("/")[-2]
        assert "stays the same" not in err
    assert not (tmp_path / "state").exists()


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
        (["/dev/hardwall-absent"], 1, "cannot be opened: there is no such port"),
        (["/dev/hardwall-absent", "mhz"], 2, "SCENE, --estimator and --set are for `hardwall panel virtual`"),
        (["virtual", "nowhere"], 2, "nowhere"),
        (["virtual", "--baud", "9600"], 2, "--baud and --pace are for a board at a port, not for `hardwall panel virt"),
        (["virtual", "--pace", "0.5"], 2, "--baud and --pace are for a board at a port, not for `hardwall panel virtu"),
        (["/dev/hardwall-absent", "--new-token"], 2, "--new-token needs a fixed port (--http) of this machine"),
        (["virtual", "--host", "0.0.0.0", "--new-token"], 2, "--new-token needs a fixed port (--http)"),
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
