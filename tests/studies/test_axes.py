"""What several axes take: every row follows from what the placer reports, and the picture has the part's limit."""

from pathlib import Path

import pytest

from hardwall.hdl.axes.supervised import SupervisedAxes
from hardwall.sim.pictures import axes as picture
from hardwall.sim.rtl import pipeline
from hardwall.sim.studies import axes
from stimuli import results
from support.reports import check
from support.tools import stand_in


@pytest.fixture
def calls(tmp_path, monkeypatch) -> Path:
    """Set up stand-ins for the tools; return the file that lists the calls: see `stand_in`."""
    # The stand-ins do not read it.
    monkeypatch.setattr(pipeline, "to_verilog", lambda component, name: f"{name} {component.signature}")
    return stand_in(tmp_path, monkeypatch)


def test_a_job_for_every_estimator_number_and_kind():
    jobs = axes.jobs(["levant", "fdm"], (1, 16), True, 2)
    assert [(job["estimator"], job["supervised"], job["axes"]) for job in jobs] == [
        (name, supervised, number) for name in ("levant", "fdm") for supervised in (True, False) for number in (1, 16)
    ]
    assert {tuple(job["seeds"]) for job in jobs} == {(1, 2)}
    assert axes.jobs(["levant"], (1, 16), False, 2) == [job for job in jobs[:4] if job["supervised"]]


@pytest.mark.parametrize(("estimator", "number", "slots"), [("levant", 1, 14), ("levant", 32, 32), ("fdm", 2, 4)])
def test_axes_sample_as_fast_as_their_rota_allows_at_the_clock(estimator, number, slots):
    spec = axes.fastest(estimator, number)
    assert (spec.axes, spec.estimator, spec.clock_hz, spec.slots) == (number, estimator, axes.CLOCK_HZ, slots)
    assert spec.sample_hz == spec.actuation_hz
    # No rate between this one and the limit is a whole number of hertz.
    faster = [clocks for clocks in range(spec.slots, spec.clocks_per_sample) if axes.CLOCK_HZ % clocks == 0]
    assert faster == []


def test_a_row_is_what_the_placer_reports(calls):
    row = axes.cost("fdm", 2, True, (5, 9, 6))
    assert (row["seeds"], row["fmax_mhz_seeds"], row["fmax_mhz"]) == ([5, 9, 6], [50.0, 90.0, 60.0], 60.0)
    assert (row["interval_clocks"], row["max_sample_hz"]) == (4, round(60e6 / 4))
    assert (row["lut4"], row["dsp"], row["bram"], row["ff"]) == (0, 1, 2, 3)
    assert row["available"] == {"lut4": 100, "dsp": 101, "bram": 102}
    assert row["latency_clocks"] == SupervisedAxes(axes.fastest("fdm", 2)).latency
    assert axes.cost("fdm", 2, False, (5,))["latency_clocks"] == axes.fastest("fdm", 2).latency < row["latency_clocks"]
    check("axes", axes.AxesCosts([row]).report())
    assert calls.read_text().split() == ["0", "5", "9", "6", "0", "5"]
    assert axes.cost("fdm", 2, True, (5, 9, 6)) == row
    assert len(calls.read_text().split()) == 6, "what was placed is not placed again"


def test_a_table_for_every_kind_with_the_range_of_the_seeds():
    supervised, bare, other = axes.AxesCosts(results.axes_costs().rows).tables()
    assert [next(iter(table.columns)) for table in (supervised, bare, other)] == [
        "levant, supervised", "levant, bare", "fdm, supervised"
    ]  # fmt: skip
    assert supervised.rows[1] == ["8", "8760", "2000", "5", "0", "116.0 (112.0 to 118.0)", "14", "8.29", "66.3"]
    (note,) = results.axes_costs().notes()
    assert note == "ecp5-25k has 24288 LUT4, 28 DSP and 56 EBR; a clock of 96 MHz was asked for"


def test_the_picture_has_the_lines_of_the_limit():
    made = results.axes_costs()
    logic, rate = picture.draw(made).axes
    (part,) = [line for line in logic.lines if line.get_label() not in made.kinds()]
    assert set(part.get_ydata()) == {24288}
    *_, limit = rate.lines
    fastest = max(row["fmax_mhz"] for row in made.rows)
    assert limit.get_xydata().tolist() == [[number, fastest / number] for number in (1, 8, 32)]
    assert [line.get_ydata()[0] * 1e6 for line in rate.lines[:3]] == pytest.approx(
        [own[0]["max_sample_hz"] for own in made.kinds().values()]
    )
