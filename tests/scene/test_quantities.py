"""Scenes at the ends of their ranges: refused in a line, or run to finite numbers on both models."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hardwall.sim.scene.errors import SceneError
from hardwall.sim.scene.load import load
from hardwall.sim.scene.presliding_section import OF_LUGRE
from hardwall.sim.scene.schema import Scene
from hardwall.sim.scene.sentences import sections_of
from hardwall.sim.walls import hit
from stimuli.bristles import LUGRE_KEYS
from stimuli.lengths import LONG

# Thirty samples beside the wall, so that the stiffest devices do not take long either.
BRIEF = {
    "protocol.start_m": -2e-6,
    "protocol.settle_s": 2e-3,
    "protocol.mean_s": 1e-3,
    "protocol.measure_s": 1e-3,
    "protocol.longest_s": 3e-3,
}
# With 0 a part is left out, and the loop is compiled without it.
LEFT_OUT = {("handle.coulomb_n", 0.0), ("amplifier.delay_s", 0.0)}
BASES = {"seed-2011": ("seed-2011", {}), "drive-2011": ("drive-2011", {}), "bristles": ("seed-2011", LUGRE_KEYS)}
"""Scenes by name, with what is changed first."""
BACKENDS = dict.fromkeys(BASES if LONG else ["seed-2011"], ("float", "fixed"))
"""The scenes that run on both models. The device is in float64 on both; each has its own loop to compile."""
HELD = {"handle.coulomb_n", "presliding.static_n", "protocol.push_n"}
"""Keys of the handle's friction, and of what overcomes it."""


LUGRES = [f"presliding.{key}" for key in OF_LUGRE]


def ends_of(base: str) -> list[tuple[str, float]]:
    """Return every number of the sections of one of `BASES` with the least and the largest value that it accepts."""
    scene, found = load(*BASES[base]), []
    for name, section in sections_of(Scene).items():
        if getattr(scene, name) is None:
            continue
        for key, schema in section.model_json_schema()["properties"].items():
            for part in [schema, *schema.get("anyOf", [])]:
                if part.get("type") in ("number", "integer"):
                    number = int if part["type"] == "integer" else float
                    found += [(f"{name}.{key}", number(part[end])) for end in ("minimum", "maximum")]
    return [end for end in dict.fromkeys(found) if end not in LEFT_OUT]


def run(base: str, changes: dict[str, float]) -> list[hit.Hit]:
    """Return the hits of one of `BASES` with changes on both models; none if the scene or the run is refused."""
    name, first = BASES[base]
    try:
        scene = load(name, BRIEF | first | changes)
        found = [hit.run(scene, backend) for backend in BACKENDS.get(base, ("fixed",))]
    except (SceneError, RuntimeError) as refusal:
        told, found = str(refusal), []
    if not found:
        assert "\n" not in told
        assert len(told) < 400
        assert told.startswith((f"{name}: ", "the handle passed more than"))
    for result in found:
        assert all(map(math.isfinite, (result.mean_m, result.rms_m, result.max_force_n)))
        assert scene.samples <= result.samples <= scene.most_samples
        assert (result.samples - scene.settled) % scene.measured == 0, "a run ends with a window"
        assert 0 <= result.max_force_n <= scene.spec.force_max_n * (1 + 1e-9)
    return found


@pytest.mark.parametrize("base", BASES)
@settings(derandomize=True, deadline=None, max_examples=60 if LONG else 20)
@given(data=st.data())
def test_the_ends_of_all_ranges_are_refused_or_give_finite_numbers(base, data):
    ends = st.sampled_from(ends_of(base))
    changes = dict(data.draw(st.lists(ends, min_size=1, max_size=3, unique_by=lambda end: end[0])))
    found = run(base, changes)
    if found and base == "seed-2011" and not HELD & changes.keys():
        start_m = changes.get("protocol.start_m", BRIEF["protocol.start_m"])
        assert all(result.mean_m != start_m for result in found), "the handle never moved"


@pytest.mark.parametrize("end", [end for end in ends_of("bristles") if end[0].startswith("presliding")])
def test_bristles_run_at_both_ends_of_every_key(end):
    """LuGre's model with one key at an end, the static level with Coulomb's beside it; Dahl's with its one key."""
    key, value = end
    beside = {"handle.coulomb_n": max(value / 1.5, 1e-12)} if key == "presliding.static_n" else {}
    found = run("bristles", dict([end]) | beside)
    if key == "presliding.stiffness_n_per_m":
        found += run("bristles", dict([end]) | {"presliding.model": "dahl"} | dict.fromkeys(LUGRES))
    if end == ("presliding.stribeck_m_per_s", 1e5):
        assert not found, "the level falls too slowly for bristles so stiff"
        found = run("bristles", dict([end]) | {"presliding.stiffness_n_per_m": 1e-2})
    assert found


@pytest.mark.parametrize("mass_kg", [1e-6, 1e3])
def test_the_lightest_and_the_heaviest_handle_fall_as_they_should(mass_kg):
    """Under 0.2572 N, what friction leaves of the push, on the way to a far wall."""
    changes = {"handle.mass_kg": mass_kg, "handle.viscous_n_s_per_m": 0.0, "encoder.count_m": 1e-4}
    protocol = {"protocol.start_m": -0.14, "protocol.settle_s": 1e-3, "protocol.mean_s": 1e-4}
    protocol["protocol.verdict"] = "literal"
    result = hit.run(load("seed-2011", BRIEF | changes | protocol), "fixed")
    # The mean is that of the last sample before the end of settling; the first one was taken at rest.
    assert result.mean_m + 0.14 == pytest.approx(0.2572 / mass_kg * 0.9e-3**2 / 2, rel=1e-3 if mass_kg > 1 else 1e-9)


@pytest.mark.parametrize("mass_kg", [0.0, 1e-320, 9.99e-7, 1001.0, math.inf, math.nan, 10**400])
def test_a_number_outside_its_range_is_refused_with_the_range(mass_kg):
    with pytest.raises(SceneError, match=r"^seed-2011: handle\.mass_kg must be a number of 1e-06 to 1000, not "):
        load("seed-2011", {"handle.mass_kg": mass_kg})
