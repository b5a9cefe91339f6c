"""The command `choose`."""

from ..sim.estimates.accuracy import measure
from ..sim.jobs.store import Store
from ..sim.studies import choose
from .costs import costs_of
from .errors import BadInput
from .options import BackendOption, EstimatorsOption, RateOption, SeedsOption
from .scenes import DeviceOption, EncoderSetOption, curves_of, encoder_of, rates_of
from .study import StudyOptions, study


@study("workers")
def command(
    options: StudyOptions,
    rate: RateOption = 1e6,
    wanted: EstimatorsOption = None,
    backend: BackendOption = "fixed",
    device: DeviceOption = "ecp5-25k",
    seeds: SeedsOption = 3,
    assignments: EncoderSetOption = None,
) -> None:
    (sample_hz,) = rates_of(str(rate), "--rate")
    pairs = [(curve.estimator, curve.output) for curve in curves_of(wanted)]
    situations = choose.situations_with(encoder_of(assignments))
    jobs = choose.jobs(pairs, sample_hz, backend, situations)
    try:
        measured = options.results(f"situations, {backend}", measure, jobs, Store("accuracy"))
    except ValueError as error:
        raise BadInput(str(error)) from None
    costs = costs_of(options, list(dict.fromkeys(name for name, _ in pairs)), device, seeds)
    options.finish(choose.Choice(choose.table(pairs, measured, costs, situations), situations))
