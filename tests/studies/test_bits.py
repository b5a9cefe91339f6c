"""What a bit buys: the first row is the derived width, every row is a bit narrower, and the last has none to drop."""

import pytest

from hardwall.sim.estimates.accuracy import axis_spec, measure
from hardwall.sim.estimates.signals import paper
from hardwall.sim.studies import bits
from hardwall.sim.walls.methods import Curve

CELLS = {"lut4": 500, "ff": 300, "dsp": 4, "bram": 0}
RATE = 10_000


@pytest.fixture
def synthesised(monkeypatch) -> list[int]:
    """Count cells without a synthesis; return the widths of the velocities whose estimators were asked for."""
    widths = []

    def cells(spec, device):
        assert device == "ecp5-25k"
        widths.append(spec.design.estimator.velocity.width)
        return CELLS

    monkeypatch.setattr(bits, "estimator_cells", cells)
    return widths


def test_every_estimator_is_measured_from_its_derived_width_on():
    jobs = bits.jobs([Curve("levant u", "levant", "u"), Curve("fdm u", "fdm", "u")], RATE)
    assert [(job["estimator"], job["bits_dropped"]) for job in jobs] == [
        (name, dropped) for name in ("levant", "fdm") for dropped in range(13)
    ]
    assert {(job["output"], job["sample_hz"]) for job in jobs} == {("u", RATE)}


def test_the_width_falls_by_one_and_the_first_row_is_the_derived_one(synthesised):
    rows = [bits.bit("levant", "u", RATE, dropped) for dropped in (0, 1, 6)]
    bound = paper().acceleration_max_m_per_s2
    derived = axis_spec("levant", RATE, bound).design.estimator.velocity.width
    assert [row["velocity_bits"] for row in rows] == [derived, derived - 1, derived - 6] == synthesised
    whole = measure("levant", "u", "paper", RATE, "fixed")
    assert rows[0] == {
        "estimator": "levant",
        "output": "u",
        "sample_hz": RATE,
        "bits_dropped": 0,
        "velocity_bits": derived,
        "rms_mm_s": whole["rms_mm_s"],
        **CELLS,
    }


def test_words_with_too_few_bits_to_drop_are_none(synthesised):
    assert bits.bit("fdm", "u", RATE, 60) is None
    assert synthesised == []


def test_a_table_has_a_line_a_row():
    row = {"estimator": "levant", "output": "u1", "sample_hz": RATE, "bits_dropped": 2, "velocity_bits": 18}
    result = bits.Bits([row | {"rms_mm_s": 0.25} | CELLS])
    assert result.report() == {"rows": [row | {"rms_mm_s": 0.25} | CELLS]}
    (table,) = result.tables()
    assert table.rows == [["levant u1", "2", "18", "0.25", "500", "300", "4"]]
    assert list(table.columns) == ["estimator", "bits dropped", "velocity bits", "RMS (mm/s)", "LUT4", "FF", "DSP"]
