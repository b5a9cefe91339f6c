"""One fault in the loop, from the steady contact to the way back to ARMED, and the verdict on it."""

from dataclasses import replace

import numpy as np

from hardwall.model.axis.supervisor import ARMED, DISARMED, TRIPPED, names
from hardwall.testing import SEED
from oracles.supervised import BITS

from .fault import STATES, UNCHANGED, Expected, Fault, NotSteadyError, Outcome, nothing
from .rig import Rig
from .scene import CLOCKS_PER_MS, SPEC, STEP_CLOCKS, TREMOR_N

UNDISTURBED = Fault("", nothing, UNCHANGED, masked=BITS["external_fault"])
"""What another axis is written while the fault is not its own: it takes no part in the loop of `external_fault`."""
REST_MS = 0.2
"""How long the drive is watched after every act of the host on the way back."""


async def judged(rig: Rig, fault: Fault) -> Outcome:
    """Inject a fault into a steady contact; return what came of it.

    What comes of a fault that is common must come of the other axes as well; otherwise they go on undisturbed to the
    end, in a contact of their own.
    """
    others = rig.beside
    try:
        for each in (rig, *others):
            alike = fault if each is rig or fault.common else UNDISTURBED
            await each.contact(alike.words, alike.committed, alike.offset, alike.homed)
    except NotSteadyError as error:
        return Outcome(fault.name, fault.expected.text, "", None, 0.0, 0.0, 0.0, (str(error),))
    # The fault comes at any clock of a sample, the same one for the same seed.
    await rig.run(np.random.default_rng([SEED, *fault.name.encode()]).uniform(0, STEP_CLOCKS / CLOCKS_PER_MS))
    rig.begin()
    try:
        await fault.inject(rig)
    except NotSteadyError as error:
        rig.claim(False, str(error))
    await rig.run(fault.observed_ms)
    outcome, wrong = _found(rig, fault.expected, fault.name)
    stop_too = others if fault.common else ()
    for each in stop_too:
        each.wrong += _found(each, fault.expected, fault.name)[1]
    if not fault.expected.stopped:
        for each in (rig, *stop_too):
            await _way_back(each, fault)
    for each in others:
        if not fault.common:
            each.wrong += _found(each, UNCHANGED, fault.name)[1]
            each.claim(each.see("latched") == 0, f"{' + '.join(names(each.see('latched')))} is latched")
        rig.wrong += [f"axis {each.axis}: {what}" for what in each.wrong]
    return replace(outcome, wrong=(*wrong, *rig.wrong))


def _found(rig: Rig, expected: Expected, name: str) -> tuple[Outcome, list[str]]:
    """Return what came of a fault of that name so far, and what is not as expected."""
    drives = _drives(rig)
    outcome = _outcome(rig, expected, name, drives)
    return outcome, _shortcomings(rig, expected, outcome, drives)


async def _way_back(rig: Rig, fault: Fault) -> None:
    """Make good what was wrong; the drive must stay zero until the host acknowledges what was latched, and arms.

    An axis that is still ARMED must hear a disarm.
    """
    host = rig.host
    if fault.expected.state == ARMED:
        await host.write(disarm=1)
        rig.claim(rig.sees(DISARMED), "a disarm is not heard")
        return
    await fault.repair(rig)
    rig.handle.held = rig.handle.number
    turns, last = len(rig.turns), rig.last_asked
    await host.heartbeat()
    latched = rig.see("latched")
    if fault.expected.state == TRIPPED:
        rig.claim(not await host.arm(), "an arm is taken before the acknowledgement")
        await host.acknowledge(latched ^ 1)
        rig.claim(rig.sees(TRIPPED), "other causes than the latched ones are acknowledged")
        await host.acknowledge(latched)
        rig.claim(rig.sees(DISARMED), f"{' + '.join(names(rig.see('latched')))} is not acknowledged")
    await rig.run(REST_MS)
    rig.claim(turns == len(rig.turns) and last == rig.last_asked, "the drive came back before the arm")
    if fault.homed:
        rig.claim(not await host.arm(), "an arm is taken without a reference")
        for moves in ("preload", "origin_shift"):
            await host.write(**{moves: 1})
            rig.claim(not await host.arm(), f"an arm is taken after the pulse {moves}, with an index that is void")
    elif fault.rearms:
        rig.claim(await host.arm(), "an arm is refused")
        await rig.run(REST_MS)
        rig.claim(rig.sees(ARMED), "the axis cannot be armed again")


def _drives(rig: Rig) -> list[tuple[int, float]]:
    """Return the clocks after the fault from which the drive was what, in N."""
    after = [(clock, word * SPEC.force_resolution_n) for clock, word in rig.turns if clock > rig.began]
    return [(rig.began, rig.before_n), *after]


def _outcome(rig: Rig, expected: Expected, name: str, drives: list[tuple[int, float]]) -> Outcome:
    """Return what was measured, without the verdict."""
    down = next((clock for k, (clock, _) in enumerate(drives) if _is_down(expected, drives[k:])), None)
    largest = max(rig.largest_n, *(abs(driven) for _, driven in drives))
    clocks = rig.given_clocks if expected.stopped else None if down is None else down - rig.began
    tripped = rig.sees(TRIPPED)
    came = " + ".join(names(rig.see("first"))) if tripped else STATES[rig.see("state")]
    return Outcome(
        name=name,
        expected=expected.text,
        came="no clock" if expected.stopped else came,
        clocks=clocks,
        largest_n=largest,
        impulse_n_s=abs(rig.impulse_n_s),
        observed_ms=(rig.now - rig.began) / CLOCKS_PER_MS,
        wrong=(),
    )


def _is_down(expected: Expected, drives: list[tuple[int, float]]) -> bool:
    return all(abs(driven) <= expected.down_n for _, driven in drives)


def _shortcomings(rig: Rig, expected: Expected, outcome: Outcome, drives: list[tuple[int, float]]) -> list[str]:
    """Return what is not as expected."""
    wrong = []
    came = " + ".join(expected.causes) or ("no clock" if expected.stopped else STATES[expected.state])
    if outcome.came != came:
        wrong.append(f"{outcome.came}, not {came}")
    if expected.within is not None and (outcome.clocks is None or outcome.clocks > expected.within):
        wrong.append(f"the drive is not down within {expected.within} clocks")
    if expected.within is not None and expected.state != ARMED and not expected.stopped:
        most = expected.pins_within
        if most is None:
            most = expected.within + rig.stage.pins_latency
        if rig.last_asked > rig.began + most:
            wrong.append(f"a force at the pins {rig.last_asked - rig.began} clocks after the fault")
    if rig.see("shot"):
        wrong.append("both gates of a leg have been on together")
    if outcome.largest_n > expected.largest_n + SPEC.force_resolution_n:
        wrong.append(f"{outcome.largest_n:.3f} N is more than {expected.largest_n:.3f} N")
    if expected.steady and any(abs(driven - drives[0][1]) > TREMOR_N for _, driven in drives):
        wrong.append("the force is not as before")
    return wrong
