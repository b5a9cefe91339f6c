"""The command line, called in this process."""

from hardwall.sim.commands import app

WIDTH = 80
"""The width of output in columns where there is no terminal."""


def call(monkeypatch, capsys, *arguments: object) -> tuple[int, str, str]:
    """Return exit code, stdout and stderr of `hardwall ARGUMENTS`."""
    monkeypatch.setattr("sys.argv", ["hardwall", *map(str, arguments)])
    monkeypatch.setattr("hardwall.sim.jobs.ending.hear_signals", lambda: None)  # the signals are pytest's
    try:
        app.main()
        code = 0
    except SystemExit as exit_:
        code = exit_.code
    out, err = capsys.readouterr()
    if "--json" not in arguments:
        assert [line for line in out.splitlines() if len(line) > WIDTH] == [], "a table does not fit"
    return code, out, err
