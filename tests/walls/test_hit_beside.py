"""Two hits side by side: each is the hit of its scene alone."""

from dataclasses import replace

from hardwall.sim.scene.load import load
from hardwall.sim.walls import hit, hit_beside
from stimuli import results
from stimuli.scenes import ONE_SECOND

SCENES = load("seed-2011", ONE_SECOND), load("seed-2011", ONE_SECOND | {"wall.stiffness_n_per_m": 20e3})


def kept(report: dict) -> dict:
    """Return what a hit found, without how long it took."""
    return {key: value for key, value in report.items() if key not in ("seconds", "samples_per_s")}


def test_each_hit_is_that_of_its_scene_alone_and_progress_is_of_both():
    seen: list[int] = []
    result = hit_beside.run(SCENES, "fixed", traces=True, progress=seen.append)
    rows = result.report()["rows"]
    assert [kept(row) for row in rows] == [kept(hit.run(scene, "fixed", traces=True).report()) for scene in SCENES]
    assert rows[0]["force_sha256"] != rows[1]["force_sha256"]
    assert all(each.overview is not None for each in result.hits)
    assert seen == sorted(seen)
    assert seen[-1] == sum(scene.samples for scene in SCENES)


def test_the_table_has_a_row_for_each_scene_and_flags_are_said_of_theirs():
    result = results.hit_beside()
    (table,) = result.tables()
    assert [row[0] for row in table.rows] == ["seed-2011, levant", "mhz, levant"]
    first, second = result.hits
    flagged = replace(result, hits=(first, replace(second, flags=["output_limited"])))
    assert flagged.notes()[-1] == "flags of mhz: output_limited"
