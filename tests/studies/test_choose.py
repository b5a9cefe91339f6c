"""The table for the choice of an estimator, from made-up results."""

from hardwall.sim.studies import choose
from support.reports import check

COST = {"device": "some", "lut4": 10, "ff": 20, "dsp": 1, "bram": 0, "latency_clocks": 7, "board": {"max_sample_hz": 5}}


def test_every_error_is_in_its_own_place():
    pairs = [("fdm", "u"), ("levant", "u"), ("levant", "u1")]
    jobs = choose.jobs(pairs, 1000, "fixed")
    assert len(jobs) == len(pairs) * len(choose.SITUATIONS)
    assert len({job["bounds"]["acceleration_max_m_per_s2"] for job in jobs}) == 1
    measured = [{"rms_mm_s": number, "delay_s": -number} for number, _ in enumerate(jobs)]
    rows = choose.table(pairs, measured, [COST | {"estimator": name} for name in ("fdm", "levant")])
    check("choose", choose.Choice(rows).report())
    for row, (estimator, output) in zip(rows, pairs, strict=True):
        assert (row["estimator"], row["output"]) == (estimator, output if estimator == "levant" else "")
        assert (row["lut4"], row["max_sample_hz"]) == (10, 5)
        for name, number in row["rms_mm_s"].items():
            job = jobs[number]
            assert (job["estimator"], job["output"]) == (estimator, output)
            assert choose.SITUATIONS[name].items() <= job.items()
        assert row["impact_delay_s"] == -row["rms_mm_s"]["impact"]


def test_an_encoder_of_ones_own_is_another_situation():
    encoder = {"encoder.edge_error_counts": 0.02, "encoder.seed": 3}
    situations = choose.situations_with(encoder)
    assert situations.keys() - choose.SITUATIONS.keys() == {choose.OWN}
    jobs = choose.jobs([("fdm", "u")], 1000, "fixed", situations)
    assert jobs[-1]["encoder"] == encoder
    measured = [{"rms_mm_s": float(number), "delay_s": None} for number, _ in enumerate(jobs)]
    rows = choose.table([("fdm", "u")], measured, [COST | {"estimator": "fdm"}], situations)
    chosen = choose.Choice(rows, situations)
    check("choose", chosen.report())
    assert rows[0]["rms_mm_s"][choose.OWN] == len(jobs) - 1
    assert "own encoder: edge_error_counts 0.02, seed 3" in chosen.notes()
    assert "single edges: edge_error_counts 0.05" in chosen.notes()


def test_a_board_that_does_not_fit_has_no_rate():
    measured = [{"rms_mm_s": 1.0, "delay_s": None}] * len(choose.SITUATIONS)
    rows = choose.table([("fdm", "u")], measured, [COST | {"estimator": "fdm", "board": None}])
    chosen = choose.Choice(rows)
    check("choose", chosen.report())
    assert chosen.tables()[1].rows == [["fdm", "10", "20", "1", "0", "7", "does not fit"]]
