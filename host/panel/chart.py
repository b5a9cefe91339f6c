"""The drawing of a capture as the library of charts takes it: three drawings over one time, all zoomed together."""

from typing import Any

import numpy as np

from ..capture import Captured

TRACES = (
    ("position", "mm", "position_m", 1e3, "#1d2733"),
    ("velocity", "mm/s", "velocity_m_per_s", 1e3, "#2f7d32"),
    ("acceleration", "m/s\u00b2", "acceleration_m_per_s2", 1.0, "#2f7d32"),
    ("force", "N", "force_n", 1.0, "#b25500"),
)
"""A trace: its name, its unit, the array, the number of these units in the SI unit, and a colour. Records have either
the velocity or the acceleration."""
HEIGHT, GAP, TOP = 25, 6, 3
"""The height of a drawing, the gap between two and above the first, percent of the card."""
MICROSECONDS_BELOW_S = 1e-3
"""The length of a capture whose time is in milliseconds from there on."""


def empty() -> dict[str, Any]:
    """Return the options of a chart without anything."""
    return {"animation": False}


def chart_of(captured: Captured) -> dict[str, Any]:
    """Return the options of the chart of a capture."""
    time_s = captured.time_s
    unit, scale = ("\u00b5s", 1e6) if time_s[-1] - time_s[0] < MICROSECONDS_BELOW_S else ("ms", 1e3)
    traces = [trace for trace in TRACES if getattr(captured, trace[2]) is not None]
    places = list(range(len(traces)))
    lines = [
        _line(place, name, colour, _points(scale * time_s, factor * getattr(captured, array)))
        for place, (name, _, array, factor, colour) in enumerate(traces)
    ]
    below = {"name": f"time after the trigger ({unit})", "nameLocation": "middle", "nameGap": 24}
    last = _time_axis(places[-1]) | below | {"axisLabel": {"hideOverlap": True}}
    return {
        **empty(),
        "grid": [
            {"left": 78, "right": 18, "top": f"{TOP + place * (HEIGHT + GAP)}%", "height": f"{HEIGHT}%"}
            for place in places
        ],
        "xAxis": [*map(_time_axis, places[:-1]), last],
        "yAxis": [_value_axis(place, f"{name} ({unit_of})") for place, (name, unit_of, *_) in enumerate(traces)],
        "tooltip": {"trigger": "axis"},
        "axisPointer": {"link": [{"xAxisIndex": "all"}]},
        "dataZoom": [{"type": "inside", "xAxisIndex": places, "filterMode": "filter"}],
        "series": lines,
    }


def _time_axis(place: int) -> dict[str, Any]:
    return {"type": "value", "gridIndex": place, "min": "dataMin", "max": "dataMax", "axisLabel": {"show": False}}


def _value_axis(place: int, name: str) -> dict[str, Any]:
    about = {"name": name, "nameLocation": "middle", "nameGap": 58}
    return {"type": "value", "gridIndex": place, "scale": True, **about}


def _line(place: int, name: str, colour: str, points: list[list[float]]) -> dict[str, Any]:
    """Return a line of steps, with a mark at the trigger."""
    mark = {"silent": True, "symbol": "none", "label": {"show": False}, "data": [{"xAxis": 0}]}
    return {
        **{"type": "line", "name": name, "xAxisIndex": place, "yAxisIndex": place, "step": "end", "showSymbol": False},
        **{"lineStyle": {"width": 1.2, "color": colour}, "itemStyle": {"color": colour}, "data": points},
        "markLine": mark | {"lineStyle": {"color": "#b00020", "type": "dashed"}},
    }


def _points(time: np.ndarray, values: np.ndarray) -> list[list[float]]:
    """Return points of six digits, which are more than a screen shows."""
    return [[float(f"{at:.6g}"), float(f"{value:.6g}")] for at, value in zip(time, values, strict=True)]
