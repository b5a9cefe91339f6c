"""The command `synth`."""

from ..jobs.result import Values
from ..rtl.synthesis import synthesise
from ..scene.load import load
from .options import DeviceOption, EstimatorOption, SceneArgument, SeedsOption
from .study import StudyOptions, study
from .terminal import log


@study("set_")
def command(
    options: StudyOptions,
    scene: SceneArgument = "mhz",
    device: DeviceOption = "ecp5-25k",
    seeds: SeedsOption = 3,
    estimator: EstimatorOption = None,
) -> None:
    of = load(scene, options.changes(controller__estimator=estimator))
    with log.status(f"{device}: Yosys, then nextpnr with {seeds} seeds"):
        report = synthesise(of.spec, device, range(1, seeds + 1), of.glitch_clocks)
    options.finish(Values({"scene": of.name} | report))
