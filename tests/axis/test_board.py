"""The board top: pins, registers and pulses against the models of link and supervised axis, clock for clock."""

import cocotb
import pytest
from cocotb.triggers import ClockCycles, FallingEdge, RisingEdge, Timer

from hardwall.hdl.axis.board import Board
from hardwall.hdl.axis.supervised import LOOPS
from hardwall.hdl.link.axi_link import AxiLink
from hardwall.model.axis.capture import DONE, RECORD_REGISTERS, SOURCES, TRIGGERED, WAITING
from hardwall.model.axis.register_file import EXCLUSIVE
from hardwall.model.axis.registers import CAPTURE, RegisterMap
from hardwall.model.axis.supervisor import ALL, ARMED, CAUSES, DISARMED, REQUIRED, TRIPPED, names
from hardwall.model.board import clock_monitor
from hardwall.model.link.server import FAILURE
from hardwall.testing import SAMPLES, parameters, simulate
from oracles.board import RECORDS, make
from oracles.board_host import Host
from oracles.returning_clock import check_returns
from oracles.supervised import SYNCHRONISER
from stimuli import frames
from stimuli.lengths import REACHING, WHOLE, some_of
from stimuli.restless import Restless
from stimuli.specs import spec

CLOCKS, LONGEST = 3 * SAMPLES // 10, 3 * max(SAMPLES, REACHING)
"""Clocks of the campaign; and the most of them, for the cases that are still not reached."""
SHOWN = "stamp", "capture_stamp"
"""The first and the last status that a host of a capture looks at."""
LOOKS = ("drive", "capture_stamp"), ("index_armed", "first")
"""The first and the last status that a random host looks at: all of them, or those that it needs."""


def random_words(host: Host) -> dict[str, int]:
    """Return committed words of every size, with a wall near the handle."""
    random, axis = host.random, host.twin.spec
    half = 1 << (axis.count_width - 1)
    count = host.twin.decoder.count
    words = {}
    for register in host.registers.words:
        size = 2.0 ** -random.integers(0, register.format.width)
        words[register.name] = max(int((register.high + 1) * random.random() * size), register.low)
    left, near = int(random.integers(0, 2)), 2.0 ** -random.integers(1, axis.count_width)
    depth = int(random.integers(0, half) * near)
    place = min(max(count + (depth if left else -depth), -half), half - 1)
    words |= {"encoder_glitch_clocks": int(random.choice((0, 1, 2))), "preload_count": count}
    # The other direction disarms.
    inverted = host.server.file.active["encoder_invert"] ^ int(random.random() < 0.1)
    return words | {"wall_left": left, "wall_position": place, "encoder_invert": inverted}


async def random_live_word(host: Host) -> None:
    """Write one of the live words."""
    random, most = host.random, host.twin.spec.force_limit_word
    words = {
        "supervisor_force_limit": int(random.choice((0, 1, most // 2, most))),
        "supervisor_causes": int(random.choice((REQUIRED, ALL, 0), p=(0.8, 0.1, 0.1))),
        "drive_invert": int(random.integers(0, 2)),
    }
    name = str(random.choice(list(words)))
    await host.write(**{name: words[name]})


async def random_capture(host: Host) -> None:
    """Begin a capture that a level near the handle triggers, or anything else."""
    random, count = host.random, host.twin.decoder.count
    level = host.registers["capture_level"]
    await host.write(
        capture_sources=int(random.integers(0, 16)),
        capture_level=min(max(count + int(random.integers(-2, 3)), level.low), level.high),
        capture_before=int(random.integers(0, RECORDS)),
        capture_decimation=1,
    )
    await host.write(capture_start=1)


def lacks(host: Host, seen: list[dict[str, int]]) -> list[str]:
    """Return the cases that a campaign has not reached yet."""
    cases = {"states": {DISARMED, ARMED, TRIPPED} == {row["state"] for row in seen}}
    # Other tests, here and of the stages, have pulses, an index and captures that are sure to come.
    if WHOLE:
        cases |= {
            "pulses": {(pulse, sign) for pulse in (0, 1) for sign in (0, 1)} == set(host.pulses),
            "index": {0, 1} == {row["index_latched"] for row in seen},
            "captures": {WAITING, DONE} <= {row.get("capture_state") for row in seen},
        }
    return [name for name, reached in cases.items() if not reached]


@cocotb.test()
async def a_random_host_at_a_random_handle(dut):
    host = Host(dut, **parameters())
    await host.reset()
    random, seen = host.random, []
    ramp, stiffness = host.registers["supervisor_ramp"], host.registers["wall_stiffness"]
    await host.write(supervisor_ramp=ramp.high, supervisor_watchdog=2000, supervisor_causes=REQUIRED)
    while host.twin.clocks < CLOCKS or (lacks(host, seen) and host.twin.clocks < LONGEST):
        host.rate = float(random.choice((0.0, 0.005, 0.02)))
        host.illegal_rate = float(random.choice((0.0, 0.05), p=(0.8, 0.2)))
        # A loop that is open lets nothing else happen: it soon closes.
        host.open_rate = float(random.choice((0.0, 1e-3), p=(0.9, 0.1)))
        if random.random() < 0.9:
            host.change(drive_enable=1, external_fault=1, emergency_stop=1)
        # A look takes longer than an act; what is inside is held to the twin at every clock.
        look = random.random()
        status = await host.look(*LOOKS[look > 0.2]) if look < 0.4 else host.shown()
        seen.append(status)
        if status["state"] == TRIPPED:
            await host.write(acknowledged=status["latched"])
            await host.write(acknowledge=1, clear_flags=1)
        elif status["state"] == DISARMED:
            await host.write(heartbeat=int(random.integers(0, 1 << 16)))
            await host.write(arm=1)
        # What was armed just now mostly gets a wall, and pushes.
        act = random.random() * (0.55 if status["state"] == DISARMED else 1)
        if act < 0.5:
            words = random_words(host) | ({"wall_stiffness": stiffness.high} if random.random() < 0.7 else {})
            moves = str(random.choice(("", "preload", "origin_shift"), p=(0.8, 0.1, 0.1)))
            # An origin that is shifted comes to the handle.
            words["preload_count"] *= 1 - 2 * (moves == "origin_shift")
            pulses = {"index_arm": int(random.random() < 0.8), **({moves: 1} if moves else {})}
            await host.write(commit=1, **pulses, **words)
        elif act < 0.8:
            await random_live_word(host)
        elif act < 0.9:
            await random_capture(host)
            seen.append(await host.look(*LOOKS[0]))
        else:
            await host.write(disarm=1)
    assert lacks(host, seen) == []
    if WHOLE:
        await find_the_index_twice(host, seen)
        assert {row["referenced"] for row in seen} == {0, 1}
    # An axis without a heartbeat, or one that is armed, is not armed.
    for _ in range(2):
        await host.write(arm=1)
    assert host.refused
    assert set(host.refused) == {FAILURE}


async def find_the_index_twice(host: Host, seen: list[dict[str, int]]) -> None:
    """The index that is found becomes a reference only by a shift of the origin, and not after the next index_arm."""
    host.rate, host.illegal_rate = 0.02, 0.0
    # A count that has wrapped gives no index.
    await host.write(disarm=1)
    await host.write(clear_flags=1)
    await host.write(preload=1, commit=1, preload_count=0)
    for _ in range(2):
        await host.write(index_arm=1)
        seen.append(await host.look(*LOOKS[1]))
        while not seen[-1]["referenced"]:
            # Edges that the filter does not pass may take the index away.
            if seen[-1]["index_latched"]:
                await host.write(origin_shift=1)
            elif not seen[-1]["index_armed"]:
                await host.write(index_arm=1)
            seen.append(await host.look(*LOOKS[1]))


@cocotb.test()
async def an_open_loop_stops_the_pulses(dut):
    host = Host(dut, **parameters())
    await host.reset()
    most, words = host.twin.spec.force_limit_word, {"wall_stiffness": host.registers["wall_stiffness"].high}
    await host.write(supervisor_ramp=host.registers["supervisor_ramp"].high)
    await host.write(commit=1, wall_position=1 + host.registers["wall_position"].low, **words)
    for loop, limit in zip(LOOPS, (most, 2 * most // 3 | 1, most // 3 | 1), strict=True):
        await host.write(supervisor_force_limit=limit)
        await host.arm()
        await host.edges(host.settling)
        assert host.shown()["driven"] == -limit
        while not int(dut.drive_pdm.value):
            await host.edges(1)
        # The pin falls between two edges, and the pulse with it; a fault of the amplifier comes through the supervisor.
        host.change(**{loop: 0})
        if loop == "external_fault":
            await host.edges(SYNCHRONISER + host.board.safe_latency)
        await Timer(1, "ns")
        assert int(dut.drive_pdm.value) == 0
        host.pulses.clear()
        await host.edges(host.settling)
        host.change(**{loop: 1})
        await host.edges(host.settling)
        assert not any(pulse for pulse, _ in host.pulses)


@cocotb.test()
async def a_capture_around_a_trip_is_read_by_the_line(dut):
    host = Host(dut, **parameters())
    await host.reset()
    host.rate = 0.02
    most, words = host.twin.spec.force_limit_word, {"wall_stiffness": host.registers["wall_stiffness"].high}
    await host.write(supervisor_ramp=host.registers["supervisor_ramp"].high)
    await host.write(commit=1, wall_position=host.registers["wall_position"].low // 2, **words)
    await host.arm()
    await host.edges(host.settling)
    await host.write(capture_sources=2, capture_level=0, capture_before=RECORDS // 2, capture_decimation=2)
    assert await host.request(frames.read(CAPTURE, 8)) == bytes([0x83, FAILURE])
    await host.write(capture_start=1)
    while (await host.look(*SHOWN))["capture_state"] != WAITING:
        pass
    assert await host.request(frames.read(CAPTURE, 8)) == bytes([0x83, FAILURE])
    host.change(external_fault=0)
    while (status := await host.look(*SHOWN))["capture_state"] != DONE:
        assert status["capture_state"] in (WAITING, TRIGGERED)
    registers = []
    while len(registers) < RECORD_REGISTERS * RECORDS:
        answer = await host.request(frames.read(CAPTURE + len(registers), 64))
        registers += [int.from_bytes(answer[k : k + 2], "big") for k in range(2, len(answer), 2)]
    records = [host.twin.captures.record(each) for each in zip(*[iter(registers)] * RECORD_REGISTERS, strict=True)]
    # What the first half shows is the wall at its largest force, and what is behind it nothing.
    place = status["capture_place"]
    assert place == RECORDS // 2
    assert {(record.driven, record.flags & 7) for record in records[:place]} == {(-most, ARMED | 4)}
    assert {(record.driven, record.flags & 7) for record in records[place + 1 :]} == {(0, TRIPPED | 4)}


@cocotb.test(skip=not WHOLE)
async def a_capture_begins_with_the_count_that_passes_its_level(dut):
    host = Host(dut, **parameters())
    await host.reset()
    await host.write(capture_sources=1 << SOURCES.index("fall"), capture_level=-1, capture_before=RECORDS // 4)
    await host.write(capture_start=1)
    # A count that is the level has not passed it.
    for states in ({WAITING}, {WAITING}, {TRIGGERED, DONE}):
        await host.edges(host.settling)
        assert (status := await host.look(*SHOWN))["capture_state"] in states
        await host.turn(-1)
    assert status["capture_place"] == RECORDS // 4


@cocotb.test(skip=not WHOLE)
async def a_capture_begins_with_the_force_of_the_wall(dut):
    host = Host(dut, **parameters())
    await host.reset()
    contact, others = (sum(1 << SOURCES.index(name) for name in names) for names in (SOURCES[:1], SOURCES[1:]))
    high, before = host.registers["wall_stiffness"].high, {"capture_before": 1, "capture_decimation": 1}
    inside = {"wall_position": host.registers["wall_position"].low // 2}
    for sources, states in ((contact, {TRIGGERED, DONE}), (others, {WAITING})):
        await host.write(commit=1, wall_stiffness=0, **inside)
        await host.write(capture_sources=sources, capture_level=host.registers["capture_level"].low, **before)
        await host.write(capture_start=1)
        while (await host.look(*SHOWN))["capture_state"] != WAITING:
            pass
        await host.write(commit=1, wall_stiffness=high, **inside)
        await host.edges(host.settling)
        assert (await host.look(*SHOWN))["capture_state"] in states


async def actuations_until_answer(host: Host, pulse: str) -> int:
    """Return the changed drives between a pulse of the link and the beginning of its answer."""
    count, clock = 0, host.dut.clk
    while not host.component.asked.unpack(int(host.dut.asking.value))[pulse]:
        await RisingEdge(clock)
    while int(host.dut.uart_tx.value):
        count += host.shown()["actuated"]
        await RisingEdge(clock)
    return count


@cocotb.test()
async def an_answer_waits_for_the_drive_of_what_it_wrote(dut):
    host = Host(dut, **parameters())
    await host.reset()
    for pulse in ("commit", "preload", "origin_shift"):
        waited = cocotb.start_soon(actuations_until_answer(host, pulse))
        await host.write(**{pulse: 1})
        assert await waited >= 3


@cocotb.test(skip=not WHOLE)
async def what_trips_first_is_shown(dut):
    host = Host(dut, **parameters())
    await host.reset()
    registers, causes = host.registers, [cause.name for cause in CAUSES]
    await host.write(supervisor_ramp=registers["supervisor_ramp"].high, supervisor_watchdog=2000)
    await host.write(commit=1, wall_position=1 + registers["wall_position"].low, wall_stiffness=0xFFFF)
    # The handle is driven at the largest force, and moves against it; and then it is too fast for the host.
    for cause, limits in (("runaway", (0xFFFF, 0)), ("velocity_limit", (0, 0xFFFF))):
        await host.write(**dict(zip(("supervisor_velocity_limit", "supervisor_runaway"), limits, strict=True)))
        await host.edges(host.settling)
        await host.arm()
        await host.edges(host.settling)
        await host.turn(4)
        status = await host.look("stamp", "first_stamp")
        assert (status["state"], status["first"]) == (TRIPPED, 1 << causes.index(cause))


@cocotb.test(skip=not WHOLE)
async def the_limits_of_the_position_are_those_of_the_host(dut):
    host = Host(dut, **parameters())
    await host.reset()
    half = 1 << host.twin.spec.count_width - 1
    low, high = -(2 * half // 3) - 1, 2 * half // 3
    await host.write(supervisor_position_low=low, supervisor_position_high=high)
    outside, wraps = ["position_range"], ["position_range", "position_wrap"]
    for place, causes in {low: [], high: [], low - 1: outside, high + 1: outside, -half: wraps}.items():
        await host.write(preload=1, commit=1, preload_count=place)
        await host.arm()
        await host.edges(host.settling)
        assert names(host.shown()["first"]) == causes, place
        if not causes:
            # A host of an axis that is ARMED may not move its count.
            for name in ("preload", "origin_shift"):
                assert (await host.write(**{name: 1}))[1] == FAILURE
            await host.write(disarm=1)
    await host.look("stamp", "counts_0")


@cocotb.test()
async def an_index_that_is_not_where_it_was_trips(dut):
    host = Host(dut, **parameters())
    await host.reset()
    tolerance, cause = 6, next(1 << bit for bit, cause in enumerate(CAUSES) if cause.name == "index_spacing")
    await host.write(supervisor_turn=host.registers["supervisor_turn"].high, supervisor_index_tolerance=tolerance)
    await host.write(supervisor_causes=REQUIRED | cause)
    for counts, trips in ((0, False), (tolerance, False), (tolerance + 1, True)):
        await host.turn(counts)
        await over_the_index(host)
        assert bool(host.shown()["latched"] & cause) == trips


async def over_the_index(host: Host) -> None:
    """Turn the handle up by a count, where Z rises, and by another, which finds the index, and back below Z."""
    await host.turn(1)
    for level in (1, 0):
        host.change(encoder_z=level)
        await host.edges(host.settling)
        await host.turn(level)
    await host.turn(-2)


@cocotb.test()
async def one_frame_arms_commits_preloads_or_shifts_the_origin(dut):
    """Two of these in a frame are refused, and neither is done; the next frame finds a drive of the new place."""
    host = Host(dut, **parameters())
    await host.reset()
    await host.write(commit=1, preload_count=9)
    await host.write(heartbeat=1)
    for these in frames.NOT_TOGETHER:
        assert host.shown()["ready"] == 1
        assert (await host.write(**dict.fromkeys(these, 1)))[1] == FAILURE
        assert (host.shown()["state"], host.shown()["count"]) == (DISARMED, 0)
    await host.write(origin_shift=1)
    assert host.shown()["count"] == 9


@cocotb.test()
async def a_host_is_not_answered_before_the_drive_is_of_the_new_place_and_the_new_wall(dut):
    host = Host(dut, **parameters())
    await host.reset()
    half = 1 << host.twin.spec.count_width - 1
    words = {"wall_stiffness": host.registers["wall_stiffness"].high, "wall_position": 0, "wall_left": 0}
    await host.write(commit=1, **words, preload_count=half // 2)
    for name in some_of(("preload", "origin_shift"), 1):
        await host.write(preload=1, commit=1, preload_count=half // 2)
        assert host.shown()["drive"] < 0
        await host.write(commit=1, preload_count=-half // 2 if name == "preload" else -half)
        asking = cocotb.start_soon(host.write(**{name: 1}))
        await FallingEdge(dut.uart_tx)
        assert host.shown()["drive"] == 0, name
        await asking
    await host.write(preload=1, commit=1, preload_count=half // 2)
    assert host.shown()["drive"] < 0
    asking = cocotb.start_soon(host.write(commit=1, wall_position=half - 1))
    await FallingEdge(dut.uart_tx)
    assert host.shown()["drive"] == 0
    await asking


@cocotb.test()
async def a_scale_that_has_slipped_is_no_reference(dut):
    """What is asked for by a host that wants a reference is refused, until the axis is homed again."""
    host = Host(dut, **parameters())
    await host.reset()
    glitch = host.registers["encoder_glitch_clocks"].high
    await host.write(supervisor_reference=1)

    async def twice() -> None:
        host.phase += 2
        host.change(**host._channels())

    async def too_fast() -> None:
        # A level that the filter rejects, with an edge of the other channel in it.
        for change in ({"encoder_a": 1}, {"encoder_b": 1}, {"encoder_a": 0}, {"encoder_b": 0}):
            host.change(**{name: host.pins[name] ^ 1 for name in change})
            await host.edges(2)

    async def inverted() -> None:
        await host.write(commit=1, encoder_glitch_clocks=glitch, encoder_invert=1)

    ways = [(inverted, ""), (twice, "encoder_illegal"), (too_fast, "encoder_overspeed")]
    for slips, cause in some_of(ways, 0):
        await host.write(commit=1, encoder_glitch_clocks=glitch, encoder_invert=0)
        await host.write(index_arm=1)
        await over_the_index(host)
        await host.write(origin_shift=1)
        await host.write(heartbeat=host.shown()["live"] + int(host.random.integers(1, 1000)))
        assert (host.shown()["referenced"], host.shown()["ready"]) == (1, 1)
        await slips()
        await host.edges(40 + host.settling)
        assert (host.shown()["referenced"], host.shown()["index_latched"]) == (0, 0)
        shown = host.shown()
        assert [name for name in names(shown["latched"]) if name.startswith("encoder")] == [cause] * bool(cause)
        # A flag stands until the clock behind its clear.
        await host.write(clear_flags=1)
        await host.arm()
        assert host.shown()["state"] == DISARMED
        # Nor does a preload, or a shift by the index that was, make it one.
        for name in ("preload", "origin_shift"):
            await host.write(**{name: 1})
            await host.arm()
            assert (host.shown()["state"], host.shown()["referenced"]) == (DISARMED, 0)


@cocotb.test()
async def every_word_reaches_the_axis(dut):
    host = Host(dut, **parameters())
    await host.reset()
    registers = host.registers
    pulses = [pulse.name for pulse in registers.pulses if pulse.name not in {*EXCLUSIVE} - {"commit"}]
    restless = {word.name: Restless(word, host.random) for word in (*registers.words, *registers.live)}
    for moves in ("preload", "origin_shift") * (2 if WHOLE else 1):
        drawn = {name: values.next() for name, values in restless.items()}
        await host.write(**{word.name: drawn[word.name] for word in registers.live})
        words = {word.name: drawn[word.name] for word in registers.words}
        await host.write(**dict.fromkeys((*pulses, moves), 1), **words)
    assert not host.refused


@cocotb.test()
async def a_clock_that_stops_makes_the_outputs_low_and_comes_back_disarmed(dut):
    host = Host(dut, **parameters())
    await host.reset()
    stiffness, position = host.registers["wall_stiffness"], host.registers["wall_position"]
    await host.write(supervisor_ramp=host.registers["supervisor_ramp"].high)
    await host.write(commit=1, wall_position=1 + position.low, wall_stiffness=stiffness.high)
    await host.write(index_arm=1)
    await over_the_index(host)
    await host.write(origin_shift=1)
    await host.arm()
    assert (host.shown()["referenced"], host.shown()["index_latched"]) == (1, 1)
    outputs = [dut.drive_pdm, dut.alive, dut.outputs_enable]
    while not all(int(output.value) for output in outputs):
        await host.edges(1)
    host.leave()
    host.bench.clock.stop()
    # The clocks of an oscillator of 1 Hz are its seconds; one more, for an edge sees what was before it.
    await ClockCycles(dut.oscillator, 1 + int(clock_monitor.Design(host.twin.spec.clock_hz).stop_latency_s(1.0)))
    assert not any(int(output.value) for output in outputs)
    assert host.shown()["state"] == ARMED
    host.bench.clock.start()
    await RisingEdge(dut.outputs_enable)
    assert (host.shown()["state"], host.shown()["driven"]) == (DISARMED, 0)
    # Edges may have been missed.
    assert (host.shown()["referenced"], host.shown()["index_latched"]) == (0, 0)
    assert not any(int(output.value) for output in outputs[:2])


@cocotb.test()
async def a_clock_that_comes_back_is_believed_after_a_level_of_its_beat(dut):
    host = Host(dut, **parameters())
    await host.reset()
    await check_returns(host)


# A second axis takes as long again: the long runs, of more samples, have it.
AXES = [("paper", "levant"), ("narrow", "levant-adaptive")][: 1 + (SAMPLES > 100_000)]


@pytest.mark.parametrize(("name", "estimator"), AXES)
def test_rtl(name, estimator):
    simulate(__file__, make, name=name, estimator=estimator)


def test_wrong_parameters_are_refused():
    with pytest.raises(TypeError, match=r"not 3$"):
        Board(3)
    with pytest.raises(ValueError, match=r"^link must have the registers \w{16}, not \w{16}$"):
        Board(spec("mhz"), AxiLink(RegisterMap(spec("paper"))))
