"""The command line, called in this process."""

import re

from hardwall.cli import app

from .reports import check_text

WIDTH = 80
"""The width of output in columns where there is no terminal."""


def call(monkeypatch, capsys, *arguments: object) -> tuple[int, str, str]:
    """Return exit code, stdout and stderr of `hardwall ARGUMENTS`; a report on stdout is held to its schema."""
    monkeypatch.setattr("sys.argv", ["hardwall", *map(str, arguments)])
    monkeypatch.setattr("hardwall.model.runtime.termination.hear_signals", lambda: None)  # the signals are pytest's
    try:
        app.main()
        code = 0
    except SystemExit as exit_:
        code = exit_.code
    out, err = capsys.readouterr()
    if "--json" in arguments:
        # A run that fails may have printed its report before.
        if out or not code:
            check_text(str(arguments[0]), out)
    else:
        assert [line for line in out.splitlines() if len(line) > WIDTH] == [], "a table does not fit"
    return code, out, err


def said(err: str) -> list[str]:
    """Return the lines of stderr, without those that a slow machine has: what is compiled, and how far the work is."""
    return [line for line in err.splitlines() if not re.match(r"compiling the loops?, once|accuracy, \w+: \d+%$", line)]
