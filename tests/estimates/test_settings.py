"""Settings of a replay: gains, jerk and edge error by their keys, in counts and seconds, and those that are refused."""

from dataclasses import replace

import pytest

from hardwall.model.estimators.registry import ESTIMATORS
from hardwall.model.record_axis import DECODER_CLOCKS
from hardwall.model.record_time import RecordTime
from hardwall.model.spec import AxisSpec
from hardwall.sim.estimates.replay import replay
from hardwall.sim.estimates.replay_plan import ArgumentError, plan
from hardwall.sim.estimates.settings import SettingError, Settings, in_counts, names_of, settings_of
from stimuli.lengths import LONG
from stimuli.replays import BOUND, COARSEN, recording, swing

RATES = 333.0, 1000.0
"""One that no power of two divides, and one of whole milliseconds."""
OF_RATES = [(name, rate) for name in (ESTIMATORS if LONG else ["levant", "levant-edge"]) for rate in RATES]
"""What runs: every estimator by `make soak`, and else one of counts and one of stamps."""


@pytest.mark.parametrize(("estimator", "rate"), OF_RATES)
def test_the_gains_of_a_report_can_be_given_back(estimator, rate):
    """Units and powers of time are those of the report: the words are the same, to the last."""
    made = recording(swing().counts, rate)
    derived = replay(made, estimator, coarsen=COARSEN)
    given = replay(made, estimator, coarsen=COARSEN, settings=given_back(estimator, derived.gains))
    assert given.gains == pytest.approx(derived.gains, rel=1e-12)
    assert given.velocity_sha256 == derived.velocity_sha256


def gains_of(spec: AxisSpec, rate: float) -> dict[str, float]:
    """Return the gains of an axis, in counts and true seconds."""
    return {in_counts(name): value for name, value in RecordTime(rate).named(spec.design.gains).items()}


def given_back(estimator: str, gains: dict[str, float]) -> Settings:
    """Return the settings of the gains of a report."""
    assert list(gains) == list(names_of(estimator))
    return settings_of({f"controller.gains.{estimator}.{name}": value for name, value in gains.items()}, estimator)


@pytest.mark.parametrize("rate", RATES)
@pytest.mark.parametrize("estimator", ESTIMATORS)
def test_the_gains_of_a_report_give_the_words_of_its_axis(estimator, rate):
    made = recording(swing().counts, rate)
    derived = plan(made, estimator, "fixed", COARSEN).spec
    gains = gains_of(derived, rate)
    given = plan(made, estimator, "fixed", COARSEN, settings=given_back(estimator, gains)).spec
    assert gains_of(given, rate) == pytest.approx(gains, rel=1e-12)
    assert given.design.estimator.words == derived.design.estimator.words


def test_gains_change_the_words_and_the_report():
    gains = {"lambda_sqrt_counts_per_s": 900.0, "alpha_counts_per_s2": 5e5}
    changes = {f"controller.gains.levant.{name}": value for name, value in gains.items()}
    found = replay(swing(), coarsen=COARSEN, settings=settings_of(changes, "levant"))
    assert found.gains == pytest.approx(gains, rel=1e-12)
    assert found.velocity_sha256 != replay(swing(), coarsen=COARSEN).velocity_sha256


def test_a_jerk_sets_the_gains_of_kalman():
    settings = settings_of({"controller.jerk_max_counts_per_s3": 3e6}, "kalman")
    told, untold = (
        replay(swing(), "kalman", None, "fixed", 1, BOUND, settings=each)
        for each in (settings, settings_of({}, "kalman"))
    )
    assert told.gains["acceleration_time_s"] == pytest.approx((4 / 3e6) ** (1 / 3), rel=1e-12)
    assert told.gains["acceleration_time_s"] > untold.gains["acceleration_time_s"]


def test_jerk_and_edge_error_set_the_gains_that_follow_from_them():
    changes = {"controller.jerk_max_counts_per_s3": 3e6, "controller.edge_error_max_counts": 0.25}
    found = replay(swing(), "edge-kalman", None, "fixed", 1, BOUND, settings=settings_of(changes, "edge-kalman"))
    assert found.gains["edge_error_counts"] == 0.25
    assert found.gains["jerk_counts_per_s3"] == pytest.approx(3e6, rel=1e-12)
    # The axis counts 1024 samples a second.
    assert found.spec.jerk_max_m_per_s3 == pytest.approx(3e6 * 1.024**3, rel=1e-12)


def test_no_gain_of_a_replay_is_in_metres():
    names = [name for estimator in ESTIMATORS for name in names_of(estimator)]
    assert "noise_rms_counts" in names
    assert [name for name in names if name.endswith("_m") or "_m_" in name] == []


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"wall.stiffness_n_per_m": 1.0}, "'wall.stiffness_n_per_m' is not a key of a replay with levant, which has"),
        ({"controller.gains.kalman.x": 1.0}, "is not a key of a replay with levant"),
        ({"controller.gains.levant.alpha_counts_per_s2": 1.0}, "must have all its gains: lambda_sqrt_counts_per_s is"),
        ({"controller.jerk_max_counts_per_s3": "x"}, "jerk_max_counts_per_s3 must be a number of 1e-15 to 1e+15, not"),
        ({"controller.jerk_max_counts_per_s3": None}, "must be a number of 1e-15 to 1e+15, not None"),
        ({"controller.edge_error_max_counts": 2}, "edge_error_max_counts must be a number of 1e-06 to 1, not 2"),
        ({"controller.edge_error_max_counts": True}, "must be a number of 1e-06 to 1, not True"),
    ],
)
def test_settings_that_are_refused(changes, said):
    with pytest.raises(SettingError) as error:
        settings_of(changes, "edge-kalman" if "max" in min(changes) else "levant")
    assert said in str(error.value)


@pytest.mark.parametrize("estimator", ESTIMATORS)
def test_a_bound_that_sets_no_gain_of_an_estimator_is_refused(estimator):
    """It was taken, and changed nothing."""
    spec = plan(swing(), estimator, "fixed", COARSEN, BOUND).spec
    for name, field, value in (
        ("jerk_max_counts_per_s3", "jerk_max_m_per_s3", 1.0),
        ("edge_error_max_counts", "edge_error_max_counts", 1e-3),
    ):
        gains = [replace(spec, **{field: each}).design.gains for each in (value, 10 * value)]
        changes = {f"controller.{name}": value}
        if gains[0] != gains[1]:
            assert getattr(settings_of(changes, estimator), name) == value
        else:
            with pytest.raises(SettingError, match=f"is not a key of a replay with {estimator}, which has "):
                settings_of(changes, estimator)


def test_a_bound_beside_the_gains_that_it_would_set_is_refused():
    changes = {f"controller.gains.edge-kalman.{name}": 0.5 for name in names_of("edge-kalman")}
    assert len(settings_of(changes, "edge-kalman").gains) == len(changes)
    with pytest.raises(SettingError, match=r"^controller\.edge_error_max_counts must be absent beside the gains"):
        settings_of(changes | {"controller.edge_error_max_counts": 0.5}, "edge-kalman")


def test_an_estimator_without_gains_has_no_keys():
    with pytest.raises(SettingError, match=r"is not a key of a replay with fdm, which has none$"):
        settings_of({"controller.gains.fdm.x": 1.0}, "fdm")


def test_gains_that_no_axis_has_are_refused():
    settings = Settings({"lambda_sqrt_counts_per_s": 1e-15, "alpha_counts_per_s2": 1e15})
    with pytest.raises(ArgumentError, match=r"^settings must give an axis \(as if 1024 samples were a second\): "):
        replay(swing(), settings=settings)


@pytest.mark.parametrize(
    ("estimator", "gain", "factor"), [("levant", "lambda_sqrt_counts_per_s", 0.125), ("least-squares", "window_s", 8.0)]
)
def test_a_sample_has_clocks_for_the_longer_path_of_given_gains(estimator, gain, factor):
    """The clocks of a sample were chosen for the derived gains, before whose drive no edge of the next sample came."""
    made = swing()
    derived = plan(made, estimator, "fixed", COARSEN, BOUND).spec
    gains = {name: value * (factor if name == gain else 1) for name, value in gains_of(derived, made.rate_hz).items()}
    spec = plan(made, estimator, "fixed", COARSEN, BOUND, Settings(gains)).spec
    needed = spec.design.latency_to_drive + DECODER_CLOCKS
    assert derived.clocks_per_sample < needed <= spec.clocks_per_sample
