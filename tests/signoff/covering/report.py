"""What the tests of a block cover of it, held against the goals and the written reasons."""

import re
from collections import Counter
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

from signoff.reasons import Reason

from .points import KINDS, Point

GOALS = {"line": 1.0, "branch": 0.98, "toggle": 0.98}
_BIT = re.compile(r"(toggle [^\[:]+|.*?)(?:\[(\d+)\])?((?<=.):[01]->[01])?")
REASONS = Path(__file__).with_name("reasons.toml")


def grouped(points: list[Point]) -> list[str]:
    """Return the names of points, with the bits of a signal that miss the same toggle as one."""
    bits: dict[tuple[str, str], list[int]] = {}
    for point in points:
        signal, bit, way = _BIT.fullmatch(point.title).groups()
        bits.setdefault((signal, way or ""), []).append(int(bit or -1))
    return [
        f"{signal}[{' '.join(map(str, sorted(numbers)))}]{way}" if numbers != [-1] * len(numbers) else f"{signal}{way}"
        for (signal, way), numbers in bits.items()
    ]


@dataclass(frozen=True)
class Coverage:
    """The coverage of a block.

    Attributes:
        block: its name.
        points: how many points of each kind it has.
        missed: those that were not reached.
        reasons: the reasons that are written for it.
    """

    block: str
    points: dict[str, int]
    missed: list[Point]
    reasons: list[Reason] = field(default_factory=list)

    @classmethod
    def of(cls, block: str, counts: Counter[Point], reasons: list[Reason]) -> "Coverage":
        """Return the coverage of a block, of which every point was reached so often."""
        points = Counter(point.kind for point in counts)
        return cls(block, dict(points), [point for point, count in counts.items() if not count], reasons)

    @cached_property
    def unexplained(self) -> list[Point]:
        """Points that were not reached, for no written reason."""
        return [point for point in self.missed if not any(reason.is_of(point.title) for reason in self.reasons)]

    @property
    def stale(self) -> list[Reason]:
        """Reasons for what was reached or is not there."""
        return [reason for reason in self.reasons if not any(reason.is_of(point.title) for point in self.missed)]

    def share(self, kind: str, missed: list[Point]) -> float:
        """Return the share of the points of a kind that are not among those missed."""
        total = self.points.get(kind, 0)
        return 1 - sum(point.kind == kind for point in missed) / total if total else 1.0

    @property
    def ok(self) -> bool:
        """Whether every kind meets its goal, with the points that have a reason, and no reason is stale."""
        return not self.stale and all(self.share(kind, self.unexplained) >= goal for kind, goal in GOALS.items())

    @property
    def row(self) -> list[str]:
        """Its row of the table."""
        shares = [f"{100 * self.share(kind, self.missed):.2f}" for kind in KINDS]
        explained = len(self.missed) - len(self.unexplained)
        return [self.block, *shares, str(explained), str(len(self.unexplained)), "covered" if self.ok else "FAILED"]

    @property
    def explanation(self) -> str:
        """What is missed without a reason, and every stale reason; one line for each."""
        missed = [f"{self.block}: missed: {name}" for name in grouped(self.unexplained)]
        stale = [f"{self.block}: reached, so that its reason must go: {reason.name}" for reason in self.stale]
        return "".join(f"{line}\n" for line in missed + stale)
