"""Small results of studies, made by hand, from which pictures are drawn without a run."""

from dataclasses import replace
from functools import cache

import numpy as np

from hardwall.cli.capture import Captures
from hardwall.host.capture import Captured
from hardwall.model.estimators.levant import Gains
from hardwall.sim.estimates import figures
from hardwall.sim.loop.record import Overview, Trace
from hardwall.sim.scene.case import Case
from hardwall.sim.scene.load import load, read
from hardwall.sim.scene.tables import load_any
from hardwall.sim.studies import (
    axes,
    bits,
    costs,
    cutoff,
    drop,
    gains,
    lipschitz,
    mass,
    rates,
    response,
    shortcuts,
    sines,
    trade,
)
from hardwall.sim.studies.accuracy import Accuracy
from hardwall.sim.studies.drop_result import Drop, End, Law, Shaken
from hardwall.sim.studies.rendered import Moving, Rendered
from hardwall.sim.studies.rendered_setting import Setting
from hardwall.sim.studies.zwidth import ZWidth
from hardwall.sim.walls import theory
from hardwall.sim.walls.boundary import BoundaryPoint
from hardwall.sim.walls.chatter import Chatter
from hardwall.sim.walls.edge_shift import Move
from hardwall.sim.walls.hit import Hit
from hardwall.sim.walls.hit_axes import AxesHit
from hardwall.sim.walls.hit_beside import Beside
from hardwall.sim.walls.mapping import Effort
from hardwall.sim.walls.methods import Curve, methods
from hardwall.sim.walls.zwidth import Map

NOTHING = Effort("fixed", 0, 0.0)


def captured(motion: str) -> Captures:
    """Return a capture of a contact, whose records have an array `motion` of velocities or of accelerations."""
    time_s = np.arange(-20, 60) * 1e-4
    motions = dict.fromkeys(("velocity_m_per_s", "acceleration_m_per_s2")) | {motion: np.sin(100 * time_s)}
    force_n, flags = np.minimum(-100 * time_s, 0.0), (time_s >= 0).astype(np.int64)
    return Captures(
        Captured(
            time_s,
            0.1 * time_s,
            **motions,
            force_n=force_n,
            flags=flags,
            flag_names=("contact",),
            place=20,
            identity="0" * 16,
        )
    )


def hit(rms_m: float = 0.0, reached: bool = True) -> Hit:
    """Return a hit with 20 ms of contact and a noisy estimate, which is off by 20 mm/s between the kept samples."""

    def trace(times: np.ndarray) -> Trace:
        position, velocity = 1e-3 * np.sin(150 * times), 0.15 * np.cos(150 * times)
        noise = np.random.default_rng(1).normal(0, 5e-3, len(times))
        return Trace(times + 0.5, position, velocity, velocity + noise, -1e4 * np.maximum(position, 0))

    contact = trace(np.arange(-10, 300) * 1e-4 if reached else np.zeros(0))
    judged = "stable" if rms_m < 3e-6 else "unstable"
    run = {
        "offset_m": 0.0,
        "drift_m_per_s": 0.0,
        "judged": judged,
        "samples": 60_000,
        "seconds": 1.0,
        "mean_m": 3e-5,
        "touched": reached,
        "max_force_n": 10.0,
    }
    whole = trace(np.linspace(-0.5, 5.5, 500))
    wrong = whole.estimate_m_per_s - whole.velocity_m_per_s
    overview = Overview(*vars(whole).values(), wrong - 0.02, wrong + 0.02, whole.force_n, whole.force_n)
    kept = {"overview": overview, "detail": contact}
    return Hit(load("seed-2011"), "fixed", rms_m=rms_m, flags=[], force_sha256="0" * 64, **run, **kept)


def hit_beside() -> Beside:
    """Return an unstable hit on seed-2011 beside a stable one on mhz."""
    return Beside((hit(4.2e-6), replace(hit(), scene=load("mhz"))))


def hit_axes() -> AxesHit:
    """Return hits of eight axes, one of them unstable, and one that never reached its wall."""
    scene = load_any("eight-axes")
    made = {axis.axis: replace(hit(), scene=axis) for axis in scene.axes}
    made |= {
        "elbow": replace(hit(4.2e-6), scene=scene.axes[2]),
        "grip": replace(hit(reached=False), scene=scene.axes[7]),
    }
    return AxesHit(scene, "fixed", 1.0, made)


def verdict(stable: bool) -> dict:
    """Return a verdict on a wall, as that of `hardwall.sim.walls.mapping`."""
    said = {"verdict": "stable" if stable else "unstable", "in_place": stable}
    return said | dict.fromkeys(("rms_mm", "offset_mm", "drift_mm_per_s", "run_s", "seconds"), 0.0)


def map_of(method: str, stiffest_n_per_m: float, last_n_s_per_m: float, case: Case | None = None) -> Map:
    """Return the map of a method on seed-2011, whose K rises and falls over B."""
    if case is None:
        curve = methods()[method]
        case = Case(curve.label, "seed-2011", read("seed-2011"), curve.changes)
    dampings = np.linspace(6, 300, 15)
    heights = stiffest_n_per_m * np.sin(np.pi * np.clip(dampings / last_n_s_per_m, 0, 1))
    walls = zip(dampings.tolist(), heights.round(-3).tolist(), strict=True)
    boundary = [BoundaryPoint(b, k, k + 1e3) for b, k in walls]
    return Map(case, boundary, 40, [True] * len(boundary))


def zwidth(maps: list[Map]) -> ZWidth:
    """Return maps as a result of the study `zwidth`."""
    return ZWidth(load("seed-2011"), maps, [], NOTHING)


@cache
def maps() -> ZWidth:
    """Return a map of each of the founding paper's methods, always the same, as its limits take long to compute."""
    ends = {"fdm-30": 90, "fdm-100": 190, "fdm-500": 300, "fdm-1000": 400, "proposed": 130, "adjusted": 180}
    return zwidth([map_of(name, 250 * end, end) for name, end in ends.items()])


def rows() -> Accuracy:
    """Return the rows that are measured for Figure 2."""
    found = [
        curve.job("paper", rate) | {"rms_mm_s": 1e4 / rate / (1 + number), "backend": "float"}
        for number, curve in enumerate(figures.curves(2))
        for rate in (1_000, 100_000, 10_000_000)
    ]
    labels = [curve.label for curve in figures.curves(2) for _ in range(3)]
    return Accuracy(2, figures.curves(2), [row | {"encoder_phase_error_counts": 0.0} for row in found], labels)


def bits_dropped() -> bits.Bits:
    """Return the errors and sizes of two estimators with some bits of velocity dropped."""
    rows = [
        {"estimator": estimator, "output": output, "sample_hz": 1_000_000, "bits_dropped": dropped}
        | {"velocity_bits": 20 - dropped, "rms_mm_s": (0.1 + dropped) * scale}
        | {"lut4": 500 * scale - dropped, "ff": 300 * scale, "dsp": 3, "bram": 0}
        for estimator, output, scale in (("levant", "u", 2), ("levant", "u1", 1), ("kalman", "u", 3))
        for dropped in list(bits.DROPPED)[:3]
    ]
    return bits.Bits(rows)


def responses() -> response.Responses:
    """Return the responses of two estimators, one of which shows nothing of the smallest sine."""
    rows = [
        {
            "label": name,
            "estimator": name,
            "output": "u",
            "sample_hz": 10_000,
            "frequency_hz": hz,
            "amplitude_counts": counts,
        }
        | {
            "gain": gain,
            "lead_deg": None if not gain else -0.1 * hz * scale,
            "gain_from": gain / 2,
            "gain_to": 2 * gain,
        }
        | {"flags": []}
        for name, scale in (("fdm", 1), ("levant", 2))
        for counts, gain in ((0.5, 0.0), (10.0, 0.9), (100.0, 1.0 / scale))
        for hz in (70.0, 200.0)
    ]
    return response.Responses(rows, "seed-2011")


def masses() -> mass.Masses:
    """Return the stable masses of two estimators at two rates, with one that none is, and one of no theory."""
    curves, shares = [Curve(name, name, "u") for name in ("kalman", "levant-2")], [-0.5, 0.0, 0.5]
    settings, starts = mass.settings_of(curves, [100_000]), 4
    stable = [[row % 3, starts if row % 5 else row % 4, starts] for row in range(len(settings))]
    stable[1] = [0, 3, 0]
    theory = {(rate_hz, wall): (-0.3, 0.9) for _, rate_hz, wall in settings}
    theory[None, mass.WALLS[-1]] = None
    return mass.Masses("seed-2011", 0.35, starts, shares, settings, stable, theory)


def costs_of_boards() -> costs.Costs:
    """Return the costs of three estimators on two parts, one of which is too small for the largest."""

    def row(estimator: str, device: str, lut4: int, max_sample_hz: float) -> dict:
        board = {"lut4": lut4, "max_sample_hz": max_sample_hz} if lut4 < 5000 else None
        return {"estimator": estimator, "device": device, "board": board}

    return costs.Costs(
        [
            row(estimator, device, lut4, hz / interval)
            for device, hz in (("ecp5-25k", 100e6), ("ice40-up5k", 25e6))
            for estimator, lut4, interval in (("fdm", 3400, 5), ("levant", 4500, 9), ("levant-edge", 4900, 35))
        ]
        + [row("levant-adaptive", "ice40-up5k", 6000, 1e6)]
    )


def axes_costs() -> axes.AxesCosts:
    """Return the costs of a few numbers of axes, with two estimators, placed with three seeds."""

    def row(estimator: str, number: int, supervised: bool) -> dict:
        slots = max(number, 14 if estimator == "levant" else 4)
        fmax_mhz = 120.0 - number / 2
        return {
            **{"estimator": estimator, "axes": number, "supervised": supervised, "device": axes.DEVICE},
            **{"clock_mhz": 96.0, "lut4": 3000 + 360 * number * (1 + supervised), "ff": 2000, "dsp": 5, "bram": 0},
            **{"available": {"lut4": 24288, "dsp": 28, "bram": 56}, "untimed": [], "latency_clocks": 25},
            **{"seeds": [1, 2, 3], "fmax_mhz_seeds": [fmax_mhz, fmax_mhz - 4, fmax_mhz + 2], "fmax_mhz": fmax_mhz},
            **{"interval_clocks": slots, "max_sample_hz": round(fmax_mhz * 1e6 / slots)},
        }

    kinds = [("levant", True), ("levant", False), ("fdm", True)]
    return axes.AxesCosts([row(name, number, kind) for name, kind in kinds for number in (1, 8, 32)])


def devices() -> cutoff.Cutoffs:
    """Return the cutoffs of two devices: one optimum inside the range, and one at its end."""
    scene = load("seed-2011")
    found = []
    for best in (500, 4000):
        own = {hz: map_of("fdm-500", 1e5 / (1 + np.log(hz / best) ** 2), 200) for hz in (30.0, 100.0, 500.0, 4000.0)}
        found.append(cutoff.Optimum(scene, own, map_of("fdm-500", 4e4, 200)))
    return cutoff.Cutoffs(found, NOTHING)


def search() -> gains.Search:
    """Return a search of few gains, where the best gains also meet the condition."""
    scene, lambdas, alphas = load("seed-2011"), np.geomspace(1, 100, 5), np.geomspace(1, 1000, 6)
    pairs = [Gains(lam, alpha) for lam in lambdas.tolist() for alpha in alphas.tolist()]
    own = {pair: map_of("adjusted", 500 * pair.lambda_sqrt_m_per_s, 180) for pair in pairs}
    papers = {"proposed": Gains(12**0.5, 13.2), "adjusted": Gains(250**0.5, 50.0)}
    named = papers | dict.fromkeys(("best", "best within the condition"), pairs[-2]) | {"best in place": pairs[8]}
    picks = {
        name: gains.Pick(pair, *(map_of("adjusted", end, 180) for end in (4e4, 1e4))) for name, pair in named.items()
    }
    between = {Gains(5.0, 8.0): map_of("adjusted", 5e4, 180)}
    of_grid, between, picks = ({"u": each, "u1": each} for each in (own, between, picks))
    return gains.Search(scene, lambdas, alphas, of_grid, between, picks, NOTHING)


def dropped() -> Drop:
    """Return the four experiments, with a handle that left the wall, and a law without an end."""
    scene = load("seed-2011")
    curves = drop.curves(scene)
    found = {}
    for number, (name, curve) in enumerate(curves.items()):
        case = Case(curve.label, "seed-2011", read("seed-2011"), curve.changes)
        found[name] = map_of(name, 3e4 + 1e4 * number, 120 + 40 * number, case)
    walls = [(name, b, hit) for name in curves for b in drop.DAMPINGS_N_S_PER_M.tolist() for hit in range(2)]
    shaken = [Shaken(name, b, None if b > 350 else 1e-5 if b > 100 else 0.0) for name, b, _ in walls]
    ends = [End(name, k, 40.0, 80.0) for name in drop.PAPERS for k in drop.STIFFNESSES_N_PER_M]
    factors = ("none", *drop.TIMES, *drop.GAINS, "samples a force")
    laws = [Law(each, "x 2", name, 40.0 + n, 45.0 * 1.1**n) for name in drop.PAPERS for n, each in enumerate(factors)]
    laws.append(Law("none", "", "kalman", np.inf, np.inf))
    quiet = Chatter(np.zeros(3), np.zeros(3))
    return Drop(scene, dict.fromkeys(curves, quiet), shaken, ends, laws, found, NOTHING)


def fit() -> lipschitz.Lipschitz:
    """Return a fit of one sine to a swing."""
    times = np.linspace(-0.1, 0.4, 200)
    swing = sines.Sines(np.array([20.0]), np.array([1e-2]), np.array([0.0]))
    return lipschitz.Lipschitz(
        load("seed-2011"), times, 1e-2 * np.sin(20 * times), 0.2 * np.cos(20 * times), swing, 36.0, []
    )


def rate_gains() -> rates.Rates:
    """Return the maps of two methods over the rate, and the linear limits, one of which leaves the picture."""
    hz = [1_000, 10_000, 1_000_000]
    found = []
    for method, scale in (("adjusted", 1.0), ("fdm-500", 1.1)):
        at = [map_of(method, scale * k, 200) for k in (3e4, 1e5, 3e5, 3e5)]
        found.append(rates.Gain(at[0].case.label, hz, at[0], at[1:]))
    limits = {left: [1e5 * n, 4e5 * n, 5e5 * n**2] for n, left in enumerate(rates.WITHOUT, 1)}
    return rates.Rates(load("seed-2011"), found, limits, NOTHING)


def rendered_setting(name: str, rate_hz: int | None, moving: Moving, starts: int = 3) -> Setting:
    """Return what a wall would render with two thirds of its stiffness, and a hundredth more at each start."""
    curve = methods()[name]
    at = rates.at_rate(rate_hz) if rate_hz else {}
    case = Case(curve.label, "seed-2011", read("seed-2011"), curve.changes | at)
    scene, parts = case.scene, [1 + 0.01 * number for number in range(starts)]

    def wave(frequency_hz: int, damping_n_s_per_m: float) -> dict:
        whole = theory.impedance_n_per_m(scene.hitting(10e3, damping_n_s_per_m), frequency_hz, exact=True)
        values = 2 * whole.real / 3, whole.imag / (2 * np.pi * frequency_hz)
        stiffness, damping = ([value * part for part in parts] for value in values)
        rendered = {"stiffness_n_per_m": stiffness, "damping_n_s_per_m": damping}
        return rendered | {"rest_n": [0.1] * starts, "flags": ["force_limited"]}

    def contact(speed_m_per_s: float) -> dict:
        firsts = {"first_n": [20 * speed_m_per_s * part for part in parts], "first_s": [1e-3 * part for part in parts]}
        return firsts | {"rate_hardness_n_per_m": [15e3 * part for part in parts], "flags": []}

    waves = {each: wave(each, 20.0) for each in moving.frequencies_hz if 2 * each < scene.controller.actuation_hz}
    contacts = {each: contact(each) for each in moving.speeds_m_per_s}
    return Setting(curve, rate_hz, case, waves, wave(moving.frequencies_hz[0], 0.0), contacts)


def rendered_walls() -> Rendered:
    """Return what two estimators render at three rates; one start never feels the wall."""
    moving = Moving([1, 50, 600], 1e-4, [0.05, 0.2], 2e-3)
    at = [(name, rate) for name in ("adjusted", "fdm-100") for rate in (None, 1_000, 10_000)]
    settings = [rendered_setting(*each, moving) for each in at]
    unfelt = settings[-1].contacts[0.05]
    unfelt["first_n"][1] = unfelt["first_s"][1] = None
    return Rendered(load("seed-2011"), "fixed", 3, moving, settings)


def traded() -> trade.Trade:
    """Return a trade of every shortcut of drive-2011, with random times and edges."""
    scene = load("drive-2011")
    chance = np.random.default_rng(2)
    points = []
    for each in shortcuts.shortcuts(scene, lambda _: True):
        exact = each is shortcuts.REFERENCE
        hit_s = 0.1 if exact else 0.1 * 10 ** chance.uniform(-1, 1)
        moves = {}
        for label in ("adjusted", "fdm-500"):
            area, half = (1.0, 0.0) if exact else (float(chance.uniform(0.7, 1.3)), float(chance.uniform(0, 0.2)))
            moves[label] = Move(area, area - half, area + half, 0.02, area - 1, 5)
        points.append(trade.Point(each, hit_s, 100, 100 * hit_s, moves))
    return trade.Trade(scene, points, 10, 8)
