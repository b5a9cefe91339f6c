"""Tables of maps of stable walls: `hardwall zwidth`, `cutoff`, `gains`, `drop` and `rates`."""

from collections.abc import Callable, Iterable
from itertools import pairwise
from typing import Any

from hardwall.sim.scene.load import load
from hardwall.sim.studies.rendered_setting import rate_text

from .tables import Report, number, of_draws, table

Map = dict[str, Any]
AREA = "area (kN/m N s/m)"
"""What a table calls the area under an edge."""
K = 1e3
"""A kN/m in N/m, and an area's unit in that of a report."""


def _area(of: Map) -> str:
    """Return the area under an edge with the interval of the starts; `+` if the region goes on beyond the map."""
    text = of_draws(of["area_n2_s_per_m2"], of["area_low_n2_s_per_m2"], of["area_high_n2_s_per_m2"], K)
    return f"{text}+" if of["leaves_the_map_at"] else text


def _end(of: Map) -> str:
    """Return the last damping at which half of the hits of some wall are stable; `+` at the end of the map."""
    boundary = of["boundary"]
    stable = [damping for damping, stiffness, *_ in boundary if stiffness]
    if not stable:
        return "none"
    return f"{number(stable[-1])}{'+' * (stable[-1] == boundary[-1][0])}"


def _largest(of: Map) -> str:
    """Return the largest stable stiffness in kN/m; `+` if the region goes on beyond the map."""
    return f"{number(of['largest_stiffness_n_per_m'] / K)}{'+' * bool(of['leaves_the_map_at'])}"


def _held(of: Map) -> str:
    """Return the part of the area, as far as it was hit, that is stable."""
    return f"{number(100 * of['area_held_n2_s_per_m2'] / of['area_n2_s_per_m2'], 2)} %"


def _by_area(maps: Iterable[Map]) -> list[Map]:
    return sorted(maps, key=lambda each: -each["area_n2_s_per_m2"])


def maps(report: Report) -> list[str]:
    """Return the region of every method, the largest first."""
    heads = ["method", AREA, "stable part of it", "largest K (kN/m)", "to B (N s/m)"]
    rows = ([each["label"], _area(each), _held(each), _largest(each), _end(each)] for each in _by_area(report["maps"]))
    return table(heads, rows)


def facts(*reports: Report) -> list[str]:
    """Return the facts of the founding paper's Figure 5, and in how many draws each holds, a column a device."""
    heads = ["fact of the paper, and share of draws with it", *(f"`{report['scene']}`" for report in reports)]
    same = enumerate(zip(*(report["facts"] for report in reports), strict=True), 1)
    return table(
        heads, ([f"{n}. {each[0]['text']}", *(f"{100 * one['share']:.0f} %" for one in each)] for n, each in same)
    )


NAMES = {
    "handle.mass_kg": ("mass (g)", 1e-3),
    "handle.viscous_n_s_per_m": ("viscous friction (N s/m)", 1.0),
    "handle.coulomb_n": ("Coulomb friction (mN)", 1e-3),
    "amplifier.delay_s": ("delay of the force (ms)", 1e-3),
    "protocol.threshold_mm": ("threshold of the RMS (µm)", 1e-3),
    "protocol.mean_s": ("time of the mean (s)", 1.0),
    "controller.gains.levant.alpha_m_per_s2": ("adjusted alpha (m/s²)", 1.0),
}
"""What a table calls an assumed value, and its unit there."""
GRID = {"zwidth.stiffness_step_n_per_m": "steps of K", "zwidth.damping_step_n_s_per_m": "steps of B"}
VERDICTS = {"literal": "the paper's own", "detrended": "by the window's line"}


def assumptions(report: Report) -> list[str]:
    """Return every assumed value, and the facts that at least half of the draws show where it alone is changed."""
    own, rows = report["values"], report["rows"]
    found = [["as it is", "", "", _shown(rows[0])]]
    for key, (name, unit) in NAMES.items():
        alone = {row["changes"][key]: _shown(row) for row in rows if row["changes"].keys() == {key}}
        ways = (
            " / ".join(each for value, each in alone.items() if (value > own[key]) == more) for more in (False, True)
        )
        found += [[name, number(own[key] / unit), *ways]] if key in own else []
    for row in rows:
        steps = {key: value / own[key] for key, value in row["changes"].items() if key in GRID}
        if steps:
            names = " and ".join(f"{GRID[key]} times {number(factor)}" for key, factor in steps.items())
            found.append([names, "", "", _shown(row)])
        if verdict := row["changes"].get("protocol.verdict"):
            found.append([f"verdict {VERDICTS[verdict]}", VERDICTS[own["protocol.verdict"]], "", _shown(row)])
    return table(["assumed", "here", "facts with less", "facts with more, or with this"], found, numbers_from=1)


def _shown(row: dict[str, Any]) -> str:
    """Return the numbers of the facts that at least half of the draws show."""
    held = [str(n) for n, fact in enumerate(row["facts"], 1) if fact["share"] >= 0.5]
    return " ".join(held) or "none"


def devices(*reports: Report) -> list[str]:
    """Return the area of every method on several devices, a column a device, and the last as a part of the first."""
    found = [{each["label"]: each for each in report["maps"]} for report in reports]
    rows = [
        [
            label,
            *(_area(device[label]) for device in found),
            number(found[-1][label]["area_n2_s_per_m2"] / found[0][label]["area_n2_s_per_m2"], 2),
        ]
        for label in found[0]
    ]
    names = [report["scene"] for report in reports]
    return table([AREA, *(f"`{name}`" for name in names), f"`{names[-1]}` / `{names[0]}`"], rows)


def frictions(*reports: Report) -> list[str]:
    """Return the area of every method, a row for the friction of each report."""
    return _by_row("friction", _friction, reports)


def _friction(report: Report) -> str:
    """Return what a table calls the friction of a report of `seed-2011`."""
    changes = report["maps"][0]["changes"]
    if "presliding.model" in changes:
        return f"the scene's, on bristles of {number(changes['presliding.stiffness_n_per_m'] / 1e6)} N/µm (Dahl)"
    if "handle.coulomb_n" not in changes:
        return "the scene's, 0.1 N"
    return f"{changes['handle.coulomb_n']:g} N" if changes["handle.coulomb_n"] else "none"


def conditions(*reports: Report) -> list[str]:
    """Return the area of every method, a row for the device of each report."""
    return _by_row("device", _condition, reports)


def _by_row(what: str, name: Callable[[Report], str], reports: tuple[Report, ...]) -> list[str]:
    """Return the area of every method, a row for each report, which is called by what it differs in."""
    rows = [[name(report), *(_area(each) for each in report["maps"])] for report in reports]
    return table([f"{what}; {AREA}", *(each["label"] for each in reports[0]["maps"])], rows)


def _condition(report: Report) -> str:
    """Return what a table calls the device of a report: its scene, and what was changed of handle and encoder."""
    changes = report["maps"][0]["changes"]
    bristles = ", on bristles" if "presliding.model" in changes else ""
    encoder = f", encoder {changes['encoder.seed']} with errors" if "encoder.seed" in changes else ""
    return f"`{report['scene']}`{bristles}{encoder}"


def jerks(*reports: Report) -> list[str]:
    """Return the area of every method that has a bound on the jerk, a row for the bound of each report."""
    bounds = [number(report["maps"][0]["changes"]["controller.jerk_max_m_per_s3"], 1) for report in reports]
    told = {label: found for label, found in _areas(*reports).items() if len(set(found)) > 1}
    return table([f"jerk (m/s³); {AREA}", *told], zip(bounds, *told.values(), strict=True))


def without_jerk(*reports: Report) -> list[str]:
    """Return the area of every method that has the same in all reports, whatever their bounds on the jerk."""
    return table(["method", AREA], ([label, of[0]] for label, of in _areas(*reports).items() if len(set(of)) == 1))


def _areas(*reports: Report) -> dict[str, list[str]]:
    """Return the areas of every method, in the order of the reports."""
    return {of[0]["label"]: [*map(_area, of)] for of in zip(*(each["maps"] for each in reports), strict=True)}


def samples(*reports: Report) -> list[str]:
    """Return the area of every method, a column for the samples a force of each report."""
    scenes = [load(each["maps"][0]["scene"], each["maps"][0]["changes"]) for each in reports]
    numbers = [f"{scene.spec.samples_per_actuation}" for scene in scenes]
    return table(
        [f"samples a force; {AREA}", *numbers], ([method, *areas] for method, areas in _areas(*reports).items())
    )


def hands(report: Report) -> list[str]:
    """Return the area of every method, a row for each hand on the handle, and one for the worst of them."""
    found: dict[str, dict[str, Map]] = {}
    for each in report["maps"]:
        method, _, hand = each["label"].rpartition(", ")
        found.setdefault(hand, {})[method] = each
    methods = list(next(iter(found.values())))
    return table(
        [f"hand; {AREA}", *methods], ([hand, *(_area(own[name]) for name in methods)] for hand, own in found.items())
    )


def cutoffs(*reports: Report) -> list[str]:
    """Return the best cutoff of a low pass with and without friction, its range, its area, and that of no filter."""
    rows = [
        [
            "with its friction" if number_of == 0 else "without friction",
            f"{device['best_cutoff_hz']:.0f}",
            f"{device['as_good_from_hz']:.0f} to {device['as_good_to_hz']:.0f}",
            _area(next(each for each in device["maps"] if each["cutoff_hz"] == device["best_cutoff_hz"])),
            _area(device["unfiltered"]),
        ]
        for number_of, report in enumerate(reports)
        for device in report["devices"]
    ]
    heads = ["`seed-2011`", "best cutoff (Hz)", "within 5 % (Hz)", f"its {AREA}", "no filter"]
    return table(heads, rows)


def gains(report: Report) -> list[str]:
    """Return the areas with the gains that the paper gives and with the best, of both outputs of Levant's estimator."""
    heads = ["output, gains", "lambda (√m/s)", "alpha (m/s²)", AREA, "in place", "in place, a sample a force more"]
    rows = []
    for output, found in report["outputs"].items():
        for name, pick in found["picks"].items():
            shifted = pick["area_in_place_with_a_sample_more_n2_s_per_m2"]
            rows.append(
                [
                    f"{output}, {name}",
                    number(pick["lambda_sqrt_m_per_s"]),
                    number(pick["alpha_m_per_s2"]),
                    _area(pick),
                    number(pick["area_in_place_n2_s_per_m2"] / K),
                    "" if shifted is None else number(shifted / K),
                ]
            )
    return table(heads, rows)


def cures(report: Report) -> list[str]:
    """Return the regions of the methods of `hardwall drop`, the largest first, in parts of the paper's best."""
    ordered = _by_area(report["methods"].values())
    heads = ["method", "area, relative to Levant u, adjusted gains", "largest K (kN/m)", "to B (N s/m)"]
    return table(
        heads,
        ([each["label"], number(each["of_papers_best"], 2), _largest(each), _end(each)] for each in ordered),
    )


def stiffest(report: Report) -> list[str]:
    """Return the largest stable stiffness of every method by rate, with the interval of the starts."""
    rates = report["methods"][0]["rates_hz"]
    heads = ["largest K (kN/m)", "own rates", *map(rate_text, rates), "best over own"]
    rows = []
    for each in report["methods"]:
        values = [
            of_draws(k, *ends, K, whole=True)
            for k, ends in zip(
                each["largest_stiffness_n_per_m"], each["largest_stiffness_interval_n_per_m"], strict=True
            )
        ]
        own = each["largest_stiffness_at_the_scenes_rates_n_per_m"]
        ends = each["largest_stiffness_interval_at_the_scenes_rates_n_per_m"]
        most = max(each["largest_stiffness_n_per_m"]) / own
        rows.append([f"`{each['label']}`", of_draws(own, *ends, K, whole=True), *values, number(most, 2)])
    return table(heads, rows)


def same_verdicts(*reports: Report) -> list[str]:
    """Return how many walls two backends hit, and of how many the verdicts of all starts are equal."""
    heads = ["method", *(f"hits on `{report['backend']}`" for report in reports), "walls", "walls with equal verdicts"]
    rows = []
    for maps_of_one in zip(*(report["maps"] for report in reports), strict=True):
        verdicts = [{tuple(wall[:2]): wall[2:] for wall in each["p_stable"]} for each in maps_of_one]
        walls = set().union(*verdicts)
        equal = sum(all(one.get(wall) == other.get(wall) for one, other in pairwise(verdicts)) for wall in walls)
        rows.append(
            [maps_of_one[0]["label"], *(str(each["hits"]) for each in maps_of_one), str(len(walls)), str(equal)]
        )
    return table(heads, rows)
