"""Calls as no one would make them: an answer in time, one line for bad input, and a report as its schema says.

`HARDWALL_FUZZ` is the number of calls of all commands together; `make fuzz` makes 20 000. A call that fails is printed
with the files that it had, and comes again with the same seed.
"""

import os
import re
import signal
import tempfile
import time
from pathlib import Path

import pytest
from hypothesis import HealthCheck, Phase, find, given, settings
from hypothesis import strategies as st

from hardwall.cli.group import COMMANDS
from stimuli.hostile import ENVIRONS, Call, calls
from support import forked
from support.forked import BEGAN, Ended, run
from support.reports import check_text

CALLS = int(os.environ.get("HARDWALL_FUZZ", "54"))
LINE_MAX = 1500
"""The most characters of an error message: what is shown of a value is shortened."""
BAD, ERROR = 2, re.compile(r"hardwall: error: [^\n]+\n")


def faults(call: Call, ended: Ended) -> list[str]:
    """Return what is wrong with how a call ended."""
    found = []
    if ended.code not in (0, 1, BAD, BEGAN):
        found.append(f"exit code {ended.code}")
    if "Traceback" in ended.err or "Warning" in ended.err or "Exception ignored" in ended.err:
        found.append("a traceback or a warning of Python")
    if ended.code == BAD and not (ERROR.fullmatch(ended.err) and not ended.out):
        found.append("bad input is not one line on stderr")
    if ended.code == 0 and not ended.out.strip():
        found.append("a success without a word")
    if ended.code == 1 and not ERROR.search(ended.err):
        found.append("a failure without a message")
    if len(max(ended.err.split("\n"), key=len)) > LINE_MAX:
        found.append("a message that is too long")
    if ended.code == 0 and "--json" in call.arguments and ended.out:
        try:
            # Options of the program may stand before the command.
            check_text(next(word for word in call.arguments if word in COMMANDS), ended.out)
        except (AssertionError, ValueError) as error:
            found.append(f"the report: {error}")
    return found


@pytest.mark.parametrize("command", COMMANDS)
def test_hostile_calls(command):
    # A call that fails is not made smaller: that takes hundreds of calls, and it is short as it is.
    @settings(
        max_examples=max(CALLS // len(COMMANDS), 1),
        suppress_health_check=list(HealthCheck),
        phases=[Phase.generate],
    )
    @given(st.data())
    def attack(data):
        call = data.draw(calls(command))
        with tempfile.TemporaryDirectory() as folder:
            work = Path(folder) / "work"
            work.mkdir()
            call.put(work)
            ended = run(call.arguments, Path(folder), call.environ)
            wrong = faults(call, ended)
        assert not wrong, f"{'; '.join(wrong)}\n{call}\n{ended.out[-2000:]}\n{ended.err[-4000:]}"

    attack()


def ended_in(folder: Path, *arguments: str, **environ: str) -> Ended:
    """Return how a call ends in a folder that is made for it."""
    (folder / "work").mkdir(parents=True)
    return run(arguments, folder, environ)


@pytest.mark.parametrize(
    "words", ["bench seed-2011", "synth seed-2011", "board ulx3s-12f seed-2011 -o new", "zwidth", "hit --backend rtl"]
)
def test_what_takes_long_is_only_begun(tmp_path, words):
    assert ended_in(tmp_path, *words.split()).code == BEGAN


def test_a_call_that_hangs_is_ended_and_says_where(tmp_path, monkeypatch):
    monkeypatch.setattr(forked, "LIMIT_S", 1)
    monkeypatch.setattr(forked.app, "main", lambda: time.sleep(600))
    ended = ended_in(tmp_path, "hit")
    assert ended.code == -signal.SIGALRM
    assert "most recent call first" in ended.err
    assert faults(Call(("hit",)), ended)


def test_a_call_has_its_terminal(tmp_path):
    few = settings(max_examples=100, phases=[Phase.generate])
    assert find(calls("hit"), lambda call: call.environ, settings=few).environ in ENVIRONS
    narrow, wide = (ended_in(tmp_path / columns, "hit", "--help", COLUMNS=columns).out for columns in ("40", "80"))
    assert max(map(len, narrow.splitlines())) <= 40 < max(map(len, wide.splitlines())) <= 80


def test_the_fuzzer_sees_what_is_wrong():
    call = Call(("hit", "--json"))
    line = "hardwall: error: what\n"
    assert faults(call, Ended(2, "", line)) == faults(call, Ended(1, "", f"working\n{line}")) == []
    for ended in (
        Ended(2, "", line + line),
        Ended(2, "out", line),
        Ended(1, "", "no message"),
        Ended(-11, "", ""),
        Ended(70, "", "Traceback (most recent call last):"),
        Ended(0, "", ""),
        Ended(0, '{"rms_mm": NaN}', ""),
        Ended(0, "{}", "RuntimeWarning: overflow"),
        Ended(2, "", "hardwall: error: " + "x" * 2000 + "\n"),
    ):
        assert faults(call, ended)
