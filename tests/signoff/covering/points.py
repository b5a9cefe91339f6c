"""Points of generated Verilog that a simulation did or did not reach: lines, branches, and toggles of bits.

Verilator counts them. Its file has one line for every point, with the fields that follow. Two rules make the points of
generated text say something of the hardware that was described:

- **Names.** A toggle counts where the signal has a name of its own. Signals with `$` in their name are what Yosys makes
  for the parts of an expression, and copies of a signal on its way to another module.
- **Start.** The branch of `$start`, which lets blocks run at the start of a simulation, does not count.

A block is tested in several sizes. A bit is covered if it is in any of them. A line or a branch is covered if it is in
any of the sizes whose text has the same lines and branches but for numbers.
"""

import hashlib
import re
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

KINDS = ("line", "branch", "toggle")
DOLLAR, UNDERSCORE = "__024", "__05F"
"""How Verilator writes `$`, and one of two `_` side by side, in a name."""
_POINT = re.compile(r"^C '(?P<fields>.*)' (?P<count>\d+)$")


@dataclass(frozen=True)
class Point:
    """A place that a simulation may reach.

    Attributes:
        kind: one of `KINDS`.
        name: what it is, for people and for the list of reasons.
        place: what distinguishes it from others of that name.
    """

    kind: str
    name: str
    place: tuple = ()

    @property
    def title(self) -> str:
        """Its kind and its name."""
        return f"{self.kind} {self.name}"


@cache
def _lines(file: str) -> tuple[str, ...]:
    return tuple(Path(file).read_text(encoding="ascii").splitlines())


def _source(fields: dict[str, str]) -> str:
    """Return the line of Verilog at a point, without what differs between sizes of a block."""
    text = _lines(fields["f"])[int(fields["l"]) - 1].strip()
    return re.sub(r"\d+('h[0-9a-f]+)?", "0", text)


def _fields(line: str) -> tuple[dict[str, str], int] | None:
    found = _POINT.match(line)
    if not found:
        return None
    pairs = (pair.split("\2", 1) for pair in found["fields"].split("\1") if pair)
    return dict(pairs), int(found["count"])


def read(file: Path, modules: Iterable[str]) -> Counter[Point]:
    """Return how often a simulation reached every point of some modules, which are named without the top.

    Raises:
        ValueError: if the file has no point of them.
    """
    counts: Counter[Point] = Counter()
    written: dict[str, list[tuple[str, str, int]]] = {kind: [] for kind in KINDS[:2]}
    for line in file.read_text(encoding="utf-8").splitlines():
        found = _fields(line)
        if not found:
            continue
        fields, count = found
        kind, _, module = fields["page"].removeprefix("v_").partition("/")
        own = module.partition(".")[2]
        if own not in modules:
            continue
        if kind == "toggle":
            if DOLLAR not in fields["o"]:
                counts[Point(kind, f"{own}.{fields['o'].replace(UNDERSCORE, '_')}")] += count
        elif "$start" not in (source := _source(fields)):
            written[kind].append((f"{own} {fields['o']}", source, count))
    texts = [[point[:2] for point in points] for points in written.values()]
    digest = hashlib.sha256(repr(texts).encode()).hexdigest()
    for kind, points in written.items():
        for number, (what, source, count) in enumerate(points):
            counts[Point(kind, f"{what}: {source}", (digest, number))] += count
    if not counts:
        raise ValueError(f"{file} has no point of {', '.join(modules)}")
    return counts


def merged(files: Iterable[Path], modules: Iterable[str]) -> Counter[Point]:
    """Return how often any of several simulations reached every point."""
    total: Counter[Point] = Counter()
    for file in files:
        for point, count in read(file, modules).items():
            total[point] += count
    return total
