"""How docstrings, which are written to be read in the source, become pages.

An indented block after an empty line is an equation or an example: it stays as it is written. `|x|` is a magnitude and
`2**n` a power, not markup. What is returned, and the line under an attribute, is a sentence, whose first colon ends no
type. The tuples of parameters that kernels take, and the fields of tuples that have no docstring, are left out.
"""

import re

from sphinx.application import Sphinx

ONE_LINERS = {"attribute", "data", "property"}
OF_KERNELS = {"Params", "FloatParams"}


def _indent(line: str) -> int:
    return len(line) - len(line.lstrip())


def as_written(_: Sphinx, what: str, __: str, ___: object, ____: object, lines: list[str]) -> None:
    """Turn the lines of a docstring into what Sphinx reads as its author meant it."""
    result: list[str] = []
    literal, before = None, ""
    for line in lines:
        if literal is not None and line.strip() and _indent(line) <= literal:
            literal = None
        opens = literal is None and result and not result[-1].strip() and _indent(line) > _indent(before)
        if opens and not re.match(r"\s*([-*]|\d+\.|\w+:)\s", before):
            literal = _indent(before)
            result += [" " * literal + "::", ""]
        if literal is None and line.lstrip().startswith("- ") and before == (result or [""])[-1].replace("\\", ""):
            result += [] if before.lstrip().startswith("- ") or _indent(before) > _indent(line) else [""]
        if before.strip() == "Returns:":
            line = f"{line[: _indent(line)]}: {line.lstrip()}"  # noqa: PLW2901
        several = re.match(r"(\s+)((?:\w+, )+)(\w+): ", line)
        if literal is None and several:
            result += [f"{several[1]}{name}: see `{several[3]}`." for name in several[2].split(", ")[:-1]]
            line = several[1] + line[several.start(3) :]  # noqa: PLW2901
        if line.strip():
            before = line
        result.append(line if literal is not None else _escaped(line))
    if what in ONE_LINERS and result:
        result[0] = f": {result[0]}"
    lines[:] = result


def left_out(_: Sphinx, __: str, name: str, member: object, skip: bool, ___: object) -> bool:
    """Return whether a member is not for the page."""
    plain_field = (getattr(member, "__doc__", None) or "").startswith("Alias for field number")
    return skip or plain_field or name in OF_KERNELS


def _escaped(line: str) -> str:
    """Return a line of prose with its magnitudes and powers kept from being markup."""
    parts = re.split(r"(`[^`]*`)", line)
    parts[::2] = [re.sub(r"\|", r"\\|", re.sub(r"(?<=\w)\*\*(?=[\w(-])", r"\\*\\*", part)) for part in parts[::2]]
    return "".join(parts)


def setup(app: Sphinx) -> dict[str, bool]:
    """Let it run before napoleon, which reads sections."""
    app.connect("autodoc-process-docstring", as_written, priority=400)
    app.connect("autodoc-skip-member", left_out)
    return {"parallel_read_safe": True}
