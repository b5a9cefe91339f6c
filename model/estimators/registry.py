"""The velocity estimators, by the name used in scenes and on the command line.

To add an estimator, write `hdl/estimators/NAME.py`, `model/estimators/NAME.py` and `tests/estimators/test_NAME.py`, and
add one line here and one in `hdl/estimators/registry.py`. The model's file has the design, an
`estimate.EstimatorDesign`, with its gains and its two kernels; the hardware's file has the component of that design.
`tests/estimators/test_estimate.py` tests every estimator against the contract.
"""

from . import (
    butterworth,
    count_kalman,
    edge_kalman,
    finite_difference,
    foaw,
    kalman,
    least_squares,
    levant,
    levant_adaptive,
    levant_edge,
    levant_higher,
    levant_higher_implicit,
    levant_implicit,
    levant_semi_implicit,
    mt,
    mt_divisionless,
    period,
    period_count,
    tracking_loop,
    window,
)
from .estimate import EstimatorDesign

ESTIMATORS: dict[str, type[EstimatorDesign]] = {
    "fdm": finite_difference.Design,
    "levant": levant.Design,
    "butterworth": butterworth.Design,
    "kalman": kalman.Design,
    "tracking-loop": tracking_loop.Design,
    "period": period.Design,
    "period-count": period_count.Design,
    "mt": mt.Design,
    "mt-divisionless": mt_divisionless.Design,
    "levant-edge": levant_edge.Design,
    "edge-kalman": edge_kalman.Design,
    "count-kalman": count_kalman.Design,
    "levant-semi-implicit": levant_semi_implicit.Design,
    "levant-implicit": levant_implicit.Design,
    "levant-adaptive": levant_adaptive.Design,
    "levant-2": levant_higher.Order2,
    "levant-3": levant_higher.Order3,
    "levant-2-filtering": levant_higher.Filtering2,
    "levant-3-filtering": levant_higher.Filtering3,
    "levant-2-implicit": levant_higher_implicit.Order2,
    "levant-3-implicit": levant_higher_implicit.Order3,
    "window": window.Design,
    "foaw": foaw.Design,
    "least-squares": least_squares.Design,
}


def design_of(name: str) -> type[EstimatorDesign]:
    """Return the design of the estimator of that name.

    Raises:
        ValueError: if no estimator has that name.
    """
    if name not in ESTIMATORS:
        raise ValueError(f"estimator must be one of {', '.join(ESTIMATORS)}, not {name!r}")
    return ESTIMATORS[name]
