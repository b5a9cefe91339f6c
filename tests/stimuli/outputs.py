"""Every output of every estimator."""

from hardwall.model.estimators.registry import ESTIMATORS

EVERY_OUTPUT = [(name, output) for name, design in ESTIMATORS.items() for output in design.outputs]
