"""What pages take from the program itself, so that they cannot fall behind it.

A line `%commands%` in a page becomes every command of the command line with its arguments, options and defaults, and a
line `%hands%` a table of the hands that a scene may name.

The directive `{scene-section} handle` lists the keys of a section of a scene, with the unit, range and default that the
schema has; its content is a line `key: meaning` for each. A key without a meaning, or a meaning without a key, is a
warning, and so fails the build.
"""

import re

import typer.main
from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util import logging
from sphinx.util.docutils import SphinxDirective

from hardwall.cli.group import app
from hardwall.sim.scene.hand_section import HANDS, OF_A_HAND
from hardwall.sim.scene.schema import Scene
from hardwall.sim.scene.sentences import accepted, sections_of

log = logging.getLogger(__name__)

# The ends of keys, longest first, and what they say of the unit.
UNITS = {
    "_n_m_per_a": "N m/A",
    "_sqrt_m_per_s": "m^(1/2)/s",
    "_n_s_per_m": "N s/m",
    "_n_per_m": "N/m",
    "_n_per_s": "N/s",
    "_m_per_s2": "m/s²",
    "_m_per_s": "m/s",
    "_counts": "counts",
    "_clocks": "clocks",
    "_ohm": "Ω",
    "_bits": "bits",
    "_kg": "kg",
    "_hz": "Hz",
    "_mm": "mm",
    "_n": "N",
    "_m": "m",
    "_s": "s",
    "_h": "H",
    "_a": "A",
    "_v": "V",
}


def cell(text: object) -> str:
    """Return text as it can stand in a cell of a Markdown table."""
    return " ".join(str(text).split()).replace("|", "\\|").replace("<", "\\<")


def code(text: str) -> str:
    """Return text as code in a cell of a Markdown table."""
    return f"`{' '.join(text.split())}`".replace("|", "\\|")


def table(heads: list[str], rows: list[list[str]]) -> list[str]:
    """Return the lines of a Markdown table."""
    return [f"| {' | '.join(line)} |" for line in (heads, ["---"] * len(heads), *rows)]


# ---- commands -------------------------------------------------------------------------------------------------------


def commands() -> list[str]:
    """Return the lines of Markdown that describe every command."""
    group = typer.main.get_command(app)
    context = group.make_context("hardwall", [], resilient_parsing=True)
    found = {name: group.resolve_command(context, [name])[1] for name in group.list_commands(context)}
    shown = {name: command for name, command in found.items() if not command.hidden}
    firsts = [[f"[{code(name)}](#hardwall-{name})", cell(one.get_short_help_str(200))] for name, one in shown.items()]
    lines = [*table(["command", "what it does"], firsts), "", "## `hardwall`", "", *_options(group, context), ""]
    for name, command in shown.items():
        inner = command.make_context(name, [], parent=context, resilient_parsing=True)
        usage = " ".join(["hardwall", name, *command.collect_usage_pieces(inner)])
        lines += [f"(hardwall-{name})=", f"## `hardwall {name}`", "", cell(command.help or ""), ""]
        lines += ["```text", usage, "```", "", *_options(command, inner), ""]
    return lines


def _options(command, context) -> list[str]:
    """Return a table of the arguments and options of a command."""
    rows = []
    for parameter in command.get_params(context):
        record = parameter.get_help_record(context)
        if record is None or getattr(parameter, "hidden", False):
            continue
        name, meaning = record
        # Long lists of choices are told in the meaning, where they can be broken.
        choices = re.search(r"<([^<>|]+(?:\|[^<>|]+)+)>", name)
        if choices:
            name = name.replace(choices[0], "CHOICE")
            text, bracket, default = meaning.partition(" [")
            meaning = f"{text.rstrip()}: {', '.join(choices[1].split('|'))}{bracket}{default}"
        rows.append([code(name), cell(meaning)])
    return table(["argument or option", "meaning"], rows)


def fill(_: Sphinx, __: str, source: list[str]) -> None:
    """Put the commands, or the published hands, where a page wants them."""
    for mark, lines in (("%commands%", commands), ("%hands%", hands)):
        if mark in source[0]:
            source[0] = source[0].replace(mark, "\n".join(lines()))


# ---- hands ----------------------------------------------------------------------------------------------------------


def hands() -> list[str]:
    """Return a table of the published hands: a dagger marks figures that were not seen in the source itself."""
    rows = [
        [code(name), *(f"{hand[key]:g}" for key in OF_A_HAND), cell(hand["grip"]), cell(hand["source"])]
        for name, hand in HANDS.items()
    ]
    for row, hand in zip(rows, HANDS.values(), strict=True):
        row[-1] += "" if hand["seen"] else " †"
    return table(["name", "kg", "N s/m", "N/m", "grip", "source"], rows)


# ---- scenes ---------------------------------------------------------------------------------------------------------


class SceneSection(SphinxDirective):
    """The keys of a section of a scene."""

    required_arguments = 1
    has_content = True

    def run(self) -> list[nodes.Node]:
        name = self.arguments[0]
        fields = sections_of(Scene)[name].model_fields
        meanings = dict(line.partition(": ")[::2] for line in self.content if line.strip())
        if meanings.keys() != fields.keys():
            wrong = sorted(meanings.keys() ^ fields.keys())
            log.warning("section %s of a scene: %s", name, ", ".join(wrong), location=self.get_location())
        rows = []
        for key, field in fields.items():
            taken = accepted(field.annotation, tuple(field.metadata))
            rows.append([f"`{key}`", _unit(key), cell(taken), cell(_default(field)), cell(meanings.get(key, ""))])
        return self.parse_text_to_nodes("\n".join(table(["key", "unit", "range", "default", "meaning"], rows)))


def _unit(key: str) -> str:
    return next((unit for end, unit in UNITS.items() if key.endswith(end)), "")


def _default(field) -> str:
    if field.is_required():
        return "must be given"
    if field.default is None or hasattr(field.default, "model_fields"):
        return "none"
    return f"`{str(field.default).lower() if isinstance(field.default, bool) else field.default}`"


def setup(app: Sphinx) -> dict[str, bool]:
    """Add the directives to Sphinx."""
    app.connect("source-read", fill)
    app.add_directive("scene-section", SceneSection)
    return {"parallel_read_safe": True}
