"""What came of the mutants of a block: killed, proven equivalent, or left, for a written reason or for none."""

from dataclasses import dataclass, field
from pathlib import Path

from signoff.reasons import Reason

from .equivalent import EQUIVALENT

GOAL = 0.95
"""The share of the mutants that must be killed, of those that are not proven equivalent."""
REASONS = Path(__file__).with_name("reasons.toml")


@dataclass(frozen=True)
class Fate:
    """What came of a mutant.

    Attributes:
        mutant: the size of the block, and what the mutant changes in it.
        killed_by: the test that failed, and how; None if none did.
        known: of one that survived: whether it is equivalent, or what is known otherwise.
    """

    mutant: str
    killed_by: str | None
    known: str = ""

    @property
    def equivalent(self) -> bool:
        return self.killed_by is None and self.known == EQUIVALENT

    @property
    def left(self) -> bool:
        """Whether a test could perhaps kill it, and none does."""
        return self.killed_by is None and not self.equivalent


@dataclass(frozen=True)
class Result:
    """What came of all mutants of a block.

    Attributes:
        block: its name.
        fates: of every mutant.
        reasons: the reasons that are written for it.
        ours: whether the mutants are those that the reasons were written for; others may leave none of theirs.
    """

    block: str
    fates: list[Fate] = field(repr=False)
    reasons: list[Reason]
    ours: bool = True

    @property
    def killed(self) -> int:
        return sum(fate.killed_by is not None for fate in self.fates)

    @property
    def equivalent(self) -> int:
        return sum(fate.equivalent for fate in self.fates)

    @property
    def left(self) -> list[Fate]:
        return [fate for fate in self.fates if fate.left]

    @property
    def unexplained(self) -> list[Fate]:
        """Mutants that are left for no written reason."""
        return [fate for fate in self.left if not any(reason.is_of(fate.mutant) for reason in self.reasons)]

    @property
    def stale(self) -> list[Reason]:
        """Reasons for what a test kills or what was not drawn: a proof has only so much time, and may not come."""
        alive = [fate.mutant for fate in self.fates if fate.killed_by is None]
        return [reason for reason in self.reasons if self.ours and not any(map(reason.is_of, alive))]

    @property
    def share(self) -> float:
        """The share killed of those that are not equivalent."""
        others = len(self.fates) - self.equivalent
        return self.killed / others if others else 1.0

    @property
    def ok(self) -> bool:
        """Whether enough are killed, every one that is left has its reason, and no reason is stale."""
        return bool(self.fates) and self.share >= GOAL and not self.unexplained and not self.stale

    @property
    def row(self) -> list[str]:
        """Its row of the table."""
        numbers = (len(self.fates), self.killed, self.equivalent, len(self.left), len(self.unexplained))
        return [self.block, *map(str, numbers), f"{100 * self.share:.1f}", "good" if self.ok else "FAILED"]

    @property
    def explanation(self) -> str:
        """Every mutant that is left without a reason, and every stale reason; one line for each."""
        left = [f"{self.block}: left, {fate.known}: {fate.mutant}" for fate in self.unexplained]
        stale = [f"{self.block}: killed or not drawn, so that its reason must go: {each.name}" for each in self.stale]
        return "".join(f"{line}\n" for line in left + stale)
