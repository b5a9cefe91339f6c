"""The table to choose by, and the picture of what a bit buys, from made-up results."""

from hardwall.sim.pictures import bits
from hardwall.sim.pictures import style as pictures
from hardwall.sim.studies import choose
from hardwall.sim.studies.bits import Bits

COST = {"device": "some", "lut4": 10, "ff": 20, "dsp": 1, "bram": 0, "latency_clocks": 7, "board": {"max_sample_hz": 5}}


def test_every_error_is_in_its_own_place():
    pairs = [("fdm", "u"), ("levant", "u"), ("levant", "u1")]
    jobs = choose.jobs(pairs, 1000, "fixed")
    assert len(jobs) == len(pairs) * len(choose.SITUATIONS)
    assert len({job["acceleration_max_m_per_s2"] for job in jobs}) == 1
    measured = [{"rms_mm_s": number, "delay_s": -number} for number, _ in enumerate(jobs)]
    rows = choose.table(pairs, measured, [COST | {"estimator": name} for name in ("fdm", "levant")])
    for row, (estimator, output) in zip(rows, pairs, strict=True):
        assert (row["estimator"], row["output"]) == (estimator, output if estimator == "levant" else "")
        assert (row["lut4"], row["max_sample_hz"]) == (10, 5)
        for name, number in row["rms_mm_s"].items():
            job = jobs[number]
            assert (job["estimator"], job["output"]) == (estimator, output)
            assert choose.SITUATIONS[name].items() <= job.items()
        assert row["impact_delay_s"] == -row["rms_mm_s"]["impact"]


def test_a_curve_a_output_and_a_circle_at_the_derived_width(tmp_path):
    rows = [
        {"estimator": "levant", "output": output, "sample_hz": 1_000_000, "velocity_bits": 20 - dropped}
        | {"rms_mm_s": 0.1 + dropped, "lut4": 500 - dropped}
        for output in ("u", "u1")
        for dropped in range(3)
    ]
    picture = bits.draw(Bits(rows))
    by_width, by_logic = picture.axes
    assert [line.get_label() for line in by_width.lines if not line.get_label().startswith("_")] == [
        "levant u",
        "levant u1",
    ]
    assert by_width.lines[0].get_xdata().tolist() == [20, 19, 18]
    assert by_logic.lines[1].get_xdata() == [500]
    pictures.save(picture, tmp_path / "bits.svg")
    assert "bits of the velocity" in (tmp_path / "bits.svg").read_text()
