"""The velocity estimators, by the name used in scenes and on the command line.

To add one: `hdl/NAME.py`, `model/NAME.py`, `tests/test_NAME.py`, and one line in `ESTIMATORS`.

An estimator's module in `hardwall.model` provides

- `OUTPUTS`: the names of its selectable outputs, the default first;
- `Gains`: a frozen dataclass of gains, units in their names; `Gains.default(axis)` gives those of a `spec.AxisSpec`
  that names none, from its rates, ranges and count size alone;
- `Design(axis, gains)`: formats, run-time words and latency derived from a `spec.AxisSpec`, with attributes `inputs`
  (names of what it uses of `quadrature.Seen`), `velocity` (a `fixed.SQ`, counts a sample), `words` (tuple of
  `words.Word`; one named `NAME_output`, hyphens as underscores, selects among several outputs), `flags` (names of its
  saturation flags, bit 0 first), `latency` (clocks from strobe to valid), and methods `params(words)` and
  `float_params(gains, output, si)`;
- `START` and `FLOAT_START`: the states before the first sample; or, for an estimator whose state holds an array, a
  method `start(floating)` of `Design`, which makes a new one for every run;
- kernels registered with `estimate` for its `Params` and its `FloatParams`.

The module of the same name in `hardwall.hdl` provides `Estimator`, the component, constructed from a `Design`.
"""

import importlib
from types import ModuleType

ESTIMATORS = {
    "fdm": "finite_difference",
    "levant": "levant",
    "butterworth": "butterworth",
    "kalman": "kalman",
    "period": "period",
    "period-count": "period_count",
    "levant-edge": "levant_edge",
    "levant-semi-implicit": "levant_semi_implicit",
    "levant-implicit": "levant_implicit",
    "levant-adaptive": "levant_adaptive",
    "window": "window",
    "foaw": "foaw",
}


def uses_stamps(name: str) -> bool:
    """Return whether estimator `name` needs the clock stamps of edges, beside the count."""
    return load(name).Design.inputs != ("count",)


def output_word(name: str) -> str:
    """Return the name of the run-time word that selects among the outputs of estimator `name`."""
    return f"{name.replace('-', '_')}_output"


def choose(name: str, output: str) -> dict[str, int]:
    """Return the run-time word, by name, that selects an output of estimator `name`; none where there is one only.

    Raises:
        ValueError: if the estimator has no such output.
    """
    outputs = load(name).OUTPUTS
    if output not in outputs:
        raise ValueError(f"output of {name} must be one of {', '.join(outputs)}, not {output!r}")
    return {output_word(name): outputs.index(output)} if len(outputs) > 1 else {}


def load(name: str, package: str = __package__) -> ModuleType:
    """Return the module of estimator `name` in `package` (this one, or `hardwall.hdl`).

    Raises:
        ValueError: if no estimator has that name.
    """
    if name not in ESTIMATORS:
        raise ValueError(f"estimator must be one of {', '.join(ESTIMATORS)}, not {name!r}")
    return importlib.import_module(f"{package}.{ESTIMATORS[name]}")
