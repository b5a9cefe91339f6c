"""The axis for a record: clocks enough in a sample for the fastest change of its count."""

import pytest

from hardwall.model.encoder.quadrature_speed import max_edge_rate
from hardwall.model.motion import Motion
from hardwall.model.record_axis import DECODER_CLOCKS, GLITCH_CLOCKS, axis_of
from hardwall.model.record_time import RecordTime


@pytest.mark.parametrize("estimator", ["fdm", "period", "kalman"])
@pytest.mark.parametrize("fastest", [1, 100, 255, 256, 257, 4095, 4096, 100_000])
def test_a_sample_has_clocks_for_the_fastest_change(estimator, fastest):
    """A motion of so many counts a sample passes one border more, if it begins and ends beside one."""
    rate = 1000.0
    motion = Motion(acceleration_max=1e4, speed_max=fastest * rate, travel=1e6)
    spec = axis_of(motion, RecordTime(rate), estimator)
    assert spec.clocks_per_sample * max_edge_rate(1.0, GLITCH_CLOCKS) >= fastest + 1
    assert spec.clocks_per_sample >= spec.design.latency_to_drive + DECODER_CLOCKS
