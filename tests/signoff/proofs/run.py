"""Properties proven side by side, each with its bugs; what is proven is kept until its text or its means change."""

import os
import re
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from importlib.metadata import version

from signoff.covering.sources import means
from signoff.kept import Findings, digest_of

from . import solver
from .property import Property
from .solver import SOLVERS, Verdict, solve
from .trace import table


@dataclass(frozen=True)
class Outcome:
    """What came of a property.

    Attributes:
        property: the property.
        verdict: the verdict on the hardware.
        bugs: the verdicts on the hardware with each of the property's bugs.
        text: the top of the proof.
    """

    property: Property
    verdict: Verdict
    bugs: tuple[Verdict, ...]
    text: str

    @property
    def ok(self) -> bool:
        """Whether the property is proven, and every bug is found."""
        return self.verdict.proved and all(verdict.refuted for verdict in self.bugs)

    @property
    def result(self) -> str:
        if self.verdict.proved:
            return "proved" if self.ok else "proved, but a bug is not found"
        return "refuted" if self.verdict.refuted else "not proved"

    @property
    def line(self) -> str:
        """One line for the progress."""
        seconds = self.verdict.seconds + sum(verdict.seconds for verdict in self.bugs)
        return f"{self.property.title}: {self.result} ({seconds:.0f} s)"

    @property
    def explanation(self) -> str:
        """The counterexample of a property that is not proven; nothing of one that is."""
        verdict = self.verdict
        if verdict.proved or verdict.trace is None:
            return ""
        where = (
            "after a reset"
            if verdict.refuted
            else "in a step of the induction, perhaps from a state that no reset leads to"
        )
        lines = "".join(f"  {line}\n" for line in verdict.failed)
        head = f"{self.property.title}: fails {where}; the waveform is {verdict.trace}\n"
        return f"\n{head}{lines}{table(verdict.trace, self.text)}\n"


def _unplaced(rtlil: str) -> str:
    """Return a module without the places in the source that its parts come from."""
    return re.sub(r"^ *attribute \\src .*\n", "", rtlil, flags=re.MULTILINE)


def run(properties: Sequence[Property], done: Callable[[Outcome], None], findings: Findings) -> list[Outcome]:
    """Return the outcomes in the order of the properties; `done` is called with each as it comes.

    What was found of a property before is not asked again.

    Raises:
        SolverError: if a tool is missing or fails.
    """
    # The hardware is made by this thread alone, because a bug changes the code that makes it.
    texts = [(known.rtlil(), [known.rtlil(bug) for bug in known.bugs]) for known in properties]
    proven_by = means(__file__, solver.__file__), [version(tool) for tool in SOLVERS]

    def outcome(known: Property, text: str, wrong: Sequence[str]) -> Outcome:
        digest = digest_of(
            proven_by, _unplaced(text), [*map(_unplaced, wrong)], known.depth, known.bounded, known.within
        )
        kept = findings.of(known.title, digest)
        if kept is not None:
            verdict, *bugs = (Verdict.of(each) for each in kept)
            return Outcome(known, verdict, tuple(bugs), text)
        verdict = solve(known.name, text, known.depth, known.bounded)
        bugs = [solve(f"{known.name}-bug-{n}", each, known.within, True) for n, each in enumerate(wrong)]
        came = Outcome(known, verdict, tuple(bugs), text)
        # What fell short is tried again, for the solver may have had too little time.
        if came.ok:
            findings.keep(known.title, digest, [each.as_json for each in (verdict, *bugs)])
        return came

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        futures = [pool.submit(outcome, known, *made) for known, made in zip(properties, texts, strict=True)]
        for future in as_completed(futures):
            done(future.result())
    return [future.result() for future in futures]
