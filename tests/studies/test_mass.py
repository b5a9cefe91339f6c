"""Stable virtual masses: what a mass does to the motion, the ranges of a row, and the command."""

import json
import math

import numpy as np
import pytest

from hardwall.sim.loop.backends import BACKENDS
from hardwall.sim.scene.case import Case
from hardwall.sim.scene.load import load
from hardwall.sim.studies import mass
from hardwall.sim.walls import hit
from hardwall.sim.walls.methods import Curve
from stimuli import results
from stimuli.hit_paths import path_of
from stimuli.lengths import LONG, some_of
from support.command_line import call
from support.reports import check

KALMAN = Curve("kalman", "kalman", "u")
FREE = {"handle.coulomb_n": 0.0 if LONG else 1e-9, "handle.viscous_n_s_per_m": 0.0, "protocol.settle_s": 2.0}


def speed_at_the_wall(share: float, estimator: str, backend: str = "fixed") -> float:
    """Return the speed of a handle after its way through free space, with a virtual mass there, m/s."""
    scene = load("seed-2011", FREE | {"controller.estimator": estimator})
    mass_kg = scene.handle.mass_kg
    virtual = {"virtual_mass.most_kg": 0.99 * mass_kg, "virtual_mass.in_free_space_kg": share * mass_kg}
    position_m, _ = path_of(load("seed-2011", FREE | {"controller.estimator": estimator} | virtual), backend)
    entered = int(np.argmax(position_m > 0))
    return float(np.diff(position_m[: entered + 1]).max() * scene.spec.sample_hz)


@pytest.mark.parametrize(
    ("share", "estimator"),
    [(share, each) for each in ("levant-2", "edge-kalman") for share in (-0.5, -0.2, 0.0, 0.4)]
    if LONG
    else [(share, "kalman") for share in (-0.5, 0.1)],
)
def test_a_mass_in_free_space_is_felt_as_one(share, estimator):
    """Without friction, a constant push over a way gives the energy of a handle that has both masses."""
    scene = load("seed-2011", FREE)
    work_j = scene.protocol.push_n * -scene.protocol.start_m
    expected = math.sqrt(2 * work_j / (scene.handle.mass_kg * (1 + share)))
    assert speed_at_the_wall(share, estimator) == pytest.approx(expected, rel=0.02)


def test_the_backends_hit_alike():
    made = {
        backend: hit.run(
            load(
                "seed-2011",
                {"controller.estimator": "kalman", "protocol.settle_s": 0.6, "protocol.measure_s": 0.2}
                | {"virtual_mass.most_kg": 0.2, "virtual_mass.in_wall_kg": 0.1, "virtual_mass.in_free_space_kg": -0.1},
            ),
            backend,
        )
        for backend in some_of(BACKENDS, *map(BACKENDS.index, ("fixed", "rtl")))
    }
    assert made["rtl"].force_sha256 == made["fixed"].force_sha256 is not None
    if "float" in made:
        assert made["float"].max_force_n == pytest.approx(made["fixed"].max_force_n, rel=0.05)


def test_a_range_is_the_longest_of_what_all_starts_say():
    found = results.masses()
    assert [found.range_of(row) for row in range(3)] == [(0.5, 0.5), None, (0.0, 0.5)]
    table = found.tables()[0]
    assert table.rows[0][0] == "theory, exact"
    assert "none" in table.rows[0]


def test_what_is_hit_is_the_wall_with_the_mass():
    case = Case.of("seed-2011")
    settings = mass.settings_of([KALMAN], [100_000])
    assert [(setting.rate_hz, setting.wall) for setting in settings] == [
        (rate_hz, wall) for wall in mass.WALLS for rate_hz in (None, 100_000)
    ]
    made = mass.jobs(case, settings, [-0.5, 0.9], 3, "fixed")
    assert len(made) == len(settings) * 2 * 3
    last = Case("", made[-1]["scene"], made[-1]["text"], made[-1]["changes"]).scene
    assert last.controller.sample_hz == last.controller.actuation_hz == 100_000
    assert last.parameters["wall_mass"] == pytest.approx(0.9 * last.handle.mass_kg)
    assert (made[-1]["wall"], made[-1]["start"]) == (tuple(mass.WALLS[-1]), 2)


def test_report_table_and_picture(monkeypatch, capsys, tmp_path):
    picture = tmp_path / "mass.png"
    words = [
        "mass",
        "--estimators",
        "kalman",
        "--rates",
        "none",
        "--masses",
        "-0.9,0.1",
        "--walls",
        "1e3:9,40e3:60",
        "--starts",
        2,
        "--workers",
        1,
    ]
    code, out, _ = call(monkeypatch, capsys, *words, "--json", "--plot", picture)
    assert code == 0
    report = json.loads(out)
    check("mass", report)
    assert report["shares"] == [-0.9, 0.1]
    assert [row["stable_starts"][1] for row in report["rows"]] == [2, 2]
    assert report["rows"][-1]["stable_starts"][0] == 0
    assert picture.stat().st_size > 0


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--masses", "1"], "--masses must be numbers of -0.99 to 0.99 of the handle's mass, not '1'"),
        (["--masses=-1e-9"], "--masses must be 0, or 3.1e-05 to 0.99 of the handle's mass, of either sign, not -1e-09"),
        (["--masses", ""], "--masses must be numbers of -0.99 to 0.99 of the handle's mass, not ''"),
        (["--rates", "10"], "--rates must be whole numbers of 1000 to 1e+07 Hz, not '10'"),
        (["--estimators", "fdm"], "virtual_mass.most_kg needs an estimator with an acceleration (kalman, "),
        (
            ["--set", "virtual_mass.most_kg=0.1"],
            "'virtual_mass.most_kg' must be absent (this command sets it): see --m",
        ),
        (
            ["--set", "wall.damping_n_s_per_m=1"],
            "must be absent (this command sets it): see the scene's section zwidth",
        ),
        (["--walls", "1e3"], "--walls must be pairs K:B of N/m and N s/m, not '1e3'"),
        (["--walls", "1e3:x"], "--walls must be numbers of 0 to 1e+09 N/m and N s/m, not 'x'"),
        (["--walls", "9e5:1"], "wall.stiffness_n_per_m must be 0, or "),
        (["drive-2011"], "drive-2011: motor must be absent: the theory beside the hits is of a rigid handle"),
        (["--set", "passivity.damping_n_s_per_m=1"], "passivity must be absent: the theory"),
        (["--set", "amplifier.bandwidth_hz=500"], "amplifier.bandwidth_hz must be absent: the theory"),
        (["eight-axes"], "eight-axes: has several axes"),
    ],
)
def test_what_cannot_be_is_refused_in_a_line(monkeypatch, capsys, arguments, message):
    code, out, err = call(monkeypatch, capsys, "mass", *arguments)
    assert (code, out) == (2, "")
    assert message in err
