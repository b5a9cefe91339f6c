"""The board of several axes, spoken to over its line: words, states and pulses of each, at every clock of its pins."""

import cocotb
import pytest
from cocotb.triggers import ClockCycles, RisingEdge

from hardwall.hdl.axes.board import AxesBoard
from hardwall.model.axes.capture import SAMPLED
from hardwall.model.axes.registers import BANK
from hardwall.model.axis.capture import DONE, RECORD_REGISTERS, SOURCES, WAITING
from hardwall.model.axis.monitors import IDLE_EDGES
from hardwall.model.axis.register_file import EXCLUSIVE
from hardwall.model.axis.registers import CAPTURE
from hardwall.model.axis.supervisor import ARMED, CAUSES, DISARMED, REQUIRED, TRIPPED
from hardwall.model.board import clock_monitor
from hardwall.model.encoder.quadrature import latency
from hardwall.model.link.server import ABSENT, FAILURE, VALUE
from hardwall.testing import parameters, simulate
from oracles.axes_board import RECORDS, Host, Sample, Watched
from oracles.returning_clock import check_returns
from oracles.supervised import SYNCHRONISER
from stimuli import frames
from stimuli.lengths import WHOLE

BITS = {cause.name: 1 << bit for bit, cause in enumerate(CAUSES)}
PLACES = -3, 11
"""The counts that a host gives the axes of a board of two by a preload or a shift."""
TRIP, FALL = (1 << SOURCES.index(name) for name in ("trip", "fall"))
LOOKS = 10
GLITCH_CLOCKS = 1
STAMPED = latency(GLITCH_CLOCKS) - 1
"""Clocks from the one that begins with a change of a pin to the one that decodes it, which ends with its count."""


def make(axes: int) -> Watched:
    return Watched(axes)


async def drive(host: Host, axis: int, invert: int = 0, left: int = 0) -> None:
    """Put the handle of an axis deep into a stiff wall on a side of it, and arm it."""
    registers = host.registers
    await host.write(axis, supervisor_ramp=registers["supervisor_ramp"].high)
    await host.write(axis, drive_invert=invert)
    words = {word.name: word.reset for word in registers.words}
    words |= {"wall_position": registers["wall_position"].high if left else 1 + registers["wall_position"].low}
    words |= {"wall_stiffness": registers["wall_stiffness"].high, "wall_left": left}
    await host.write(axis, commit=1, **words)
    assert (await host.look(axis))["ready"]
    await host.write(axis, arm=1)
    assert (await host.look(axis))["state"] == ARMED


@cocotb.test()
async def every_axis_has_its_bank_and_its_state(dut):
    host = Host(dut, **parameters())
    registers, axes = host.registers, host.board.spec.axes
    await host.reset()
    # Who the device is, which there is once; and every word as after a reset.
    assert (await host.request(frames.read(0, 16)))[2 + 28 :] == axes.to_bytes(4, "big")
    for axis in range(axes):
        await host.request(frames.read(BANK * axis + registers["wall_stiffness"].address, 2))
        await host.request(frames.read(BANK * axis + 0xC0, 0x20))
        assert (await host.look(axis))["state"] == DISARMED
    # Words of each: in use only after a commit, and only in their axis.
    for axis in range(axes):
        await host.write(axis, wall_stiffness=3 + axis)
        for other in range(axes):
            await host.request(frames.read(BANK * other + registers["active_wall_stiffness"].address, 2))
        await host.write(axis, commit=1)
        for other in range(axes):
            await host.request(frames.read(BANK * other + registers["active_wall_stiffness"].address, 2))
    # What cannot be written: nothing of the frame is done.
    refusals = {
        frames.write(BANK + registers["heartbeat"].address, [0, 1]): ABSENT,
        frames.write(BANK - 2, [0] * 4): ABSENT,
        frames.write(BANK * axes + registers["arm"].address, [1]): ABSENT,
        frames.write(BANK + registers["encoder_invert"].address, [0, 2]): VALUE,
        frames.write(BANK + registers["wall_stiffness"].address, [0]): ABSENT,
        frames.write(BANK + registers["arm"].address, [1]): FAILURE,
        frames.read(BANK * axes, 2): ABSENT,
    }
    for refused, exception in refusals.items():
        assert (await host.request(refused))[1] == exception
    assert host.compared > 10_000
    assert host.pulses == [0] * axes


@cocotb.test(skip=not WHOLE)
async def one_axis_trips_while_the_other_drives_on(dut):
    host = Host(dut, **parameters())
    await host.reset()
    await host.write(0, heartbeat=1)
    await drive(host, 0)
    await drive(host, 1, invert=1)
    assert await host.pulsing(200) == [True, True]
    most = host.board.spec.force_limit_word
    assert [(await host.look(axis, "state"))["driven"] for axis in (0, 1)] == [-most] * 2
    # A limit of the force is that of its axis.
    await host.write(0, supervisor_force_limit=most // 2)
    assert [(await host.look(axis, "state"))["driven"] for axis in (0, 1)] == [-(most // 2), -most]
    await host.write(1, supervisor_force_limit=most // 2)
    assert (await host.look(1, "state"))["driven"] == -(most // 2)
    # A host that speaks of one axis does not move the other.
    for name in ("preload", "origin_shift"):
        assert (await host.request(frames.write(host.registers[name].address, [1])))[1] == FAILURE
    await host.write(1, supervisor_causes=REQUIRED | BITS["position_range"])
    await host.write(1, supervisor_position_low=1)
    status = await host.look(1)
    assert (status["state"], status["first"], status["driven"]) == (TRIPPED, BITS["position_range"], 0)
    assert (await host.look(0))["state"] == ARMED
    assert await host.pulsing(200) == [True, False]
    assert (await host.request(frames.write(BANK + host.registers["arm"].address, [1])))[1] == FAILURE
    # Others than were read cannot be acknowledged.
    await host.write(1, supervisor_position_low=host.registers["supervisor_position_low"].low)
    for causes, state in ((status["latched"] ^ BITS["runaway"], TRIPPED), (status["latched"], DISARMED)):
        await host.write(1, acknowledged=causes)
        await host.write(1, acknowledge=1)
        assert (await host.look(1))["state"] == state
    assert await host.pulsing(200) == [True, False]
    await host.write(1, arm=1)
    assert await host.pulsing(200) == [True, True]
    await host.write(0, disarm=1)
    assert await host.pulsing(200) == [False, True]
    assert ((await host.look(0))["state"], (await host.look(1))["state"]) == (DISARMED, ARMED)
    await host.write(1, disarm=1)
    assert await host.pulsing(200) == [False, False]
    assert host.compared > 10_000


async def check_status(host: Host, axis: int, **shown: int) -> None:
    """Check that an axis shows that, the stamps of its edges, and zeros beside it.

    When a sample was, no host on a line can tell.
    """
    status = await host.look(axis)
    stamps = {name: clock - host.begun + STAMPED for name, clock in host.turned[axis].items()}
    wanted = dict.fromkeys(status, 0) | {"live": 1} | stamps | shown
    unlike = {name: (status[name], word) for name, word in wanted.items() if status[name] != word}
    assert {name: pair for name, pair in unlike.items() if name not in ("stamp", "first_stamp")} == {}, f"axis {axis}"


async def prepare(host: Host, axis: int) -> None:
    """Give an axis a spring of a force LSB a count, which begins at the count 0, on a side of its own."""
    words = {word.name: word.reset for word in host.registers.words}
    stiffness = 1 << host.registers["wall_stiffness"].format.f
    words |= {"wall_stiffness": stiffness, "wall_left": axis, "encoder_glitch_clocks": GLITCH_CLOCKS}
    words |= {"preload_count": PLACES[axis]}
    await host.write(axis, commit=1, **words)
    await host.write(axis, supervisor_ramp=host.registers["supervisor_ramp"].high)
    await host.write(axis, supervisor_causes=REQUIRED | BITS["encoder_loss"])


@cocotb.test()
async def every_status_is_of_its_axis(dut):
    host = Host(dut, **parameters())
    await host.reset()
    # The largest watchdog is none of a range's outside.
    await host.write(0, heartbeat=1)
    await host.write(0, supervisor_watchdog=host.registers["supervisor_watchdog"].high)
    for axis in (0, 1):
        await prepare(host, axis)
    await host.turn(7, -5)
    ready = {"state": DISARMED, "ready": 1}
    await check_status(host, 0, count=7, wall_force=-7, drive=-7, **ready)
    await check_status(host, 1, count=-5, wall_force=5, drive=5, **ready)
    # What a host asks of one axis does not come to the other, whichever is first.
    await host.write(1, arm=1)
    await host.write(1, index_arm=1)
    await host.turn(9, -7, index=0b11)
    await check_status(host, 0, count=9, wall_force=-9, drive=-9, **ready)
    found = {"index_latched": 1, "index_count": -7}
    await check_status(host, 1, count=-7, wall_force=7, drive=7, driven=7, state=ARMED, **found)
    await host.write(0, index_arm=1)
    await check_status(host, 0, count=9, wall_force=-9, drive=-9, index_armed=1, **ready)
    await host.turn(6, -7, index=0b01)
    await host.write(0, commit=1, preload_count=PLACES[0] - 6)
    await host.write(0, origin_shift=1)
    await check_status(host, 1, count=-7, wall_force=7, drive=7, driven=7, state=ARMED, **found)
    found = {"index_count": PLACES[0]}
    await check_status(host, 0, count=PLACES[0], index_latched=1, referenced=1, **found, **ready)
    # Edges of both channels at once are counted until the counter is full, and forgotten when the host says so.
    await host.jump(130, 101)
    illegal = {"state": TRIPPED, "latched": BITS["encoder_illegal"], "first": BITS["encoder_illegal"]}
    await check_status(host, 0, count=PLACES[0], flags=1, counts_0=1, illegal_count=255, **found, **illegal)
    await host.write(0, clear_flags=1)
    assert [(await host.look(axis))["illegal_count"] for axis in (0, 1)] == [0, 202]
    await host.write(1, clear_flags=1)
    for axis in (0, 1):
        latched = (await host.look(axis))["latched"]
        assert latched & BITS["encoder_illegal"]
        await host.write(axis, acknowledged=latched)
        await host.write(axis, acknowledge=1)
        assert (await host.look(axis))["state"] == DISARMED
    await find_another_index(host)


async def find_another_index(host: Host) -> None:
    """Let both axes find an index where they have not been, and the host place the one it has not placed."""
    for axis, count in ((0, PLACES[0]), (1, -7)):
        await host.write(axis, index_arm=1)
        status = await host.look(axis, "count", "referenced")
        assert status.items() >= {"count": count, "index_armed": 1, "index_latched": 0, "referenced": 0}.items(), axis
    # That is 4 counts below the place of the one, and at the count 6 of the other.
    await host.turn(2, 6, index=0b11)
    await host.write(1, commit=1, preload_count=PLACES[1] - 6)
    await host.write(1, origin_shift=1)
    for axis, count in enumerate((PLACES[0] - 4, PLACES[1])):
        wanted = {"count": count, "index_count": count, "illegal_count": 0}
        wanted |= {"index_armed": 0, "index_latched": 1, "referenced": axis}
        assert (await host.look(axis, "count", "referenced")).items() >= wanted.items(), axis


@cocotb.test()
async def a_channel_without_edges_is_warned_of_in_its_axis(dut):
    host = Host(dut, **parameters())
    await host.reset()

    async def warned() -> list[int]:
        return [(await host.look(axis, *["a_channel_idle"] * 2))["a_channel_idle"] for axis in (0, 1)]

    assert await warned() == [0, 0]
    # Between the counts 0 and 1 there are edges of A alone, and from 0 to -1 there is one of B.
    for k in range(1, IDLE_EDGES):
        await host.turn(k % 2, 0)
    assert await warned() == [0, 0]
    await host.turn(0, 0)
    assert await warned() == [1, 0]
    for k in range(1, IDLE_EDGES):
        await host.turn(0, k % 2)
    assert await warned() == [1, 0]
    await host.turn(-1, 0)
    assert await warned() == [0, 1]


@cocotb.test()
async def the_stamp_of_a_status_is_the_clock_of_its_sample(dut):
    host = Host(dut, **parameters())
    await host.reset()
    begun, rota, stamps = host.begun, host.board.spec.clocks_per_sample, []
    for number in range(8):
        # All looks take as long, which is an even number of rotas.
        await host.edges(number % 2 * rota)
        asked = host.bench.clock_number() - begun
        stamps.append((await host.look(0, "stamp", "stamp"))["stamp"])
        assert asked <= stamps[-1] <= host.bench.clock_number() - begun
    # A rota apart, or several: odd numbers of them, and even ones.
    apart = [stamp - stamps[0] for stamp in stamps]
    assert not any(clocks % rota for clocks in apart)
    assert {clocks // rota % 2 for clocks in apart} == {0, 1}


async def start(host: Host, **words: int) -> None:
    """Begin a capture, with words of it."""
    for name, word in words.items():
        await host.write(0, **{f"capture_{name}": word})
    await host.write(0, capture_start=1)
    host.samples, host.server.file.capture = [[] for _ in range(host.board.spec.axes)], None
    # Nothing of it can be read yet.
    assert (await host.request(frames.read(CAPTURE, RECORD_REGISTERS)))[1] == FAILURE


async def until(host: Host, state: int) -> dict[str, int]:
    """Look until the capture memory is in a state, for as long as that takes at most; return what it shows."""
    for _ in range(LOOKS):
        status = await host.look(0, "capture_state", "capture_stamp")
        if status["capture_state"] == state:
            return status
    raise AssertionError(f"the capture memory never comes to {state}: {status}")


async def captured(host: Host, axis: int, decimation: int) -> tuple[list[Sample], dict[str, int]]:
    """Wait for the end of a capture, and read it: all of it must be samples of an axis as they were.

    Returns:
        The samples of the axis, from the first to the last that has a record, and the state of the memory.
    """
    size, status = RECORD_REGISTERS * RECORDS, await until(host, DONE)
    # It is that of the device, whichever bank it is read in.
    assert await host.look(1, "capture_state", "capture_stamp") == status
    host.server.file.capture = [0] * size
    data = (await host.request(frames.read(CAPTURE, RECORD_REGISTERS), shows=True))[2:]
    stamps = [sample.registers()[-1] for sample in host.samples[axis]]
    first = stamps.index(int.from_bytes(data[-2:], "big"))
    samples = host.samples[axis][first::decimation][:RECORDS]
    host.server.file.capture = [cell for sample in samples for cell in sample.registers()]
    # From now on every answer is compared with the twin's, which has these.
    for begin in range(0, size, size // 2):
        await host.request(frames.read(CAPTURE + begin, size // 2))
    behind = samples[-1].number
    return [sample for sample in host.samples[axis][first:] if sample.number <= behind], status


@cocotb.test()
async def a_capture_has_the_samples_of_the_axis_that_was_chosen(dut):
    host = Host(dut, **parameters())
    registers = host.registers
    await host.reset()
    for refused, exception in {
        frames.write(BANK + registers["capture_axis"].address, [0, 0]): ABSENT,
        frames.write(BANK + registers["capture_start"].address, [1]): ABSENT,
        frames.write(registers["capture_axis"].address, [0, 2]): VALUE,
        frames.read(CAPTURE + RECORD_REGISTERS * RECORDS, 1): ABSENT,
    }.items():
        assert (await host.request(refused))[1] == exception
    await host.write(0, heartbeat=1)
    await host.write(0, supervisor_watchdog=registers["supervisor_watchdog"].high)
    for axis in (0, 1):
        await prepare(host, axis)
        await host.write(axis, arm=1)
    # By hand, with both handles at rest.
    await start(host, axis=0, sources=0, before=1, decimation=1)
    await until(host, WAITING)
    await host.write(0, capture_trigger=1)
    samples, status = await captured(host, 0, 1)
    assert (status["capture_place"], {sample.count for sample in samples}) == (1, {0})
    # The handle of axis 1 falls below its level, while that of axis 0 goes the other way, and past its own.
    words = {"axis": 1, "sources": FALL, "before": 5, "decimation": 3, "level": -4}
    await start(host, **words)
    # Another axis is taken by another start alone.
    await host.write(0, capture_axis=0)
    await host.turn(8, -9)
    samples, status = await captured(host, 1, words["decimation"])
    counts = [sample.count for sample in samples]
    assert len(set(counts)) > 5
    fell = next(k for k, count in enumerate(counts) if count < words["level"] <= counts[k - 1])
    assert status["capture_stamp"] == samples[fell].number + SAMPLED
    assert status["capture_place"] == words["before"] == -(-fell // words["decimation"])
    assert len({sample.driven for sample in samples}) > 3
    # Axis 0 trips while axis 1 drives on.
    await start(host, sources=TRIP, before=RECORDS - 1, decimation=1)
    await until(host, WAITING)
    await host.write(0, supervisor_causes=REQUIRED | BITS["position_range"])
    await host.turn(9, -6)
    await host.write(0, supervisor_position_high=7)
    samples, status = await captured(host, 0, 1)
    assert [sample.state for sample in samples] == [ARMED] * (RECORDS - 1) + [TRIPPED]
    assert [sample.driven != 0 for sample in samples] == [True] * (RECORDS - 1) + [False]
    assert (await host.look(1))["state"] == ARMED


@cocotb.test(skip=not WHOLE)
async def a_loop_stops_every_axis(dut):
    host = Host(dut, **parameters())
    await host.reset()
    await host.write(0, heartbeat=1)
    for axis in (0, 1):
        await host.write(axis, supervisor_causes=REQUIRED | BITS["external_fault"])
        # Pushed to the other side than elsewhere, and the other axis inverted.
        await drive(host, axis, invert=1 - axis, left=1)
    for loop in ("external_fault", "drive_enable", "emergency_stop"):
        assert await host.pulsing(200) == [True, True]
        host.change(**{loop: 0})
        await host.edges(2 + host.board.safe_latency)
        assert await host.pulsing(200) == [False, False]
        host.change(**{loop: 1})
        assert await host.pulsing(200) == [False, False]
        for axis in (0, 1):
            if latched := (await host.look(axis))["latched"]:
                assert latched == BITS[loop]
                await host.write(axis, acknowledged=latched)
                await host.write(axis, acknowledge=1)
            await host.look(axis, "state", "ready")
            await host.write(axis, arm=1)
    assert host.compared > 10_000


@cocotb.test(skip=not WHOLE)
async def one_frame_arms_commits_preloads_or_shifts_the_origin(dut):
    """Two of these in a frame are refused, and neither is done; the other axis is asked for nothing."""
    host = Host(dut, **parameters())
    await host.reset()
    await host.write(0, heartbeat=1)
    await host.turn(5, 3)
    place = {name: host.registers[name].address for name in EXCLUSIVE}
    for axis in (0, 1):
        await host.write(axis, commit=1, preload_count=9)
        for these in frames.NOT_TOGETHER:
            assert (await host.look(axis))["ready"] == 1
            places = [place[name] for name in these]
            values = [int(at in places) for at in range(min(places), max(places) + 1)]
            # Behind the shift lie pulses of the capture memory, which only the bank of axis 0 has.
            refusal = ABSENT if axis and "origin_shift" in these else FAILURE
            assert (await host.request(frames.write(BANK * axis + min(places), values)))[1] == refusal
            status = await host.look(axis)
            assert (status["state"], status["count"]) == (DISARMED, (5, 3)[axis])
    for axis, count in ((0, 14), (1, 12)):
        await host.write(axis, origin_shift=1)
        assert (await host.look(axis))["count"] == count


@cocotb.test()
async def a_clock_that_stops_makes_every_output_low_and_all_come_back_disarmed(dut):
    host = Host(dut, **parameters())
    await host.reset()
    await host.write(0, heartbeat=1)
    for axis in (0, 1):
        await host.write(axis, index_arm=1)
    await host.turn(3, 3, index=0b11)
    for axis in (0, 1):
        await host.write(axis, origin_shift=1)
        assert (await host.look(axis))["referenced"] == 1
    await host.turn(0, 0)
    for axis in (0, 1):
        await drive(host, axis)
    outputs, both = [dut.drive_pdm, dut.alive, dut.outputs_enable], 0b11
    while [int(output.value) for output in outputs] != [both, both, 1]:
        await host.edges(1)
    host.leave()
    host.bench.clock.stop()
    # The clocks of an oscillator of 1 Hz are its seconds; one more, for an edge sees what was before it.
    await ClockCycles(dut.oscillator, 1 + int(clock_monitor.Design(host.board.spec.clock_hz).stop_latency_s(1.0)))
    assert not any(int(output.value) for output in outputs)
    host.bench.clock.start()
    await RisingEdge(dut.outputs_enable)
    assert not any(int(output.value) for output in outputs[:2])
    # Two turns of the axes, after which all that is shown of them is of the clock that came back.
    await ClockCycles(dut.clk, 2 * host.board.spec.clocks_per_sample)
    assert not any(int(output.value) for output in outputs[:2])
    for axis in (0, 1):
        status = await host.look(axis)
        assert [status[name] for name in ("state", "index_latched", "referenced")] == [DISARMED, 0, 0]
    host.bench.drive(rst=1)
    await ClockCycles(dut.clk, 2 * SYNCHRONISER)
    assert not int(dut.outputs_enable.value)


@cocotb.test()
async def a_clock_that_comes_back_is_believed_after_a_level_of_its_beat(dut):
    host = Host(dut, **parameters())
    await host.reset()
    await check_returns(host)


def test_rtl():
    simulate(__file__, make, axes=2)


def test_wrong_parameters_are_refused():
    with pytest.raises(TypeError, match=r"^spec must be an AxesSpec, not 3$"):
        AxesBoard(3)
    with pytest.raises(ValueError, match=r"baud must be 115200 to 3000000, not 9600$"):
        AxesBoard(Watched(1).board.spec, 9600)
