"""The board top: pins, frames and pulses against the models of decoder and axis, clock for clock."""

import math

import cocotb
import pytest
from cocotb.triggers import Timer

from hardwall.hdl.board import PULSES, TELEMETRY, Board
from hardwall.hdl.frame import BYTE
from hardwall.testing import SAMPLES, parameters, simulate
from oracles.board import SYNCHRONISER, Host, make


def random_frame(host: Host) -> dict[str, int]:
    """Return a frame that mostly commits, with words of every size and a wall near the handle."""
    random, axis = host.random, host.twin.spec
    half = 1 << (axis.count_width - 1)

    def near(count):
        return int((count + random.integers(-half, half) * 2.0 ** -random.integers(0, 20) + half) % (2 * half)) - half

    count = host.twin.decoder.count
    frame = {name: int(random.random() < p) for name, p in zip(PULSES, (0.9, 0.7, 0.2, 0.5), strict=True)}
    frame["preload_count"] = near(half if random.random() < 0.5 else 0)
    for word in axis.design.words:
        frame[word.name] = int((word.format.max + 1) * random.random() * 2.0 ** -random.integers(0, word.format.width))
    frame["encoder_glitch_clocks"] = int(random.choice((0, 1, 2, 15)))
    frame["wall_position"] = near(frame["preload_count"] if frame["preload"] else count)
    frame["output_force_limit"] |= 1 << (axis.force.width - 3)
    return frame


@cocotb.test()
async def random_frames_reach_the_axis_and_telemetry_comes_back(dut):
    host = Host(dut, **parameters())
    await host.reset()
    read = []
    # Fewer frames do not reach every case.
    while host.twin.clocks < max(2 * SAMPLES, 200_000):
        host.rate = float(host.random.choice((0.0, 0.02, 0.3, 1.0), p=(0.1, 0.4, 0.4, 0.1)))
        host.illegal_rate = float(host.random.choice((0.0, 0.01)))
        answer, expected = await host.exchange(random_frame(host))
        assert answer == expected, {n: (v, expected[n]) for n, v in answer.items() if v != expected[n]}
        read.append(answer)
        # The shortest pause, exact to the edge: the register is free again when the words have been taken.
        await host.edges(host.twin.spec.clocks_per_sample + SYNCHRONISER + 1)
        if host.random.random() < 0.5:
            await host.edges(host.settling)
    # The campaign must reach every case.
    assert len({row["drive"] for row in read}) > 3
    assert {bool(row["illegal_count"]) for row in read} == {False, True}
    assert {row["index_latched"] for row in read} == {0, 1}
    assert any(row["drive"] > 0 for row in read)
    assert any(row["drive"] < 0 for row in read)
    assert not all(row["flags"] & 3 for row in read)


@cocotb.test()
async def anything_but_a_whole_frame_only_reads(dut):
    host = Host(dut, **parameters())
    await host.reset()
    host.rate = 0.02
    length = host.board.frame_bits
    wraps = 1 << (length + 1).bit_length()
    for bits in (0, 1, length - 1, length + 1, 2 * length, wraps + length, length):
        await host.exchange(random_frame(host) | {"commit": 1, "preload": 1}, bits=bits)
        await host.edges(host.settling)
        answer, expected = await host.exchange({})
        assert answer == expected, f"after {bits} bits"
    # The last bit reveals a line that is stuck high.
    for stuck in (1, (1 << length) - 1):
        await host.exchange(random_frame(host) | {"commit": 1, "preload": 1}, heard=False, stuck=stuck)
        await host.edges(host.settling)
        answer, expected = await host.exchange({})
        assert answer == expected


@cocotb.test()
async def while_a_commit_waits_the_port_is_deaf(dut):
    host = Host(dut, **parameters())
    await host.reset()
    host.rate = 0.3
    for bits in (None, 0, None, 1, None):
        await host.edges(int(host.random.integers(0, host.twin.spec.clocks_per_sample)))
        await host.exchange(random_frame(host) | {"commit": 1, "preload": 1})
        await host.exchange(random_frame(host) | {"commit": 1, "preload": 1}, bits=bits, heard=False)
        await host.edges(host.settling)
        answer, expected = await host.exchange({})
        assert answer == expected


@cocotb.test()
async def the_density_of_pulses_is_the_drive(dut):
    host = Host(dut, **parameters())
    await host.reset()
    axis = host.twin.spec
    top, full = axis.force_limit_word, 2**host.board.drive_bits
    fields = host.board.commands.fields
    half = 1 << (fields["wall_position"].width - 1)
    stiffest = 2 ** fields["wall_stiffness"].width - 1
    # The force limit sets the magnitude, because the wall pushes with its largest force.
    drives = range(-top, top + 1) if top < 100 else (-top, full // math.pi // 1)
    for drive in map(int, drives):
        await host.commit(
            wall_stiffness=stiffest, wall_position=(half - 1) * (1 if drive > 0 else -1), wall_left=int(drive > 0),
            output_force_limit=abs(drive),
        )  # fmt: skip
        answer, _ = await host.exchange({})
        assert answer["drive"] == drive
        host.pulses.clear()
        await host.edges(full)
        assert sum(pulse for pulse, _ in host.pulses) == abs(drive)
        assert {sign for _, sign in host.pulses} == {int(drive < 0)}


@cocotb.test()
async def enable_low_is_no_drive(dut):
    host = Host(dut, **parameters())
    await host.reset()
    fields, top = host.board.commands.fields, host.twin.spec.force_limit_word
    largest = {
        "wall_stiffness": (1 << fields["wall_stiffness"].width) - 1,
        "wall_position": 1 - (1 << (fields["wall_position"].width - 1)),
        "output_force_limit": top,
    }
    await host.commit(**largest)
    host.checked = False
    for late in range(4):
        answer, _ = await host.exchange({})
        assert answer["drive"] == -top
        await host.edges(host.settling)
        while not int(dut.drive_pdm.value):
            await host.edges(1)
        # The pin falls between two edges, and the pulse with it.
        host.bench.drive(drive_enable=0)
        await Timer(1, "ns")
        assert int(dut.drive_pdm.value) == 0
        host.pulses.clear()
        await host.edges(late)
        answer, _ = await host.exchange({})
        # The telemetry is captured this many edges after the fall of the pin.
        assert (answer["drive"] == 0) == (late + SYNCHRONISER > host.board.enable_latency)
        assert (1, 0) not in host.pulses
        assert (1, 1) not in host.pulses
        host.bench.drive(drive_enable=1)
        await host.edges(host.settling)


@pytest.mark.parametrize("name", ["paper", "mhz", "narrow"])
def test_rtl(name):
    simulate(__file__, make, name=name)


def test_frames_are_lists_of_whole_fields():
    board = make("mhz")
    assert board.frame_bits % BYTE == 0
    assert list(board.commands.fields) == [
        *PULSES,
        "preload_count",
        *(word.name for word in board.spec.design.words),
    ]
    frame = board.commands.encode({"commit": 1, "preload_count": -1})
    width = board.commands.fields["preload_count"].width
    assert int.from_bytes(frame, "big") >> (board.frame_bits - 4 - width) == 0b1000 << width | (1 << width) - 1
    width = board.telemetry.fields["drive"].width
    answer = (1 << width) - 5 << (board.frame_bits - width)
    assert board.telemetry.decode(answer.to_bytes(board.frame_bits // BYTE, "big")) == {
        name: -5 if name == "drive" else 0 for name in TELEMETRY
    }


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"comit": 1}, r"^name must be one of commit, .*, not 'comit'$"),
        ({"commit": 2}, r"^commit must be 0 to 1, not 2$"),
        ({"wall_position": 1 << 20}, r"^wall_position must be -1048576 to 1048575, not 1048576$"),
        ({"wall_damping": -1}, r"^wall_damping must be 0 to 65535, not -1$"),
    ],
)
def test_frames_that_cannot_be_are_refused(values, message):
    with pytest.raises(ValueError, match=message):
        make("mhz").commands.encode(values)


def test_an_answer_of_the_wrong_length_is_refused():
    board = make("mhz")
    with pytest.raises(ValueError, match=rf"^frame must have {board.frame_bits // BYTE} bytes, not 3$"):
        board.telemetry.decode(b"abc")


def test_wrong_spec_is_refused():
    with pytest.raises(TypeError, match=r"not 3$"):
        Board(3)
