"""Records at any rate: gains, words and bounds of an axis in true seconds are those of the same axis on a record."""

import pytest

from hardwall.model.checks import FieldError
from hardwall.model.estimators.registry import ESTIMATORS
from hardwall.model.motion import Motion
from hardwall.model.record_axis import axis_of
from hardwall.model.record_time import SECOND, RecordTime, power_of_name, power_of_unit
from hardwall.model.spec import AxisSpec
from stimuli.specs import PAPER

TIME = RecordTime(PAPER["sample_hz"])
MOTION = Motion(count=PAPER["count_m"], acceleration_max=12.0, speed_max=2.0, travel=0.15, jerk_max=500.0)


@pytest.fixture(params=ESTIMATORS)
def pair(request) -> tuple[AxisSpec, AxisSpec]:
    """Return an axis in true seconds, and the axis of a record of the same motion, with as many clocks a sample."""
    of_record = axis_of(MOTION, TIME, request.param)
    clock_hz = PAPER["sample_hz"] * of_record.clocks_per_sample
    true = {**PAPER, "clock_hz": clock_hz, "jerk_max_m_per_s3": 500.0, "glitch_clocks": 0}
    return AxisSpec(**true, estimator=request.param), of_record


def test_default_gains_are_the_same_in_true_seconds(pair):
    true, of_record = pair
    named = TIME.named(of_record.design.gains)
    assert named == pytest.approx(vars(true.design.gains), rel=1e-9)
    assert vars(TIME.gains(true.design.gains)) == pytest.approx(vars(of_record.design.gains), rel=1e-9)


def test_words_have_the_same_ranges_and_codes_in_true_seconds(pair):
    true, of_record = pair
    own = {word.name: word for word in of_record.design.estimator.words}
    words = TIME.words(own.values())
    assert len(words) == len(true.design.estimator.words)
    for word in true.design.estimator.words:
        assert words[word.name].format == word.format
        for code in (word.low, word.reset, word.high):
            assert words[word.name].to_si(code) == pytest.approx(word.to_si(code), rel=1e-9)
            scaled = TIME.settings(words, {word.name: word.to_si(code)})
            assert own[word.name].from_si(scaled[word.name]) == code


def test_a_setting_beyond_its_word_is_refused_in_true_seconds():
    axis = axis_of(MOTION, TIME, "levant")
    words = TIME.words(axis.design.estimator.words)
    most = AxisSpec(**PAPER).design.estimator.words[0].si_max
    with pytest.raises(FieldError, match=rf"levant_lambda must be [\d.]+ to {most:g} m\^\(1/2\)/s, not 1000"):
        TIME.settings(words, {"levant_lambda": 1000.0})
    with pytest.raises(FieldError, match="levant_beta is no setting; accepted are levant_lambda, levant_alpha"):
        TIME.settings(words, {"levant_beta": 1.0})


@pytest.mark.parametrize(
    ("unit", "power"),
    [("", 0), ("m", 0), ("s", -1), ("Hz", 1), ("1/s", 1), ("m/s^2", 2), ("m^(1/2)/s", 1), ("m^(1/2)/s^(3/2)", 1.5)],
)
def test_powers_of_units(unit, power):
    assert power_of_unit(unit) == power


def test_no_gain_has_an_ending_of_unknown_power():
    """The endings of names with a time in them are all known: others are lengths, counts and numbers."""
    names = {name for design in ESTIMATORS.values() for name in design.gains_class.__dataclass_fields__}
    lengths = {name for name in names if power_of_name(name) == 0}
    assert lengths == {"band_counts", "edge_error_counts", "noise_rms_m", "order", "points"}


@pytest.mark.parametrize("rate", [0, -1.0, float("nan"), 1e10, float("inf")])
def test_rates_that_are_refused(rate):
    with pytest.raises(ValueError, match=r"sample_hz must be 1e-06 to 1e\+09, not"):
        RecordTime(rate)


def test_what_is_no_number_is_refused():
    with pytest.raises(TypeError, match="sample_hz must be a number, not '1'"):
        RecordTime("1")


@pytest.mark.parametrize(
    ("rate", "second"), [(1e-6, 1024), (1000.0, 1024), (1024.0, 1024), (1024.1, 2048), (1e6, 2**20), (1e9, 2**30)]
)
def test_a_second_is_a_true_one_or_longer(rate, second):
    assert RecordTime(rate).second == second


def test_there_and_back_is_the_same():
    assert RecordTime(SECOND).to_axis(3.0, 2) == RecordTime(2**20).to_axis(3.0, 2) == 3.0
    time = RecordTime(0.3)
    assert time.from_axis(time.to_axis(7.0, 1.5), 1.5) == pytest.approx(7.0, rel=1e-14)
