"""The cases of `digests.json`: calls of the program, recorded by `make digests` and checked by `test_digests`.

The program is driven through its command line alone, so that its files may move and its functions may change their
names. Every entry has its own name and its own line in the file, so that a diff shows what changed. `digest_driver`
runs a call, makes entries of its output, and compares them with the recorded ones.

    make digests                    record everything anew, and say what changed
    make digests ONLY=hit/mhz       record only the cases whose names begin with hit/mhz
"""

import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

from support.digest_driver import (
    FILE,
    axis_netlist,
    belongs,
    board_netlist,
    differences,
    load,
    machine,
    parts,
    program,
    replayed,
    rows,
    save,
    traced,
    whole,
    working_folder,
)

OUTPUTS = {
    "fdm": ("u",),
    "levant": ("u", "u1"),
    "butterworth": ("u",),
    "kalman": ("u",),
    "tracking-loop": ("u",),
    "period": ("u",),
    "period-count": ("u",),
    "levant-edge": ("u",),
    "levant-semi-implicit": ("u", "u1"),
    "levant-implicit": ("u", "u1"),
    "levant-adaptive": ("z1",),
    "window": ("u",),
    "foaw": ("end-fit", "best-fit"),
    "edge-kalman": ("u",),
    "least-squares": ("u",),
    "mt": ("u",),
    "mt-divisionless": ("u",),
}
SCENES = ("seed-2011", "fit-2011", "drive-2011", "mhz", "desktop-arm", "maglev")
FEW = ("levant", "kalman", "period", "foaw")
"""Estimators of every kind: driven by the count or by stamps, with scalars or arrays as their state."""
HIT = ("levant", "kalman", "period")
"""Those of `FEW` that every `make test` hits with: the loop of one with arrays takes longest to compile."""


def setting(section: str, **values: Any) -> list[str]:
    """Return the command-line options that change keys of a section."""
    return [word for key, value in values.items() for word in ("--set", f"{section}.{key}={value}")]


SHORT = setting("protocol", start_m=-0.002, settle_s=0.3, mean_s=0.05, measure_s=0.1, verdict="literal")
SHORTEST = setting(
    "protocol", start_m=-0.001, settle_s=0.2, mean_s=0.03, measure_s=0.05, threshold_mm=0.02, verdict="literal"
)
# Stable and unstable walls, judged before the handle has quite come to rest.
MAPPED = setting("protocol", start_m=-0.002, settle_s=0.5, mean_s=0.05, measure_s=0.1, threshold_mm=0.02)
GRID = setting(
    "zwidth",
    stiffness_step_n_per_m=5e3,
    stiffness_to_n_per_m=80e3,
    damping_from_n_s_per_m=20.0,
    damping_to_n_s_per_m=180.0,
    damping_step_n_s_per_m=40.0,
)
COARSE_GRID = setting(
    "zwidth",
    stiffness_step_n_per_m=10e3,
    stiffness_to_n_per_m=80e3,
    damping_from_n_s_per_m=20.0,
    damping_to_n_s_per_m=180.0,
    damping_step_n_s_per_m=80.0,
)
LUGRE = {"damping_n_s_per_m": 300.0, "static_n": 0.15, "stribeck_m_per_s": 1e-3}
# Parts of a device that no built-in scene has.
VARIANTS = {
    "euler": ("drive-2011", setting("solver", step_s=2e-5)),
    "euler-rigid": ("seed-2011", setting("solver", step_s=2e-5)),
    "hand": ("seed-2011", setting("hand", mass_kg=0.1, damping_n_s_per_m=2.0, stiffness_n_per_m=50.0, rest_m=1e-3)),
    "encoder-errors": ("seed-2011", setting("encoder", phase_error_counts=0.3, duty_error_counts=0.1)),
    "dahl": ("seed-2011", setting("presliding", model="dahl", stiffness_n_per_m=1e5)),
    "lugre": ("seed-2011", setting("presliding", model="lugre", stiffness_n_per_m=1e5, **LUGRE)),
    "encoder-at-motor": ("drive-2011", setting("transmission", encoder_at='"motor"')),
    "voltage": ("drive-2011", setting("amplifier", bandwidth_hz="", current_limit_a="")),
    "pwm": ("mhz", setting("output", full_scale_n=40.0, pwm_carrier_hz=50_000, pwm_steps=1000)),
    "dac": ("seed-2011", setting("output", full_scale_n=40.0, dac_bits=10)),
    "guards": ("seed-2011", [*setting("wall", forbid_pull="true"), *setting("controller", slew_limit_n_per_s=500.0)]),
}


@dataclass(frozen=True)
class Case:
    """One call of the program.

    Attributes:
        name: the beginning of the names of its entries.
        arguments: the arguments of the command line.
        entries: the function that makes entries of the text on stdout, by the rest of their name; "" for a single one.
        short: whether every `make test` checks it.
        fitted: whether LAPACK solves a part of it, whose last bits differ among processors that Numba takes for one
            kind. Its floats are compared as those of another kind of machine.
    """

    name: str
    arguments: tuple[str, ...]
    entries: Callable[[str], dict[str, Any]]
    short: bool = False
    fitted: bool = False

    def run(self) -> dict[str, Any]:
        """Run the program and return its entries by name."""
        with working_folder():
            found = self.entries(program(*self.arguments))
        return {f"{self.name}/{rest}".rstrip("/"): value for rest, value in found.items()}


def cases() -> list[Case]:
    """Return every case."""
    return [*_hits(), *_traces(), *_estimates(), *_walls(), *_netlists()]


def _hit(scene: str, estimator: str, output: str, backend: str) -> tuple[str, ...]:
    return ("hit", scene, "--estimator", estimator, "--output", output, "--backend", backend, "--json")


def _hits() -> Iterator[Case]:
    for scene in SCENES:
        for estimator, output in ((name, output) for name, outputs in OUTPUTS.items() for output in outputs):
            for backend in ("float", "fixed", "rtl"):
                if backend == "rtl" and scene != "seed-2011" and (estimator, output) != ("levant", "u"):
                    continue  # every one needs its own build, and its words equal those of `fixed`
                own = scene == "seed-2011" and estimator in HIT and backend == "fixed"
                short = own or (estimator, output, backend) == ("levant", "u", "fixed")
                short = short or (scene, estimator, output) == ("seed-2011", "levant", "u")
                name = f"hit/{scene}/{estimator}:{output}/{backend}"
                yield Case(name, (*_hit(scene, estimator, output, backend), *SHORT), whole, short)
    for variant, (scene, options) in VARIANTS.items():
        for backend in ("float", "fixed"):
            arguments = (*_hit(scene, "levant", "u", backend), *SHORT, *options)
            # The rigid device has the steps of Euler's method, too.
            short = backend == "fixed" and variant != "euler"
            yield Case(f"hit/{scene}, {variant}/levant:u/{backend}", arguments, whole, short)


def _traces() -> Iterator[Case]:
    for scene in ("seed-2011", "drive-2011", "mhz"):
        for backend in ("float", "fixed", "rtl"):
            arguments = (*_hit(scene, "levant", "u", backend), *SHORT, "--trace", "trace.npz")
            # A loop with traces is another one to compile.
            yield Case(f"trace/{scene}/{backend}", arguments, traced, (scene, backend) == ("seed-2011", "fixed"))


def _estimates() -> Iterator[Case]:
    for estimator in OUTPUTS:
        for backend in ("float", "fixed"):
            arguments = ("accuracy", "--estimators", estimator, "--rates", "1e4,1e5", "--backend", backend)
            arguments += ("--signal", "stop", "--signal", "flicker", "--workers", "1", "--json")
            short = estimator == "levant" or (estimator in HIT and backend == "fixed")
            yield Case(f"accuracy/{estimator}/{backend}", arguments, rows, short)
    for estimator in FEW:
        for backend in ("float", "fixed", "rtl"):
            arguments = ("replay", "recording.csv", "--column", "counts", "--rate", "1000", "--coarsen", "4")
            arguments += ("--estimator", estimator, "--backend", backend, "--out", "out.csv", "--json")
            # Of `rtl` there are tests that hold it to `fixed`; here it would be a build of its own.
            short = backend == "fixed" or (estimator, backend) == ("levant", "float")
            yield Case(f"replay/{estimator}/{backend}", arguments, replayed, short)


def _walls() -> Iterator[Case]:
    workers = ("--workers", "1", "--json")
    maps = (*MAPPED, *GRID, "--starts", "3", *workers)
    for scene in ("seed-2011", "drive-2011"):
        short = scene == "seed-2011"
        yield Case(f"lipschitz/{scene}", ("lipschitz", scene, *SHORT, "--json"), whole, short, fitted=True)
        for backend in ("float", "fixed"):
            options = ("--backend", backend, *maps)
            yield Case(f"zwidth/{scene}/{backend}", ("zwidth", scene, *options), parts, short and backend == "fixed")
    # A search of the cutoff has many maps: one start each.
    searched = ("cutoff", "seed-2011", *MAPPED, *COARSE_GRID, "--starts", "1", *workers)
    yield Case("cutoff/seed-2011", searched, parts, short=True)
    yield Case("drop/seed-2011", ("drop", "seed-2011", *SHORTEST, *GRID, "--starts", "3", *workers), parts)


def _netlists() -> Iterator[Case]:
    for estimator in OUTPUTS:
        arguments = ("verilog", "mhz", "--estimator", estimator)
        yield Case(f"axis/{estimator}", arguments, axis_netlist, estimator == "levant")
        yield Case(f"board/{estimator}", arguments, board_netlist)


def record(only: str) -> None:
    """Record the cases whose names begin with `only`, and print which entries changed, appeared and disappeared."""
    before = load()
    if only and before["machine"] != machine():
        sys.exit("digests.json is of another kind of machine: record everything, without ONLY")
    chosen = [case for case in cases() if case.name.startswith(only)]
    if not chosen:
        sys.exit(
            f"no case begins with {only!r}; they are of {', '.join(sorted({c.name.split('/')[0] for c in cases()}))}"
        )
    found: dict[str, Any] = {}
    for number, case in enumerate(chosen, 1):
        print(f"\r\033[K{number} of {len(chosen)}: {case.name}", end="", file=sys.stderr, flush=True)
        found |= case.run()
    print("\r\033[K", end="", file=sys.stderr)
    old = before["entries"]
    touched = {name for name in old if not only or any(belongs(name, case.name) for case in chosen)}
    for name in sorted(touched | set(found)):
        if name not in found:
            print(f"gone: {name}")
        elif name not in old:
            print(f"new: {name}")
        elif old[name] != found[name]:
            print(f"changed: {name}", *differences(old[name], found[name], True), sep="\n  ")
    save({name: value for name, value in old.items() if name not in touched} | found)
    print(f"{len(found)} entries of {len(chosen)} cases recorded in {FILE.name}")


if __name__ == "__main__":
    record(sys.argv[1] if len(sys.argv) > 1 else "")
