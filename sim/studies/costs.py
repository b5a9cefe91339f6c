"""What a velocity estimator costs in logic: alone, as synthesised, and as part of a board, placed and routed."""

from collections.abc import Iterable

from ..rtl.synthesis import estimator_cells, synthesise
from ..scene.load import load

RATES = {
    "ecp5-25k": {},
    "ice40-up5k": {
        "controller.clock_hz": 24_000_000,
        "controller.sample_hz": 500_000,
        "controller.actuation_hz": 500_000,
    },
}
"""By device: what differs from the scene `mhz`, which is too fast for the slower one."""


def cost(estimator: str, device: str, seeds: Iterable[int]) -> dict:
    """Return what an estimator takes of a device, at the rates of the scene `mhz` or the slower device's.

    Returns:
        estimator, device, clock_mhz, sample_hz: what was synthesised.
        lut4, ff, dsp, bram: cells of the estimator alone, before placing.
        latency_clocks: of the estimator, strobe to valid.
        board: the report of `synthesis.synthesise`.

    Raises:
        SynthesisError: if a tool is missing or fails, as when the board does not fit.
    """
    scene = load("mhz", RATES[device] | {"controller.estimator": estimator, "controller.output": None})
    return {
        "estimator": estimator,
        "device": device,
        "clock_mhz": scene.spec.clock_hz / 1e6,
        "sample_hz": scene.spec.sample_hz,
        **estimator_cells(scene.spec, device),
        "latency_clocks": scene.spec.design.estimator.latency,
        "board": {"scene": scene.name} | synthesise(scene.spec, device, list(seeds), scene.controller.glitch_clocks),
    }
