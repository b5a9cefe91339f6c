"""The command `config`, with a board in simulation: every word to a file and back, and what is refused."""

import json
import os
import pty
import re
import subprocess
from collections.abc import Callable, Iterator

import pytest

from hardwall.host.connect import connect
from hardwall.host.status import State
from hardwall.model.axis.registers import RegisterMap
from hardwall.model.register import Register
from hardwall.sim.scene.load import load
from hardwall.testing import rng
from stimuli.lengths import LONG
from support.command_line import call
from support.processes import HARDWALL, PATIENCE_S
from support.virtual_boards import PACE, SCENE, VirtualBoard, running

AT = "--pace", PACE
REGISTERS = RegisterMap(load("seed-2011", SCENE).spec)
WORDS = {
    each.name: each for each in (*REGISTERS.words, *REGISTERS.live) if each.name not in ("heartbeat", "acknowledged")
}


@pytest.fixture(scope="module")
def virtual() -> Iterator[VirtualBoard]:
    with running(SCENE, "--tcp", "0", "--speed", str(2 * PACE)) as board:
        yield board


@pytest.fixture
def config(virtual, monkeypatch, capsys, tmp_path) -> Callable[..., tuple[int, str, str]]:
    """Return what calls the command in a folder of its own, with the act, the file and more options."""
    monkeypatch.chdir(tmp_path)
    return lambda act, *more: call(monkeypatch, capsys, "config", act, virtual.path, "words.toml", *more, *AT)


def used(virtual: VirtualBoard) -> dict[str, int]:
    """Return every word as the axis uses it."""
    with connect(virtual.path, pace=PACE) as axis:
        return {name: round(axis.get(name) / word.lsb) for name, word in WORDS.items()}


def put(virtual: VirtualBoard, words: dict[str, int]) -> None:
    with connect(virtual.path, pace=PACE) as axis:
        assert set(axis.names) == set(WORDS)
        axis.set(**{name: word * WORDS[name].lsb for name, word in words.items()})


def drawn(word: Register, way: str) -> int:
    if way == "drawn":
        return int(rng().integers(word.low, word.high, endpoint=True))
    return getattr(word, way)


@pytest.mark.parametrize("way", ["low", "high", "drawn"])
def test_what_is_saved_and_loaded_again_differs_in_no_word(virtual, config, way):
    words = {name: drawn(word, way) for name, word in WORDS.items()}
    put(virtual, words)
    code, out, err = config("save", "--json")
    assert code == 0, err
    assert json.loads(out)["words"] == len(WORDS)
    put(virtual, {name: word.reset for name, word in WORDS.items()})
    code, out, err = config("load", "--yes", "--json")
    assert code == 0, err
    report = json.loads(out)
    assert report["committed"]
    assert {row["name"] for row in report["rows"]} == {
        name for name, word in WORDS.items() if words[name] != word.reset
    }
    assert used(virtual) == words
    code, out, err = config("diff", "--json")
    assert (code, json.loads(out)["rows"]) == (0, [])
    put(virtual, {name: word.reset for name, word in WORDS.items()})


def test_a_difference_is_shown_and_nothing_is_armed(virtual, config):
    assert config("save")[0] == 0
    put(virtual, {"wall_stiffness": 640})
    code, out, err = config("diff")
    assert code == 0
    assert re.search(r"wall_stiffness +N/m +2000 +0", out.replace(".0", ""))
    assert err.splitlines()[-1] == f"1 of {len(WORDS)} words differ"
    assert used(virtual)["wall_stiffness"] == 640
    code, out, err = config("load", "--yes")
    assert code == 0
    assert "wall_stiffness" in out
    assert err.splitlines()[-1] == f"1 of {len(WORDS)} words loaded, and committed together"
    assert used(virtual)["wall_stiffness"] == 0
    with connect(virtual.path, pace=PACE) as axis:
        assert axis.status.state is State.DISARMED


def asked(words: list[object], answer: str, folder: object) -> tuple[int, str]:
    """Call the program with a terminal as its stdin; return its exit code and all that it says."""
    master, slave = pty.openpty()
    try:
        with subprocess.Popen(
            list(map(str, words)), stdin=slave, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, cwd=folder
        ) as process:
            os.write(master, f"{answer}\n".encode())
            out, _ = process.communicate(timeout=PATIENCE_S)
        return process.returncode, out
    finally:
        os.close(master)
        os.close(slave)


@pytest.mark.parametrize(
    ("answer", "code", "loaded"), [("y", 0, True), ("", 1, False), *([("n", 1, False)] if LONG else [])]
)
def test_a_terminal_is_asked(virtual, config, tmp_path, answer, code, loaded):
    put(virtual, {"wall_stiffness": 0})
    assert config("save")[0] == 0
    put(virtual, {"wall_stiffness": 640})
    found, out = asked([HARDWALL, "config", "load", virtual.path, "words.toml", *AT], answer, tmp_path)
    assert found == code, out
    # What differs is shown before the question.
    assert out.index("wall_stiffness") < out.index("write 1 words to the board, and commit them together? [y/N]")
    assert used(virtual)["wall_stiffness"] == (0 if loaded else 640)
    if not loaded:
        assert "hardwall: error: nothing was loaded: the answer was no" in out
    put(virtual, {"wall_stiffness": 0})


def test_what_is_refused_is_one_line(virtual, config, tmp_path):
    put(virtual, {"wall_stiffness": 0})
    assert config("save")[0] == 0
    file = tmp_path / "words.toml"
    saved = file.read_text()
    foreign = saved.replace(f'"{REGISTERS.identity}"', '"0123456789abcdef"')
    for text, act, code, said in (
        (saved, ["load"], 2, "`hardwall config load` asks in a terminal before it commits; elsewhere it needs --yes"),
        (saved, ["diff", "--yes"], 2, "--yes is for `hardwall config load`, not for diff"),
        (
            foreign, ["load", "--yes"], 1,
            "'words.toml' is of another board: identity is '0123456789abcdef' in the file, and "
            f"'{REGISTERS.identity}' on the board",
        ),
        (
            saved.replace("wall_stiffness = 0.0", "wall_stiffness = 3e5"), ["load", "--yes"], 2,
            "'words.toml': wall_stiffness must be 0 to 204797 N/m, not 300000.0",
        ),
        ("[board", ["diff"], 2, None),
    ):  # fmt: skip
        file.write_text(text)
        found, out, err = config(*act)
        assert (found, out, err.count("\n")) == (code, "", 1)
        assert said is None or err == f"hardwall: error: {said}\n"
    assert used(virtual)["wall_stiffness"] == 0
