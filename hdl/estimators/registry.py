"""The components of the velocity estimators, by the names of `hardwall.model.estimators.registry`; one line each."""

from hardwall.model.estimators.estimate import EstimatorDesign

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
from .estimate import EstimatorBlock

ESTIMATORS: dict[str, type[EstimatorBlock]] = {
    "fdm": finite_difference.Estimator,
    "levant": levant.Estimator,
    "butterworth": butterworth.Estimator,
    "kalman": kalman.Estimator,
    "tracking-loop": tracking_loop.Estimator,
    "period": period.Estimator,
    "period-count": period_count.Estimator,
    "mt": mt.Estimator,
    "mt-divisionless": mt_divisionless.Estimator,
    "levant-edge": levant_edge.Estimator,
    "edge-kalman": edge_kalman.Estimator,
    "count-kalman": count_kalman.Estimator,
    "levant-semi-implicit": levant_semi_implicit.Estimator,
    "levant-implicit": levant_implicit.Estimator,
    "levant-adaptive": levant_adaptive.Estimator,
    "levant-2": levant_higher.Estimator,
    "levant-3": levant_higher.Estimator,
    "levant-2-filtering": levant_higher.Estimator,
    "levant-3-filtering": levant_higher.Estimator,
    "levant-2-implicit": levant_higher_implicit.Estimator,
    "levant-3-implicit": levant_higher_implicit.Estimator,
    "window": window.Estimator,
    "foaw": foaw.Estimator,
    "least-squares": least_squares.Estimator,
}


def block_of(design: EstimatorDesign) -> EstimatorBlock:
    """Return the component of a design."""
    return ESTIMATORS[design.name](design)
