"""The states of the supervisor and what leads from one to another, as every combination of its inputs shows it."""

from collections.abc import Iterator, Mapping
from functools import cache
from itertools import combinations, product

from hardwall.model.axis import supervisor
from hardwall.model.axis.supervisor import ALL, ALWAYS, ARMED, CAUSES, DISARMED, LINK, TRIPPED

from .pin_to_drive import spec_of_scene
from .sheet import GREEN, GREY, INK, LARGE, LINE, RED, Box, Place, Sheet, bold, small

STATES = {DISARMED: "DISARMED", ARMED: "ARMED", TRIPPED: "TRIPPED"}
REQUESTS = "arm", "disarm", "acknowledge"
WORDS = {
    "arm": ("arm", ""),
    "disarm": ("disarm", ""),
    "acknowledge": ("acknowledge", ""),
    "cause": ("a cause", "no cause stands"),
    "cause_if_armed": ("a cause that is watched while ARMED", ""),
    "enable": ("drive_enable closed", "drive_enable open"),
    "live": ("heartbeat live", "heartbeat overdue"),
    "referenced": ("reference found", ""),
    "reference": ("", "not asked for"),
}
"""What decides, and what is said where it must be so, and where it must not; nothing where nobody doubts it."""
FACTS = tuple(WORDS)
OTHERS = ALL & ~ALWAYS & ~(1 << LINK)
CAUSE, CAUSE_IF_ARMED = ALWAYS & -ALWAYS, OTHERS & -OTHERS
"""A cause that is watched always, and one that is watched while ARMED; `live` stands for link_timeout."""
EVERY = (1 << (1 << len(FACTS))) - 1
"""All combinations of facts, a bit each: in combination n fact k is so if bit k of n is set."""
SO = [sum(1 << n for n in range(1 << len(FACTS)) if n >> k & 1) for k in range(len(FACTS))]
Term = Mapping[str, bool]
"""Facts that must be so, or must not; the others do not matter."""


@cache
def _params() -> supervisor.Params:
    return supervisor.Design(spec_of_scene()).params


def stepped(state: int, causes: int, live: int = 1, **inputs: int) -> supervisor.State:
    """Return the supervisor a clock later, with the first cause latched and every cause enabled."""
    before = supervisor.START._replace(state=state, live=live, left=1, latched=1, ceiling=1 << 20)
    given = supervisor.Inputs(causes=causes, acknowledged=1, drive=1, supervisor_force_limit=1, supervisor_causes=ALL)
    return supervisor.step(_params(), before, given._replace(**inputs))


def _after(state: int, n: int) -> int:
    """Return the state after a clock with a combination of facts."""
    so = {name: n >> k & 1 for k, name in enumerate(FACTS)}
    causes = so["cause"] * CAUSE | so["cause_if_armed"] * CAUSE_IF_ARMED
    inputs = {name: so[name] for name in ("enable", "referenced", "arm", "disarm", "acknowledge")}
    return stepped(state, causes, so["live"], **inputs, supervisor_reference=so["reference"]).state


def _terms(ways: int) -> Iterator[Term]:
    """Yield the terms that cover some combinations of facts and no other, those with the fewest facts first."""
    covered = 0
    for size in range(len(FACTS) + 1):
        for chosen in combinations(range(len(FACTS)), size):
            for values in product((True, False), repeat=size):
                matching = EVERY
                for k, value in zip(chosen, values, strict=True):
                    matching &= SO[k] if value else ~SO[k]
                if not matching & ~ways and matching & ~covered:
                    covered |= matching
                    yield {FACTS[k]: value for k, value in zip(chosen, values, strict=True)}


@cache
def transitions() -> dict[tuple[int, int], tuple[Term, ...]]:
    """Return, for every pair of states of which one leads to the other, the terms of which any makes it do so."""
    ways: dict[tuple[int, int], int] = {}
    for before in STATES:
        for n in range(1 << len(FACTS)):
            after = _after(before, n)
            if after != before:
                ways[before, after] = ways.get((before, after), 0) | 1 << n
    return {pair: tuple(_terms(every)) for pair, every in ways.items()}


def tripping(state: int) -> list[str]:
    """Return the names of the causes that trip from a state."""
    ends = (stepped(state, 1 << bit, int(bit != LINK), enable=1).state for bit in range(len(CAUSES)))
    return [cause.name for cause, end in zip(CAUSES, ends, strict=True) if end == TRIPPED]


def said(terms: tuple[Term, ...]) -> list[str]:
    """Return in words what makes a transition, first what the host asks for: what all terms need, and what any does."""
    common = set.intersection(*(set(term.items()) for term in terms))
    needs = [WORDS[name][not so] for name, so in terms[0].items() if (name, so) in common]
    apart = [WORDS[name][not so] for term in terms for name, so in term.items() if (name, so) not in common]
    either = " or ".join(filter(None, apart))
    asked = bool(needs) and needs[0] in REQUESTS
    return [*filter(None, (*needs, either) if asked else (either, *needs))]


def draw() -> str:
    """Return the diagram."""
    sheet = Sheet(428)
    places = {DISARMED: Box(20, 112, 158, 74), ARMED: Box(522, 112, 158, 74), TRIPPED: Box(271, 322, 158, 74)}
    for state, tone in ((DISARMED, GREY), (ARMED, GREEN), (TRIPPED, RED)):
        lets_out = bool(stepped(state, 0, enable=1).driven)
        drive = "drive within the limit" if lets_out else "drive 0"
        sheet.box(places[state], bold(STATES[state], LARGE), small(drive), tone=tone)
    first = places[supervisor.START.state]
    sheet.wire((first.left + 50, 66), (first.left + 50, first.top))
    sheet.text((first.left + 50, 46), small("power-up,"), small("reset"))
    drawn = {}
    for pair, place in _ways(places).items():
        drawn[pair] = transitions()[pair]
        _transition(sheet, pair, *place)
    if drawn != transitions():
        raise ValueError(f"every transition must have its arrow, not only {', '.join(map(str, drawn))}")
    return sheet.svg()


def _ways(places: dict[int, Box]) -> dict[tuple[int, int], tuple[Place, str, tuple[Place, ...], str]]:
    """Return for every transition the place and the alignment of its words, its arrow, and its colour."""
    off, on, tripped = places[DISARMED], places[ARMED], places[TRIPPED]
    up, down = off.y - 16, off.y + 16
    low, high = tripped.y + 18, tripped.y - 18
    return {
        (DISARMED, ARMED): ((350, up - 58), "center", ((off.right, up), (on.left, up)), GREEN.edge),
        (ARMED, DISARMED): ((350, down + 38), "center", ((on.left, down), (off.right, down)), LINE),
        (ARMED, TRIPPED): ((516, high + 36), "center", ((on.x, on.bottom), (on.x, tripped.y), tripped.east), RED.edge),
        (DISARMED, TRIPPED): ((158, low + 24), "center", ((52, off.bottom), (52, low), (tripped.left, low)), RED.edge),
        (TRIPPED, DISARMED): ((148, high - 55), "left", ((tripped.left, high), (136, high), (136, off.bottom)), LINE),
    }


def _transition(sheet: Sheet, pair: tuple[int, int], at: Place, align: str, way: tuple[Place, ...], ink: str) -> None:
    """Draw the arrow of a transition, and write what makes it."""
    sheet.wire(*way, ink=ink)
    before, after = pair
    words = said(transitions()[pair])
    if words[1:]:
        words[1] = f"while {words[1]}"
    if after == TRIPPED:
        number = len(tripping(before))
        words = [f"any of {number} causes", *(["watched in every state"] if number < len(CAUSES) else [])]
    if "acknowledge" in words:
        words.insert(1, "of just the causes that are latched")
    head, *rest = words
    sheet.text(at, bold(head, ink=ink if ink != LINE else INK), *map(small, rest), align=align)
