"""The command `trade`."""

from functools import partial

from ..sim.scene.case import Case
from ..sim.studies import trade
from ..sim.walls.mapping import STARTS
from .errors import BadInput
from .maps import mapper_of
from .options import StartsOption
from .scenes import SceneArgument, refuse, refuse_for_maps
from .study import StudyOptions, study
from .terminal import progress

LEAST = 5
"""The number of starts below which no interval of theirs tells a move from chance."""


@study("workers", "resume", "set_", "plot")
def command(options: StudyOptions, scene: SceneArgument = "drive-2011", starts: StartsOption = STARTS) -> None:
    changes = options.changes()
    if starts < LEAST:
        raise BadInput(f"--starts must be {LEAST} or more, because fewer cannot tell a move from chance, not {starts}")
    refuse_for_maps(changes, "it takes two of the paper's")
    refuse(changes, ("solver",), "it is one of the settings")
    runs = trade.Runs(partial(mapper_of, options, starts=starts), starts, progress)
    options.finish(trade.study(Case.of(scene, changes), runs))
