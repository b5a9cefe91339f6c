"""Calls of the command line as no one would make them: hostile values for every option, key and file.

Options, arguments and scene keys are read from the program, so that what is added later is tried too. Most parts of a
call are good, or the first check would refuse nearly all of them.
"""

import os
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, get_args

import typer
from hypothesis import strategies as st
from hypothesis.strategies import SearchStrategy
from pydantic import BaseModel

from hardwall.cli import group
from hardwall.model.estimators import registry
from hardwall.sim.boards.description import BOARDS
from hardwall.sim.scene.load import names, read
from hardwall.sim.scene.schema import Scene

NUMBERS = (
    *("0", "-0.0", "-1", "1", "0.5", "7", "1e-320", "5e-324", "1e-300", "1e-12"),
    *("1e6", "1e9", "1e18", "1e300", "1e308"),
    *("-1e308", "1e400", "-1e400", "nan", "inf", "-inf", "NaN", "Infinity", "0x10", "1_000", "1,5", "1e", "\u0663"),
    *("2147483648", "9223372036854775808", "-9223372036854775809", "18446744073709551616", "1" + "0" * 40),
    *("9" * 400, "9" * 5000),
)
TEXTS = (
    *("-", "--", "---", "a", "all", "none", "None", "null", "true", "[]", "{}", "''", "%s"),
    *("", " ", "[1, 2]", '"', "\\"),
    *("{0}", "a\nb", "a\r\nb", "\t", "\x1b[31m", "\x7f", "\u202e", "\xe9", "\u65e5\u672c", "\U0001f916", "\udcff"),
    *("[red]x[/red]", "[/]", ",", ",,", ":", "::", "$(true)", "`true`", ";", "|", "*", "~", "#", "=", "a=b=c"),
    *("u:u", "levant:u:u1", "levant:u7", "a" * 5000, "../" * 40),
)
PLACES = (
    *("", ".", "/", "/dev/null", "/dev/zero", "/dev/full", "/dev/stdin", "/proc/self/mem", "/proc/x", "/nowhere/file"),
    *("folder", "pipe", "absent", "a" * 300, "b" * 5000, "new\nline", "\udcff", "two words", "-", "scene.toml/inner"),
)
STEMS = (
    *("", "out", "folder", "pipe", "absent/deep/out", "/dev/out", "/proc/x/out", "a" * 300, "b" * 5000, "new\nline"),
    *("two words", "\udcff"),
)
SUFFIXES = (".png", ".svg", ".pdf", ".gif", ".csv", ".npz", ".fst", ".json", ".toml", ".PNG", ".", "")

GOOD: dict[str, tuple[str, ...]] = {
    "scene": (*names(), "scene.toml"),
    "beside": ("seed-2011", "fit-2011"),
    "estimator": tuple(registry.ESTIMATORS),
    "wanted": ("levant", "levant:u1", "fdm,kalman", "proposed", "fdm-500", "all"),
    "output": ("u", "u1", "best-fit"),
    "backend": ("fixed", "float"),
    "rates": ("1e3", "1e3,2e3", "10000"),
    "tried": ("1e3,1e4", "10000"),
    "rate": ("1000", "1e4"),
    "sample_rate": ("1000", "1e4"),
    "recordings": ("recording.csv:counts", "recording.csv"),
    "signal": ("paper", "stop", "flicker", "steady:5", "recording.csv:counts"),
    "column": ("counts", "time_s"),
    "time": ("time_s", "none"),
    "time_unit": ("s", "ms"),
    "unit": ("counts", "rad"),
    "count": ("1", "2pi/2048"),
    "counter_bits": ("16", "32"),
    "counter_modulus": ("4000",),
    "gaps": ("refuse", "hold", "split"),
    "channels": ("1,2", "A,B"),
    "coarsen": ("1", "4"),
    "file": ("recording.csv",),
    "files": ("report.json",),
    "plot": ("out.png", "out.svg", "out.pdf"),
    "trace": ("out.npz",),
    "out": ("out.csv",),
    "csv": ("out.csv",),
    "act": ("save", "load", "diff"),
    "saved": ("config.toml",),
    "folder": ("verilog",),
    "workers": ("1", "2"),
    "scheduler": ("tcp://127.0.0.1:1",),
    "seeds": ("1", "2"),
    "sines": ("1", "7"),
    "figure": ("1", "2"),
    "speed": ("0", "1"),
    "tcp": ("0",),
    "seconds": ("0.01",),
    "port": ("tcp://127.0.0.1:1", "/dev/null", "pipe", "virtual"),
    "host": ("127.0.0.1",),
    "http": ("0",),
    "words": ("wall_stiffness=1e3", "supervisor_force_limit=5"),
    "baud": ("921600", "115200"),
    "identity": ("0123456789abcdef",),
    "at": ("0", "1e-3"),
    "board": tuple(BOARDS),
    "program": ("sram", "flash"),
    "device": ("ecp5-25k", "ice40-up5k", "gw1nr-9"),
    "stiffness": ("0", "1e3", "10e3"),
    "damping": ("0", "20"),
    "before": ("0.01", "0"),
    "after": ("0.05",),
    "acceleration_max": ("1", "50"),
    "encoder_phase_error": ("0.1", "0"),
    "frequencies": ("20", "1,10,100"),
    "amplitude": ("0.1", "1"),
    "speeds": ("50", "10,200"),
    "window": ("2", "0.5"),
}
"""Good values by the name of the parameter; a parameter that is absent has only hostile ones."""
SHORT = {
    "protocol.start_m": "-0.0005", "protocol.settle_s": "0.1", "protocol.mean_s": "0.01", "protocol.measure_s": "0.02",
}  # fmt: skip
"""Scene keys that make a hit short enough to be run thousands of times."""
OF_A_REPLAY = "controller.edge_error_max_counts=0.2"
"""A key of a replay, which has no scene."""


@dataclass(frozen=True)
class Call:
    """A call of the command line, the files in the folder where it is made, and variables of its environment."""

    arguments: tuple[str, ...]
    files: dict[str, bytes] = field(default_factory=dict)
    environ: dict[str, str] = field(default_factory=dict)

    def put(self, folder: Path) -> None:
        """Make the files, a folder and a pipe without a writer."""
        for name, content in self.files.items():
            (folder / name).write_bytes(content)
        (folder / "folder").mkdir()
        os.mkfifo(folder / "pipe")


def keys(section: type[BaseModel] = Scene, before: str = "") -> Iterator[str]:
    """Yield every dotted key of a scene, the sections among them."""
    for name, known in section.model_fields.items():
        yield before + name
        for kind in (known.annotation, *get_args(known.annotation)):
            if isinstance(kind, type) and issubclass(kind, BaseModel):
                yield from keys(kind, f"{before}{name}.")


KEYS = sorted(set(keys()))


def _mostly(good: SearchStrategy, hostile: SearchStrategy) -> SearchStrategy:
    """Return a strategy that is good five times out of six."""
    return st.integers(0, 5).flatmap(lambda number: good if number else hostile)


def _value() -> SearchStrategy[str]:
    return st.one_of(st.sampled_from(NUMBERS), st.sampled_from(TEXTS), st.floats().map(repr), st.integers().map(str))


def _text() -> SearchStrategy[str]:
    """Return texts that a call can have: without NUL."""
    return st.text(st.characters(exclude_characters="\0", exclude_categories=("Cs",)), max_size=12)


def _path() -> SearchStrategy[str]:
    named = st.tuples(st.sampled_from(STEMS), st.sampled_from(SUFFIXES)).map("".join)
    return st.one_of(st.sampled_from(PLACES), named)


def _hostile() -> SearchStrategy[str]:
    return st.one_of(_value(), _path(), _text())


def _key() -> SearchStrategy[str]:
    misspelt = st.tuples(st.sampled_from(KEYS), st.sampled_from(("x", ".", "..x", ".mass_kg", " ", "\n"))).map("".join)
    return _mostly(st.sampled_from(KEYS), st.one_of(misspelt, _text(), st.sampled_from(TEXTS)))


def assignments() -> SearchStrategy[list[str]]:
    """Return lists of `--set` options."""
    one = _mostly(st.tuples(_key(), _value()).map("=".join), _hostile())
    return st.lists(one, max_size=3).map(lambda each: [word for text in each for word in ("--set", text)])


@st.composite
def _spoilt(draw: st.DrawFn, text: str) -> bytes:
    """Return a text with a few of its lines or bytes changed."""
    lines = text.splitlines()
    for _ in range(draw(st.integers(0, 3))):
        place = draw(st.integers(0, len(lines) - 1)) if lines else 0
        change = draw(st.sampled_from(("drop", "twice", "value", "junk", "deep", "long")))
        line = lines[place] if lines else ""
        if change == "drop":
            del lines[place : place + 1]
        elif change == "twice":
            lines.insert(place, line)
        elif change == "value" and "=" in line:
            lines[place] = f"{line.partition('=')[0]}= {draw(_value())}"
        elif change == "value" and "," in line:
            cells = line.split(",")
            cells[draw(st.integers(0, len(cells) - 1))] = draw(_value())
            lines[place] = ",".join(cells)
        elif change == "junk":
            lines.insert(place, draw(_text()))
        elif change == "deep":
            lines.insert(place, "x = " + "[" * 3000)
        elif change == "long":
            lines.insert(place, "z," * 20_000)
    data = "\n".join(lines).encode("utf-8", "surrogateescape")
    ending = draw(st.sampled_from(("whole", "whole", "whole", "cut", "byte", "empty", "mark")))
    place = draw(st.integers(0, len(data)))
    return {
        "whole": data,
        "cut": data[:place],
        "byte": data[:place] + draw(st.binary(max_size=3)) + data[place:],
        "empty": b"",
        "mark": b"\xef\xbb\xbf" + data,
    }[ending]


def _recording() -> str:
    return "time_s,counts\n" + "".join(f"{k / 1000:.3f},{k * k // 50}\n" for k in range(1200))


def _report() -> str:
    return (
        '{"scene": "a", "backend": "fixed", "estimator": "levant", "output": "u", "stiffness_n_per_m": 1e4,\n'
        '"damping_n_s_per_m": 20.0, "verdict": "stable", "rms_mm": 0.0, "max_force_n": 1.0,\n'
        '"estimate_rms_mm_per_s": null,\n'
        '"force_sha256": null}'
    )


def _config() -> str:
    return (
        '[board]\nidentity = "0123456789abcdef"\nclock_hz = 1000000\nclocks_per_sample = 100\n'
        "capture_registers = 16384\naxes = 1\n\n[words]\nwall_stiffness = 2000.0  # N/m\nwall_left = 0\n"
    )


@st.composite
def _parameter(draw: st.DrawFn, parameter: Any) -> list[str]:
    """Return the words of one option or argument."""
    good = GOOD.get(parameter.name)
    value = draw(_mostly(st.sampled_from(good), _hostile()) if good else _hostile())
    if isinstance(parameter, typer.core.TyperArgument):
        return [value]
    flag = draw(st.sampled_from(parameter.opts))
    return [flag] if parameter.is_flag else [flag, value]


def takes(name: str) -> dict[str, Any]:
    """Return the options and arguments of a command by their names, without `--help`."""
    return {each.name: each for each in group.loaded(name).params if each.name != "help"}


ENVIRONS = (
    *({"COLUMNS": columns} for columns in ("0", "1", "20", "1000000", "x", "-1")),
    *({name: "1"} for name in ("NO_COLOR", "FORCE_COLOR", "TTY_COMPATIBLE")),
    *({"TERM": name} for name in ("dumb", "unknown", "")),
)
"""Variables that change how a terminal is written to."""


@st.composite
def calls(draw: st.DrawFn, name: str) -> Call:
    """Return calls of a command."""
    parameters = takes(name)
    of_a_scene = "set_" in parameters and name != "replay"
    short = [word for key, value in SHORT.items() for word in ("--set", f"{key}={value}")] * of_a_scene
    words = [name, *short]
    for parameter in parameters.values():
        required = getattr(parameter, "required", False)
        if parameter.name != "set_" and draw(st.integers(0, 9)) < (9 if required else 3):
            words += draw(_parameter(parameter))
    if of_a_scene:
        words += draw(assignments())
    elif "set_" in parameters:
        words += draw(st.sampled_from(([], ["--set", OF_A_REPLAY], ["--set", f"{OF_A_REPLAY}x"])))
    if draw(st.integers(0, 19)) == 0:
        words.insert(draw(st.integers(0, len(words))), draw(_hostile()))
    files = {}
    texts = {"scene.toml": read("seed-2011"), "recording.csv": _recording(), "report.json": _report()}
    for file, text in (texts | {"config.toml": _config()}).items():
        if file in " ".join(words):
            files[file] = draw(_spoilt(text))
    return Call(tuple(words), files, draw(_mostly(st.just({}), st.sampled_from(ENVIRONS))))
