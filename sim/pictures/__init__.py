"""Pictures of results. Facts that the options need are here, so that a call can be refused without Matplotlib."""

SUFFIXES = (".pdf", ".png", ".svg")
"""The kinds of a picture's file."""
FILM = ".gif"
"""The kind of a picture that moves."""
FILMED = ("hit", "hit_beside")
"""The commands, or kinds of their results, whose picture may move."""


def suffixes_of(command: str) -> tuple[str, ...]:
    """Return the kinds of files that a command's picture may be written to."""
    return (*SUFFIXES, FILM) if command in FILMED else SUFFIXES
