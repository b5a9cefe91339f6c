"""The command `trade`."""

from collections.abc import Callable, Hashable

from ..sim.jobs import rounds
from ..sim.scene.case import Case
from ..sim.studies import trade_runs
from ..sim.walls.zwidth import STARTS, Map
from .errors import BadInput
from .maps import Maps
from .options import StartsOption
from .scenes import SceneArgument, refuse, refuse_for_maps
from .study import StudyOptions, study
from .terminal import progress

LEAST = 5
"""The number of starts below which no interval of theirs tells a move from chance."""


class _Runs:
    """A `trade_runs.Runs` that runs hits as the options say; timed hits run alone, in this process."""

    def __init__(self, options: StudyOptions, starts: int):
        self._options, self.starts = options, starts

    def maps(self, backend: str, cases: list[Case]) -> list[Map]:
        return Maps(self._options, backend, self.starts)("maps", cases)

    def medians(self, contestants: dict[Hashable, Callable[[], float]], times: int) -> dict[Hashable, float]:
        with progress("times", times * len(contestants)) as advance:
            begun = iter(range(times * len(contestants)))
            return rounds.medians(contestants, times, lambda _: advance(next(begun)))


@study("workers", "resume", "set_", "plot")
def command(options: StudyOptions, scene: SceneArgument = "drive-2011", starts: StartsOption = STARTS) -> None:
    changes = options.changes()
    if starts < LEAST:
        raise BadInput(f"--starts must be {LEAST} or more, for fewer tell no move from chance, not {starts}")
    refuse_for_maps(changes, "it takes two of the paper's")
    refuse(changes, ("solver",), "it is one of the settings")
    options.finish(trade_runs.study(Case.of(scene, changes), _Runs(options, starts)))
