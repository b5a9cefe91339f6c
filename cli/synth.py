"""The command `synth`."""

from ..model.runtime.result import Values
from ..sim.boards.description import board_of
from ..sim.rtl.synthesis import synthesise
from .board import scene_on, spec_on
from .options import AxesOption, EstimatorOption, SeedsOption
from .scenes import DeviceOption, SceneOfBoardArgument
from .study import StudyOptions, study
from .terminal import log


@study("set_")
def command(
    options: StudyOptions,
    scene: SceneOfBoardArgument = None,
    device: DeviceOption = "ecp5-25k",
    seeds: SeedsOption = 3,
    estimator: EstimatorOption = None,
    axes: AxesOption = None,
) -> None:
    on = board_of(device)
    of = scene_on(on, options.changes(controller__estimator=estimator), scene)
    with log.status(f"{device}: Yosys, then nextpnr with {seeds} seeds"):
        report = synthesise(spec_on(of, axes, on), device, range(1, seeds + 1), of.glitch_clocks)
    options.finish(Values({"scene": of.name} | report))
