"""How exact the mean of an estimate is where counts come in a short pattern."""

from hardwall.model.estimators.estimate import EstimatorDesign
from hardwall.model.estimators.levant_higher_design import MEAN_ERROR
from hardwall.model.estimators.levant_higher_design import Design as Higher


def mean_error(design: EstimatorDesign) -> float:
    """Return how far the mean of the first output may be from a steady speed, counts a sample; 0 if it is exact."""
    if not isinstance(design, Higher):
        return 0.0
    return MEAN_ERROR[design.order, design.filtering] * design.lipschitz ** (1 / (design.order + 1))
