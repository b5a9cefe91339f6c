"""The drawing of a capture: whichever of velocity and acceleration the records have, with its unit."""

import pytest

from hardwall.host.panel.chart import chart_of
from stimuli import results


@pytest.mark.parametrize(
    ("motion", "named", "scale"),
    [("velocity_m_per_s", "velocity (mm/s)", 1e3), ("acceleration_m_per_s2", "acceleration (m/s\u00b2)", 1.0)],
)
def test_a_chart_shows_what_was_recorded(motion, named, scale):
    captured = results.captured(motion).captured
    chart = chart_of(captured)
    assert [axis["name"] for axis in chart["yAxis"]] == ["position (mm)", named, "force (N)"]
    assert [axis.get("name") for axis in chart["xAxis"]] == [None, None, "time after the trigger (ms)"]
    values = [value for _, value in chart["series"][1]["data"]]
    assert values == pytest.approx(scale * getattr(captured, motion), rel=1e-5)
