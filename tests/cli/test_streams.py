"""Standard streams that are closed, full, or of few characters."""

import errno
import os
import subprocess
from pathlib import Path

import pytest

from hardwall.cli.streams import StdoutError
from support.command_line import call
from support.processes import HARDWALL

FULL = Path("/dev/full")
PRINTING = [["--help"], ["--version"]]


def run(words: list[str], redirected: str, **environ: str) -> subprocess.CompletedProcess:
    """Run the command line with a shell's redirection or pipe behind it."""
    command = ["bash", "-c", f'set -o pipefail; "$0" "$@" {redirected}', HARDWALL, *words]
    return subprocess.run(command, env=os.environ | environ, capture_output=True, text=True, check=False)


@pytest.mark.parametrize("words", PRINTING, ids=" ".join)
def test_a_pipe_that_nobody_reads_ends_the_program_quietly(words):
    done = run(words, "| true")
    assert done.stderr == ""
    assert done.returncode in (0, 141)


def test_what_a_closed_pipe_gets_is_the_beginning():
    done = run(["--help"], "| head -1")
    assert (done.stderr, done.stdout.count("\n")) == ("", 1)
    assert done.returncode in (0, 141)


@pytest.mark.skipif(not FULL.exists(), reason="no /dev/full here")
@pytest.mark.parametrize("words", PRINTING, ids=" ".join)
def test_a_full_disk_is_an_error_of_stdout(words):
    done = run(words, f"> {FULL}")
    expected = "hardwall: error: stdout: cannot be written (No space left on device)\n"
    assert (done.returncode, done.stderr) == (1, expected)


def test_stdout_that_was_closed_before_is_an_error():
    done = run(["--version"], ">&-")
    expected = "hardwall: error: stdout: cannot be written (Bad file descriptor)\n"
    assert (done.returncode, done.stderr) == (1, expected)


@pytest.mark.parametrize("redirected", ["2>&-", f"2> {FULL}", "2> >(:)"])
def test_stderr_that_takes_nothing_changes_no_exit_code(redirected):
    assert run(["--version"], redirected).returncode == 0
    done = run(["nothing"], redirected)
    assert (done.returncode, done.stdout, done.stderr) == (2, "", "")


def test_the_picture_of_a_report_that_nobody_reads_is_drawn(tmp_path, monkeypatch, capsys):
    def closed(*_, **__):
        raise StdoutError(BrokenPipeError(errno.EPIPE, "Broken pipe"))

    monkeypatch.setattr("hardwall.cli.report.ReportOptions._print", closed)
    trace = tmp_path / "hit.npz"
    code, out, err = call(monkeypatch, capsys, "hit", "--trace", trace)
    assert (code, out, err.splitlines()[-1]) == (141, "", f"trace: {trace}")
    assert trace.exists()


@pytest.mark.parametrize("environ", [{"PYTHONIOENCODING": "ascii"}, {"LC_ALL": "C", "PYTHONCOERCECLOCALE": "0"}])
def test_characters_that_a_stream_lacks_are_written_as_escapes(environ):
    assert run(["--help"], "", **environ).returncode == 0
    done = run(["mü\udcff"], "", **environ)
    assert (done.returncode, done.stderr.count("\n")) == (2, 1)
