"""Hits of several axes: each is the hit of that axis alone, on every backend, and knows nothing of its neighbours."""

import json
from dataclasses import replace
from functools import cached_property

import numpy as np
import pytest

from hardwall.model.axis.design import Timing, overlap_of
from hardwall.sim.scene.load import load
from hardwall.sim.scene.schema import Scene
from hardwall.sim.scene.several import AxesScene
from hardwall.sim.scene.tables import load_any, parse_axes, read
from hardwall.sim.walls import hit, hit_axes
from stimuli.lengths import LONG, some_of
from stimuli.scenes import AMPLIFIER, CABLE, HAND, SHORT_OF_AXES

FDM = {"controller.estimator": "fdm", "controller.output": None, "controller.gains": None}
EIGHT = read("eight-axes")


class InTurn(Scene):
    """A scene of one axis that samples in the turn of one among several."""

    turn: Timing

    @cached_property
    def timing(self) -> Timing:
        return self.turn


def single(axis) -> InTurn:
    """Return the scene of one axis with the keys and the timing of one of several."""
    kept = {name: getattr(axis, name) for name in Scene.model_fields}
    return InTurn(**kept, turn=axis.timing)


def kept(result: hit.Hit) -> dict:
    """Return what a hit found, without how long it took."""
    return {key: value for key, value in result.report().items() if key not in ("seconds", "samples_per_s")}


@pytest.mark.parametrize("backend", some_of(["fixed", "float"], 0))
def test_an_axis_is_a_single_one_that_samples_in_its_turn(backend):
    """The loop of one axis and the axis of `AxisSpec` give all its force words; but for gains of its own, of which the
    formats of a single axis follow."""
    scene = load_any("eight-axes", SHORT_OF_AXES)
    found = hit_axes.run(scene, backend).hits
    compared = 0
    for axis in scene.axes:
        if axis.gains == axis.base.gains:
            assert kept(found[axis.axis]) == kept(hit.run(single(axis), backend))
            assert found[axis.axis].max_force_n > 0.5
            compared += 1
    assert compared == 7
    assert len({each.rms_m for each in found.values()}) == 8


def test_an_axis_knows_nothing_of_its_neighbours():
    """An axis alone, and one among others in other worlds, take the same way."""
    scene = load_any("eight-axes", SHORT_OF_AXES)
    among = hit_axes.run(scene, "fixed").hits
    first, *tables = EIGHT.split("[[axis]]")
    for number in (0, 4, 7):
        alone = parse_axes("eight-axes", f"{first}[[axis]]{tables[number]}", SHORT_OF_AXES)
        assert len(alone.axes) == 1
        ((name, result),) = hit_axes.run(alone, "fixed").hits.items()
        assert kept(result) == kept(among[name])
    others = {f"axis.{name}.wall.stiffness_n_per_m": 7e3 for name in list(among)[1:]}
    others |= {f"axis.{name}.protocol.push_n": 5.0 for name in list(among)[1:]}
    changed = hit_axes.run(load_any("eight-axes", SHORT_OF_AXES | others), "fixed").hits
    assert kept(changed["base"]) == kept(among["base"])
    assert all(kept(changed[name]) != kept(among[name]) for name in list(among)[1:])


PACES = [(4, 3), (6, 2), (8, 1), (12, 1), (13, 0), (24, 0)]
"""Clocks a sample, and by how many samples the drive is behind: each number of them has its own loop to compile."""


@pytest.mark.parametrize(("clocks", "overlap"), PACES if LONG else [PACES[0], PACES[-1]])
def test_a_handle_takes_its_way_however_many_samples_overlap(clocks, overlap):
    """The positions of the samples are those of the undisturbed handle: they are kept when the drive changes, which may
    be several samples later. The samples before then are taken at the start."""
    # The plain difference takes the fewest clocks; the last pace is for an estimator whose loop others compile, too.
    simple = FDM if LONG or clocks < PACES[-1][0] else {}
    changes = SHORT_OF_AXES | simple | {"controller.clock_hz": clocks * 1_000_000}
    changes |= {"controller.sample_hz": 1_000_000, "controller.actuation_hz": 1_000_000}
    changes |= {"controller.speed_max_m_per_s": 0.2, "protocol.start_m": -0.001}
    scene = parse_axes("eight-axes", "[[axis]]".join(EIGHT.split("[[axis]]")[:5]), changes)
    assert overlap_of(scene.axes[0].timing) == overlap
    for name, result in hit_axes.run(scene, "fixed", traces=True).hits.items():
        axis = result.scene
        t = np.maximum(result.overview.time_s - overlap / axis.spec.sample_hz, 0)[:1000]
        m, b, n = axis.handle.mass_kg, axis.handle.viscous_n_s_per_m, axis.protocol.push_n - axis.handle.coulomb_n
        exact = axis.protocol.start_m + n / b * (t + m / b * np.expm1(-b * t / m))
        assert np.abs(result.overview.position_m[:1000] - exact).max() < 1e-12, name


FAST = {
    "controller.sample_hz": 1_000_000, "controller.speed_max_m_per_s": 0.2, "protocol.settle_s": 4e-3,
    "protocol.mean_s": 1e-3, "protocol.measure_s": 2e-3, "protocol.start_m": -1e-5, "protocol.push_n": 10.0,
    "controller.glitch_clocks": 0,
}  # fmt: skip
"""A hard hit near the start of every axis."""
DEVICE = AMPLIFIER | CABLE | HAND if LONG else {}
"""Parts of one axis; a device of several is another loop to compile."""
PARTS = {f"axis.shoulder.{key}": value for key, value in (DEVICE | {"amplifier.delay_s": 4e-6}).items()}
ON_RTL = {
    "one sample overlaps": {"controller.clock_hz": 16_000_000, "controller.actuation_hz": 500_000},
}
IN_LONG = {
    "three samples overlap": FDM | {"controller.clock_hz": 4_000_000},
    "no overlap": {"controller.clock_hz": 40_000_000},
    "a window": FDM | {"controller.estimator": "window", "controller.clock_hz": 9_000_000},
}


def three(changes: dict) -> AxesScene:
    """Return the first three axes of the scene: one of them with cable, hand and late amplifier, one with gains of its
    own and an encoder out of phase."""
    own = {"axis.elbow.controller.gains.levant.lambda_sqrt_m_per_s": 25.0, "axis.elbow.encoder.phase_error_counts": 0.2}
    own |= {"axis.elbow.controller.gains.levant.alpha_m_per_s2": 90.0}
    text = "[[axis]]".join(EIGHT.split("[[axis]]")[:4])
    return parse_axes("eight-axes", text, FAST | {"controller.actuation_hz": 1_000_000} | PARTS | own | changes)


@pytest.mark.parametrize("case", [*ON_RTL, *(IN_LONG if LONG else ())])
def test_rtl_gives_the_models_force_words_in_every_axis(case):
    scene = three((ON_RTL | IN_LONG)[case])
    overlaps = {"no overlap": 0, "one sample overlaps": 1, "three samples overlap": 3}
    assert overlap_of(scene.axes[0].timing) == overlaps.get(case, overlap_of(scene.axes[0].timing))
    fixed, rtl = (hit_axes.run(scene, backend, traces=LONG).hits for backend in ("fixed", "rtl"))
    for name, result in rtl.items():
        assert kept(result) | {"backend": "fixed"} == kept(fixed[name])
        assert result.max_force_n > 1
        # Traces are a loop of their own to compile.
        for trace in ("overview", "detail") if LONG else ():
            for key, values in vars(getattr(result, trace)).items():
                assert (values == getattr(getattr(fixed[name], trace), key)).all(), f"{trace} {key} of {name}"
            assert len(result.detail.time_s) > 1000
    assert len({result.force_sha256 for result in rtl.values()}) == 3


def test_rtl_of_an_axis_that_is_too_fast_has_its_neighbours_as_they_were():
    """The motor of one axis turns its encoder faster than its filter follows: a flag rises, and the drive is zero."""
    changes = ON_RTL["one sample overlaps"]
    own = {"protocol.push_n": 39.0, "protocol.start_m": -0.1, "handle.mass_kg": 0.02, "controller.glitch_clocks": 15}
    too_fast = changes | {f"axis.elbow.{key}": value for key, value in own.items()}
    calm, wild = (hit_axes.run(three(given), "rtl").hits for given in (changes, too_fast))
    fixed = hit_axes.run(three(too_fast), "fixed").hits
    assert kept(wild["elbow"]) | {"backend": "fixed"} == kept(fixed["elbow"])
    assert "encoder_overspeed" in wild["elbow"].flags
    assert wild["elbow"].max_force_n == 0
    assert [kept(wild[name]) for name in ("base", "shoulder")] == [kept(calm[name]) for name in ("base", "shoulder")]
    assert not calm["elbow"].flags


@pytest.mark.parametrize("backend", ["fixed", "rtl"] if LONG else ["fixed"])
def test_a_handle_that_outruns_every_decoder_ends_the_run(backend):
    hz = 100 if LONG else 10_000
    changes = (FDM if LONG else {}) | {"controller.sample_hz": hz, "controller.actuation_hz": hz}
    changes |= {"controller.clock_hz": 1_000 * hz, "controller.speed_max_m_per_s": 0.001, "protocol.start_m": -0.15}
    changes |= {"protocol.settle_s": 1.0, "axis.elbow.protocol.push_n": 1e4, "axis.elbow.handle.mass_kg": 0.001}
    changes |= {f"protocol.{key}": 1.0 for key in ("mean_s", "measure_s")}
    changes |= {f"axis.shoulder.{key}": None for key in ("amplifier", "transmission", "hand")}
    changes |= {"axis.elbow.controller.gains.levant.lambda_sqrt_m_per_s": 15.0}
    with pytest.raises(RuntimeError, match=r"passed more than 16384 edges in a sample, at .* s$"):
        hit_axes.run(three(changes), backend)


def test_the_report_has_a_row_for_each_axis_and_the_traces_too(tmp_path):
    result = hit_axes.run(load_any("eight-axes", SHORT_OF_AXES), "fixed", traces=True)
    report = result.report()
    names = [row["axis"] for row in report["rows"]]
    assert names == [axis.axis for axis in result.scene.axes]
    assert report["samples"] == 8 * result.scene.samples
    (table,) = result.tables()
    assert [row[0] for row in table.rows] == names
    result.save(tmp_path / "hit.npz")
    with np.load(tmp_path / "hit.npz") as arrays:
        assert json.loads(str(arrays["report"])) == report
        for name, each in result.hits.items():
            assert (arrays[f"{name}_detail_force_n"] == each.detail.force_n).all()
            assert len(arrays[f"{name}_overview_time_s"]) > 100


def test_flags_are_said_of_the_axis_that_raised_them():
    result = hit_axes.run(load_any("eight-axes", SHORT_OF_AXES), "fixed")
    flagged = replace(result, hits=result.hits | {"grip": replace(result.hits["grip"], flags=["output_limited"])})
    assert flagged.notes()[-1] == "flags of grip: output_limited"
    assert not [note for note in result.notes() if note.startswith("flags")]


def test_progress_is_of_all_axes():
    seen: list[int] = []
    scene = load_any("eight-axes", SHORT_OF_AXES)
    hit_axes.run(scene, "fixed", progress=seen.append)
    assert seen == sorted(seen)
    assert seen[-1] == 8 * scene.samples


def test_a_scene_of_one_axis_is_not_in_turn():
    assert single(load_any("eight-axes").axes[0]).timing != load("mhz").timing
