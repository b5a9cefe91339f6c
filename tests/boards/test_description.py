"""The descriptions of boards: pins are those of amaranth-boards, every signal has one, on a header that is there."""

import re

import pytest
from amaranth.hdl import Value
from amaranth_boards.icebreaker import ICEBreakerPlatform
from amaranth_boards.tang_nano_9k import TangNano9kPlatform
from amaranth_boards.ulx3s import ULX3S_12F_Platform, ULX3S_25F_Platform, ULX3S_45F_Platform, ULX3S_85F_Platform

from hardwall.hdl.axes.board import AxesBoard
from hardwall.hdl.axis.board import Board
from hardwall.model.axes.axis import AxesSpec
from hardwall.sim.boards import description
from hardwall.sim.boards.description import BOARDS, board_of
from hardwall.sim.boards.parts import PARTS
from hardwall.sim.boards.signals import EVERY, OF_STAGE, signals_of, signals_of_axes
from hardwall.sim.boards.top import INSIDE
from hardwall.sim.scene.load import load
from stimuli.specs import MHZ
from stimuli.stages import axis

every_stage = pytest.mark.parametrize("stage", OF_STAGE)
every_board = pytest.mark.parametrize("board", BOARDS.values(), ids=BOARDS)
THEIRS = {
    "ulx3s-12f": ULX3S_12F_Platform,
    "ulx3s-25f": ULX3S_25F_Platform,
    "ulx3s-45f": ULX3S_45F_Platform,
    "ulx3s-85f": ULX3S_85F_Platform,
    "icebreaker": ICEBreakerPlatform,
    "tangnano9k": TangNano9kPlatform,
}
"""The platforms of amaranth-boards."""
CONNECTORS = {"J1": ("gpio", 0), "J2": ("gpio", 0), "PMOD1A": ("pmod", 0), "PMOD1B": ("pmod", 1), "PMOD2": ("pmod", 2)}
"""Its connectors, by the names of our headers."""


def resource(platform, name, number=0):
    """Return what amaranth-boards says of a part of a board."""
    return next(each for each in platform.resources if (each.name, each.number) == (name, number))


def pins_of(platform, name, sub=None, number=0) -> list[str]:
    """Return the FPGA's pins of a part of a board."""
    ios = resource(platform, name, number).ios
    return next(each.ios for each in ios if each.name == sub)[0].names if sub else ios[0].names


@every_stage
def test_every_signal_is_a_port_of_the_board_and_every_port_has_one(stage):
    members = Board(axis(stage)).signature.members
    assert {signal.name for signal in signals_of(stage)} == set(members) - INSIDE
    outputs = {name for name, member in members.items() if member.flow.name == "Out"}
    assert {signal.name for signal in signals_of(stage) if signal.out} == outputs - INSIDE


@every_board
@every_stage
def test_every_signal_has_a_pin_of_its_own(board, stage):
    assert list(board.pins) == [signal.name for signal in EVERY]
    assert len({board.pins[signal.name].site for signal in signals_of(stage)}) == len(signals_of(stage))
    assert {pin.pull for pin in board.pins.values()} <= {"up", "down", "none"}


@every_board
@every_stage
def test_a_pin_on_a_header_is_there_once(board, stage):
    positions = [f"{header.name} {name}" for header in board.headers for row in header.rows for name in row]
    pins = [board.pins[signal.name] for signal in signals_of(stage)]
    on_headers = [pin.at for pin in pins if pin.at.split()[0] in {each.name for each in board.headers}]
    assert len(on_headers) >= len(pins) - 4, "all but the clock, the reset and the serial line"
    assert [positions.count(at) for at in on_headers] == [1] * len(on_headers)


@every_board
def test_pins_on_headers_are_those_of_amaranth_boards(board):
    """Its description of the Tang Nano 9K has no connectors: what is printed beside a pin there is the pin's number."""
    connectors = {(each.name, each.number): each.mapping for each in THEIRS[board.name].connectors}
    for pin in board.pins.values():
        name, _, position = pin.at.partition(" ")
        if name in CONNECTORS:
            assert connectors[CONNECTORS[name]][position] == pin.site
        elif name == "J6":
            assert position == pin.site
    assert bool(connectors) == (board.family != "tangnano9k")


def test_every_axis_of_several_has_pins_of_its_own():
    for board in BOARDS.values():
        axes = board.most_axes
        assert axes == (8 if board.family == "ulx3s" else 0)
        if axes:
            several = board.of_axes(axes)
            names = [signal.name for signal in signals_of_axes(axes)]
            assert sorted(several.pins) == sorted(names)
            assert len({pin.site for pin in several.pins.values()}) == len(names) == 4 + 3 + 6 * axes
            test_pins_on_headers_are_those_of_amaranth_boards(several)
            # The board's ESP32 can drive these.
            assert not {pin.at[3:-1] for pin in several.pins.values()} & {"11", "12"}
            for signal in signals_of_axes(axes):
                pin, alone = several.pins[signal.name], board.pins[re.sub(r"_\d$", "", signal.name)]
                assert (pin.pull, signal.outside == "1 kΩ to ground") == (alone.pull, signal.outside != "")


def test_every_signal_of_several_axes_is_a_port_of_their_board():
    axes = AxesBoard(AxesSpec(**MHZ, axes=2, estimator="fdm"))
    ports = {name: len(Value.cast(getattr(axes, name))) for name in axes.signature.members if name not in INSIDE}
    names = [re.sub(r"_\d$", "", signal.name) for signal in signals_of_axes(2)]
    assert {name: names.count(name) for name in names} == ports


def test_more_axes_than_pins_are_refused():
    with pytest.raises(ValueError, match=r"^axes must be at most 8 on ulx3s-85f, not 9$"):
        BOARDS["ulx3s-85f"].of_axes(9)
    with pytest.raises(
        ValueError, match=r"^axes must be absent on icebreaker \(its pins are those of a single axis\), not 2$"
    ):
        BOARDS["icebreaker"].of_axes(2)


@every_board
def test_oscillator_and_serial_line_are_those_of_amaranth_boards(board):
    theirs = THEIRS[board.name]
    clock = resource(theirs, theirs.default_clk)
    assert board.oscillator_hz == clock.clock.frequency
    assert board.pins["clk"].site == clock.ios[0].names[0]
    assert [board.pins["uart_rx"].site] == pins_of(theirs, "uart", "rx")
    assert [board.pins["uart_tx"].site] == pins_of(theirs, "uart", "tx")


def test_parts_and_buttons_are_those_of_amaranth_boards():
    for name, platform in THEIRS.items():
        if name.startswith("ulx3s"):
            assert BOARDS[name].part.code == platform.device
            assert (platform.package, platform.speed) == ("BG381", "6")
            assert pins_of(platform, "button_fire") == [BOARDS[name].pins["rst"].site]
    assert (ICEBreakerPlatform.device, ICEBreakerPlatform.package) == ("iCE40UP5K", "SG48")
    assert TangNano9kPlatform.part in PARTS["gw1nr-9"].nextpnr
    button = next(each for each in ICEBreakerPlatform.break_off_pmod if each.name == "button")
    assert BOARDS["icebreaker"].pins["rst"].at == f"PMOD2 {button.ios[0].names[0].rpartition(':')[2]}"


def test_a_bank_of_1_8_volts_is_not_used():
    """Those are the buttons and LEDs of the Tang Nano 9K, and pins of its far header."""
    pins = {int(pin.site) for pin in BOARDS["tangnano9k"].pins.values()}
    assert not pins & {*range(3, 17), *range(79, 89)}


@every_board
def test_the_drive_and_the_loops_are_low_while_nothing_is_connected(board):
    drive = {signal.name for signals in OF_STAGE.values() for signal in signals}
    for signal in EVERY:
        if signal.name == "dac_cs_n":
            assert signal.outside == "10 kΩ to 3.3 V"
            assert board.pins[signal.name].pull != "down"
        elif signal.name in {"drive_enable", "external_fault", "emergency_stop", "alive"} | drive:
            assert signal.outside == "1 kΩ to ground"
            assert board.pins[signal.name].pull != "up"


@every_board
def test_its_own_scene_has_a_clock_that_it_makes(board):
    clock_hz = load(board.scene, board.changes).spec.clock_hz
    assert clock_hz == board.oscillator_hz or board.setting(clock_hz).clock == clock_hz


def test_every_part_has_one_board():
    assert sorted(board.device for board in BOARDS.values()) == sorted(PARTS)
    assert [board_of(device).device for device in PARTS] == list(PARTS)


def test_a_pin_too_many_and_a_pin_that_lacks_are_refused():
    text = (description.files(description.__package__) / "icebreaker.toml").read_text()
    assert list(description._read("icebreaker", text)) == ["icebreaker"]
    with pytest.raises(ValueError, match=r"^icebreaker: pins must be of clk, rst, .*not \{'led'"):
        description._read("icebreaker", text.replace("[pins]\n", '[pins]\nled = { site = "11", at = "LED" }\n'))
    with pytest.raises(KeyError, match="alive"):
        description._read("icebreaker", re.sub(r"^alive = .*\n", "", text, flags=re.MULTILINE))
