"""The command `bits`."""

from ..sim.jobs.store import Store
from ..sim.studies import bits
from .options import EstimatorsOption, RateOption
from .scenes import curves_of, rates_of
from .study import StudyOptions, study


@study("workers", "plot")
def command(options: StudyOptions, rate: RateOption = 1e6, wanted: EstimatorsOption = None) -> None:
    (sample_hz,) = rates_of(str(rate), "--rate")
    jobs = bits.jobs(curves_of(wanted), sample_hz)
    rows = options.results("bits", bits.bit, jobs, Store("bits"))
    options.finish(bits.Bits([row for row in rows if row]))
