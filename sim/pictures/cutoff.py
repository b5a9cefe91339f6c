"""The picture of the area of the stable region against the filter's cutoff."""

from collections.abc import Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from ..studies.cutoff import LEVEL, PAPERS_HZ, Device

COLOURS = ("tab:blue", "tab:orange", "tab:green", "tab:red", "tab:purple")
TICKS_HZ = (30, 50, 100, 200, 500, 1000, 2000, 4000)


def plot_cutoff(devices: Sequence[Device], backend: str) -> Figure:
    """Return the picture: a panel a device, over one axis of cutoffs.

    Args:
        devices: what was found.
        backend: that the maps were made on.
    """
    picture = Figure(figsize=(10, 1 + 3 * len(devices)), layout="constrained")
    panels = picture.subplots(len(devices), sharex=True, squeeze=False)[:, 0]
    for index, (axes, device) in enumerate(zip(panels, devices, strict=True)):
        _draw(axes, device, COLOURS[index % len(COLOURS)])
    panels[-1].set_xscale("log")
    panels[-1].set_xticks(TICKS_HZ, [f"{each}" for each in TICKS_HZ])
    panels[-1].xaxis.set_minor_formatter(NullFormatter())
    panels[-1].set_xlabel("cutoff of the second-order Butterworth filter (Hz); dotted: the founding paper's")
    picture.suptitle(f"Area of the stable region of walls (K, B): finite difference and filter, {backend}")
    return picture


def _draw(axes: Axes, device: Device, colour: str) -> None:
    """Draw one device's areas."""
    areas = {cutoff_hz: each.area / 1e3 for cutoff_hz, each in device.maps.items()}
    for cutoff_hz in PAPERS_HZ:
        axes.axvline(cutoff_hz, color="0.4", ls=":", lw=1)
    axes.plot(list(areas), list(areas.values()), color=colour, marker="o", ms=4, lw=1.4)
    if leaving := [cutoff_hz for cutoff_hz, each in device.maps.items() if each.leaves]:
        style = {"ls": "", "marker": "^", "ms": 8, "mfc": "none", "color": colour}
        axes.plot(leaving, [areas[each] for each in leaving], label="and more: the region leaves the map", **style)
    best = f"best: {device.best_hz:.0f} Hz, {areas[device.best_hz]:.0f}" + ", at the end" * device.at_end
    axes.plot(device.best_hz, areas[device.best_hz], ls="", marker="*", ms=15, color=colour, mec="black", label=best)
    low, high = device.level_hz
    axes.axvspan(low, high, color=colour, alpha=0.12, label=f"within {LEVEL:.0%} of that: {low:.0f} to {high:.0f} Hz")
    unfiltered = device.unfiltered.area / 1e3
    axes.axhline(unfiltered, color="black", ls="--", lw=1, label=f"no filter: {unfiltered:.0f}")
    axes.set_title(_settings(device), fontsize=9)
    axes.set_ylabel("area (kN/m N s/m)")
    axes.set_ylim(0, 1.1 * max(*areas.values(), unfiltered, 1e-3))
    axes.grid(alpha=0.3, axis="y")
    axes.legend(fontsize=8, loc="best")


def _settings(device: Device) -> str:
    """Return which device it is, and how it was mapped."""
    handle, controller, grid = device.scene.handle, device.scene.controller, device.scene.zwidth
    friction = f"{handle.coulomb_n:g} N" if handle.coulomb_n else "no"
    return (
        f"{device.scene.name}: {handle.mass_kg:g} kg, {friction} dry friction, counts of "
        f"{device.scene.encoder.count_m * 1e6:g} µm, samples at {controller.sample_hz / 1e3:g} kHz, force at "
        f"{controller.actuation_hz / 1e3:g} kHz; steps of {grid.stiffness_step_n_per_m / 1e3:g} kN/m, "
        f"{grid.damping_step_n_s_per_m:g} N s/m"
    )
