"""The command `bench`."""

from ..scene.load import load
from ..studies import bench
from .options import SceneArgument
from .study import StudyOptions, study
from .terminal import log


@study()
def command(options: StudyOptions, scene: SceneArgument = "mhz") -> None:
    load(scene)  # a wrong scene is refused before anything long begins
    options.finish(bench.study(scene, log.print))
