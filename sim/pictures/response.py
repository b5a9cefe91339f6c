"""The picture of an estimator's response: gain and lead against the amplitude, two panels for each frequency."""

import math

from matplotlib.figure import Figure

from ..studies.response import Responses
from .labels import label_right
from .style import BAND, THEORY, ink, looks, new_figure, page

GAIN_TOP, LEAD_LOW = 2.0, -150.0
"""Where the panels end, unless less is shown."""


@page
def draw(responses: Responses) -> Figure:
    """Return the picture, with a curve for every estimator; the band of a gain is of the starts."""
    frequencies = responses.frequencies_hz
    title = f"{responses.scene}: an estimate of a sine, by its amplitude; grey: the exact velocity"
    picture = new_figure(1.0 + 2.2 * len(frequencies), title)
    panels = picture.subplots(len(frequencies), 2, sharex=True, squeeze=False)
    known = {row["label"]: (row["estimator"], row["output"]) for row in responses.rows}
    styles = looks(list(known.values()))
    for (of_gain, of_lead), hz in zip(panels, frequencies, strict=True):
        of_gain.axhline(1.0, color=THEORY, lw=0.8)
        of_lead.axhline(0.0, color=THEORY, lw=0.8)
        ends = []
        for (name, (estimator, _)), style in zip(known.items(), styles, strict=True):
            rows = [row for row in responses.rows if (row["label"], row["frequency_hz"]) == (name, hz)]
            counts = [row["amplitude_counts"] for row in rows]
            leads = [math.nan if row["lead_deg"] is None else row["lead_deg"] for row in rows]
            of_gain.plot(counts, [row["gain"] for row in rows], **style)
            of_gain.fill_between(
                counts,
                [row["gain_from"] for row in rows],
                [row["gain_to"] for row in rows],
                color=style["color"],
                alpha=BAND,
                lw=0,
            )
            of_lead.plot(counts, leads, **style)
            known_leads = [lead for lead in leads if lead >= LEAD_LOW]
            if known_leads:
                ends.append((name, known_leads[-1], ink(estimator)))
        of_gain.set_ylabel(f"gain at {hz:g} Hz (ratio)")
        of_lead.set_ylabel(f"lead at {hz:g} Hz (degrees)")
        of_gain.set_xscale("log")
        of_gain.set_ylim(0, min(GAIN_TOP, of_gain.get_ylim()[1]))
        of_lead.set_ylim(max(LEAD_LOW, of_lead.get_ylim()[0]), of_lead.get_ylim()[1])
        label_right(of_lead, ends)
    for axes in panels[-1]:
        axes.set_xlabel("amplitude (counts)")
    return picture
