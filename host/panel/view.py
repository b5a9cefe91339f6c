"""The state of a board at a moment, and a page's words for it: what, why, and what to do."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

from ..device import Device
from ..status import State, Status
from .recorder import Recording

ADVICE = {
    "encoder_illegal": "Look at the encoder's cable and its shield",
    "encoder_overspeed": "Move the handle more slowly, or shorten the glitch filter",
    "encoder_loss": "Mend the encoder's wire",
    "index_spacing": "Look at the encoder's index, and the counts of its turn",
    "position_range": "Move the handle back into its range",
    "position_wrap": "Move the handle back, and set its position anew",
    "velocity_limit": "Let the handle come to rest",
    "runaway": "If the wall pulled the handle in, invert the motor. If a hand pushed through it, raise the force limit",
    "estimator_saturated": "Let the handle come to rest",
    "strobe_busy": "Take the bitstream of its own specification",
    "word_range": "Reset the board, for its configuration is damaged",
    "link_timeout": "The page that armed was gone or too slow",
    "external_fault": "Close the amplifier's fault loop",
    "emergency_stop": "Make sure that all is safe, and close the loop of the emergency stop",
}
"""The remedy for a cause, by its name."""


@dataclass(frozen=True)
class View:
    """The state of a board.

    Attributes:
        device: what the board says of itself; None before the first connection.
        status: what it does; None while it is not reached.
        connected: whether the port is open; lost: why the board is not reached.
        holder: the tab that armed it; None if none did.
        lease: the program that holds the lease of a shared board, empty if none does; None if the board is not shared.
        said: why the last act had no effect; empty if it had.
        pace: seconds of the board in a second; None while it is not known.
        looks_hz: how often the board is read.
        values: what the board uses, in SI units, by the names of its words; `revision` changes with them.
        span_s: the shortest and the longest time that a capture spans; zeros for a board without a memory for it.
        recording: what is known of the capture.
        homing: what homing waits for; empty while nobody homes.
        moved_m: how far all positions have moved since the board began to count, m.
    """

    device: Device | None = None
    status: Status | None = None
    connected: bool = False
    lost: str = ""
    holder: str | None = None
    lease: str | None = None
    said: str = ""
    pace: float | None = None
    looks_hz: float = 0.0
    values: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))
    revision: int = 0
    span_s: tuple[float, float] = (0.0, 0.0)
    recording: Recording = field(default_factory=Recording)
    homing: str = ""
    moved_m: float = 0.0


def told(view: View, tab: str) -> dict[str, Any]:
    """Return what a tab is told of a view, as JSON takes it.

    `state`, `why` and `do` are texts. `may` has the actions possible now. `latched` is the word of the causes that the
    tab shows and acknowledges.
    """
    state, why, do = _words(view, tab)
    status = view.status
    trip = status.trip if status else None
    return {
        "state": state,
        "why": why,
        "do": do,
        "may": _acts(view),
        "latched": trip.latched if trip else 0,
        "locked": view.holder not in (None, tab),
        "holds": view.holder == tab,
        "said": view.said,
        "pace": view.pace,
        "looks_hz": view.looks_hz,
        "flags": [
            *(status.flags if status else ()),
            *(("a_channel_idle",) if status and status.a_channel_idle else ()),
        ],
        "wall": {name: view.values.get(f"wall_{name}", 0.0) for name in ("stiffness", "position", "left")},
        "identity": view.device.identity if view.device else "",
    }


def _words(view: View, tab: str) -> tuple[str, str, str]:
    status = view.status
    if status is None:
        if not view.connected:
            return "NO BOARD", view.lost or "It is not connected.", "Without beats it comes to rest. Connect again."
        return "SILENT", view.lost or "The board is asked.", "Without beats it comes to rest. It is asked again."
    if status.trip or status.state is State.TRIPPED:
        names = (status.trip.first or status.trip.causes) if status.trip else ()
        do = ". ".join(ADVICE[name] for name in names)
        return "TRIPPED", f"The drive is 0. {status.trip or ''}", f"{do}. Then acknowledge, and arm again."
    if status.state is State.ARMED:
        limit_n = view.values.get("supervisor_force_limit", 0.0)
        why = f"The axis drives, with up to {limit_n:g} N."
        if view.holder == tab:
            return "ARMED", why, "This tab keeps it armed. Hide or close it, and the board is disarmed."
        # Where no tab holds it, another program has armed it.
        who = "Another tab" if view.holder else view.lease or "Another program"
        return "ARMED", why, f"{who} armed it. Here you may disarm."
    return "DISARMED", "The drive is 0, and the wall is not there.", "Arm, and the wall comes slowly."


def _acts(view: View) -> list[str]:
    if view.status is None:
        return [] if view.connected else ["connect"]
    if view.status.trip or view.status.state is State.TRIPPED:
        return ["acknowledge"]
    return ["disarm"] if view.status.state is State.ARMED else ["arm"]
