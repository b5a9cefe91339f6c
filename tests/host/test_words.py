"""Words in SI units: rounded, in range, committed together in one request, and compared with the board's."""

import re

import pytest

from hardwall.host.connect import connect
from hardwall.host.errors import ChangedError, RefusedError, SilentError
from hardwall.model.axis.register_file import Area
from hardwall.model.axis.registers import END
from hardwall.model.checks import FieldError

FOR_GOOD = 1 << 30
"""More answers than a host waits for."""


def active(board, registers, name: str) -> int:
    word = registers[name]
    return board.server.file.active[word.name]


def test_words_of_one_call_are_committed_by_one_request(board, axis, registers):
    before = len(board.requests)
    axis.set(wall_stiffness=10e3, wall_damping=20.0, levant_lambda=5.0)
    # One request, and the two of the first beat.
    assert len(board.requests) - before == 3
    assert board.requests[before][7:9] == b"\0\1"
    for name, value in (("wall_stiffness", 10e3), ("wall_damping", 20.0), ("levant_lambda", 5.0)):
        assert active(board, registers, name) == round(value / registers[name].lsb)
        assert axis.get(name) == pytest.approx(value, abs=registers[name].lsb / 2)
    untouched = [
        each for each in registers.words if each.name not in ("wall_stiffness", "wall_damping", "levant_lambda")
    ]
    assert all(board.server.file.active[each.name] == each.reset for each in untouched)


def test_what_another_call_wrote_is_kept(board, axis, registers):
    axis.wall.position = -3e-3
    axis.wall.stiffness = 5e3
    axis.supervisor.force_limit = 7.5
    assert active(board, registers, "wall_position") == -3000
    assert active(board, registers, "wall_stiffness") == round(5e3 / registers["wall_stiffness"].lsb)
    assert active(board, registers, "supervisor_force_limit") == 7500
    assert (axis.wall.position, axis.supervisor.force_limit) == (pytest.approx(-3e-3), 7.5)


def test_a_virtual_mass_is_a_word_of_the_wall_and_of_free_space(accelerated_board, accelerated_axis, accelerated):
    accelerated_axis.wall.mass = 0.03
    accelerated_axis.free.mass = -0.01
    for name, mass_kg in (("wall_mass", 0.03), ("free_mass", -0.01)):
        assert active(accelerated_board, accelerated, name) == round(mass_kg / accelerated[name].lsb)
    found = accelerated_axis.wall.mass, accelerated_axis.free.mass
    assert found == pytest.approx((0.03, -0.01), abs=accelerated["wall_mass"].lsb)
    most = f"{accelerated['free_mass'].high * accelerated['free_mass'].lsb:g}"
    with pytest.raises(FieldError, match=f"free_mass must be -{most} to {most} kg, not -0.06"):
        accelerated_axis.free.mass = -0.06


def test_a_board_without_a_virtual_mass_says_so(axis):
    for group in (axis.wall, axis.free):
        with pytest.raises(FieldError, match=r"word must be one of the board's, not '(wall|free)_mass'"):
            group.mass = 0.01


def test_what_a_host_before_has_written_is_kept(board, registers):
    with connect(board.name) as first:
        first.set(wall_stiffness=5e3, supervisor_watchdog=0.5)
    with connect(board.name) as second:
        second.set(wall_position=1e-3)
        assert second.wall.stiffness == pytest.approx(5e3, abs=4)
        assert second.supervisor.watchdog == pytest.approx(0.5)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"wall_stiffness": -1e4}, r"wall_stiffness must be 0 to 255996 N/m, not -10000.0"),
        ({"wall_stiffness": float("nan")}, "wall_stiffness must be 0 to 255996 N/m, not nan"),
        (
            {"wall_stiffness": 5e3, "wall_position": float("inf")},
            "wall_position must be -1.04858 to 1.04858 m, not inf",
        ),
        ({"wall_left": 2}, "wall_left must be 0 to 1, not 2"),
        ({"supervisor_watchdog": 0.02}, "supervisor_watchdog must be 0.05 to 2 s, not 0.02"),
        # Less than half of a unit beyond a bound, which rounds to it.
        ({"wall_stiffness": -1.0}, r"wall_stiffness must be 0 to 255996 N/m, not -1\.0"),
        ({"wall_stiffness": -1e-9}, "wall_stiffness must be 0 to 255996 N/m, not -1e-09"),
        ({"wall_stiffness": 255997.0}, "wall_stiffness must be 0 to 255996 N/m, not 255997.0"),
        ({"wall_position": -1.048581}, "wall_position must be -1.04858 to 1.04858 m, not -1.048581"),
        ({"supervisor_watchdog": 0.0499}, "supervisor_watchdog must be 0.05 to 2 s, not 0.0499"),
        ({"wall_left": 1.4}, "wall_left must be 0 to 1, not 1.4"),
        ({"wall_left": 0.4}, "wall_left must be a whole number of 0 to 1, not 0.4"),
        ({"supervisor_turn": 4000.5}, "supervisor_turn must be a whole number of .*, not 4000.5"),
        (
            {"heartbeat": 3},
            "word must be one of the board's, not 'heartbeat'; they are preload_count, .*, drive_invert",
        ),
        ({"wall_stifness": 5e3}, r"not 'wall_stifness'; did you mean wall_stiffness\?"),
        ({"wall_stiffness": 5e3, "wal_damping": 1}, r"not 'wal_damping'; did you mean wall_damping\?"),
    ],
)
def test_what_is_out_of_range_writes_nothing(board, axis, values, message):
    before = len(board.requests)
    with pytest.raises(FieldError, match=message):
        axis.set(**values)
    assert len(board.requests) == before


@pytest.mark.parametrize("value", ["5", None, [1], True])
def test_what_is_no_number_writes_nothing(board, axis, value):
    before = len(board.requests)
    with pytest.raises(TypeError, match="wall_stiffness must be a number"):
        axis.wall.stiffness = value
    assert len(board.requests) == before


def test_the_ends_of_every_range_can_be_written(board, axis, registers):
    for word in (*registers.words, *registers.live):
        if word.name in axis.names:
            for end in (word.low, word.high):
                axis.set(**{word.name: end * word.lsb})
                assert board.server.file.active[word.name] == end
            axis.set(**{word.name: word.reset * word.lsb})
    assert {"heartbeat", "acknowledged"} & set(axis.names) == set()
    assert len(axis.names) == len(registers.words) + len(registers.live) - 2


def test_every_bound_that_is_printed_can_be_written_and_no_value_beyond_it(board, axis, registers):
    for word in (*registers.words, *registers.live):
        if word.name in axis.names:
            with pytest.raises(FieldError) as error:
                axis.set(**{word.name: 1e29})
            said = re.search(r"must be (\S+) to ([^\s,]+)", str(error.value))
            for text, end, way in ((said[1], word.low, -1), (said[2], word.high, 1)):
                bound = float(text)
                assert bound == pytest.approx(end * word.lsb, rel=1e-5)
                axis.set(**{word.name: bound})
                assert board.server.file.active[word.name] == end
                # A step beyond both, far less than the word's unit.
                beyond = way * max(way * bound, way * end * word.lsb)
                with pytest.raises(FieldError):
                    axis.set(**{word.name: beyond + way * max(abs(beyond) * 1e-9, 1e-12)})
            axis.set(**{word.name: word.reset * word.lsb})


def test_a_switch_takes_truth(board, axis):
    axis.set(wall_left=True)
    assert board.server.file.active["wall_left"] == 1


@pytest.mark.parametrize("name", ["wall_stiffness", "supervisor_force_limit"])
def test_a_write_whose_answer_was_lost_is_not_taken_back_by_the_next(board, axis, registers, name):
    wanted = 5.0
    board.lost = FOR_GOOD
    with pytest.raises(SilentError, match="which may have been carried out"):
        axis.set(**{name: wanted})
    board.lost = 0
    axis.set(wall_position=1e-3)
    assert active(board, registers, name) == round(wanted / registers[name].lsb)
    axis._words.check()


def test_a_board_that_was_reset_behind_a_lost_answer_is_found_out(board, axis, registers):
    axis.set(wall_position=1e-3)
    board.lost = FOR_GOOD
    with pytest.raises(SilentError):
        axis.set(wall_stiffness=5e3)
    board.lost = 0
    at = registers["wall_position"].address
    board.server.file.live[at : at + 2] = [0, 0]
    with pytest.raises(ChangedError, match="has 0 in wall_position"):
        axis.set(wall_damping=1.0)


def test_what_was_refused_is_not_taken_for_written(board, axis, registers):
    # A board of another range than its map says.
    board.server.file.design.book[Area.MOST * END + registers["wall_stiffness"].address + 1] = 7
    with pytest.raises(RefusedError, match="a value is out of its range"):
        axis.set(wall_stiffness=5e3)
    at = registers["wall_stiffness"].address
    board.server.file.live[at : at + 2] = registers["wall_stiffness"].to_registers(1280)
    with pytest.raises(ChangedError):
        axis.arm()


@pytest.mark.parametrize("name", ["wall_stiffness", "supervisor_force_limit"])
def test_one_lost_answer_costs_nothing(board, axis, registers, name):
    board.lost = 1
    axis.set(**{name: 5.0})
    assert active(board, registers, name) == round(5.0 / registers[name].lsb)


@pytest.mark.parametrize(
    ("group", "name", "message"),
    [
        ("wall", "stifness", "Wall has no attribute stifness; did you mean stiffness?"),
        ("supervisor", "force_limits", "Supervisor has no attribute force_limits; did you mean force_limit?"),
        ("supervisor", "xyz", "Supervisor has no attribute xyz"),
        (None, "wal", "Axis has no attribute wal; did you mean wall?"),
    ],
)
def test_an_attribute_that_is_none_is_refused(axis, group, name, message):
    with pytest.raises(AttributeError) as error:
        setattr(getattr(axis, group) if group else axis, name, 5e3)
    assert str(error.value) == message


def test_a_board_that_was_reset_is_not_armed(board, axis, registers):
    axis.set(wall_stiffness=5e3)
    at = registers["wall_stiffness"].address
    board.server.file.live[at : at + 2] = [0, 0]
    with pytest.raises(ChangedError, match=r"has 0 in wall_stiffness instead of the written 5000: it was reset"):
        axis.arm()
    board.server.file.live[3] ^= 1
    with pytest.raises(ChangedError, match=r"is now .*: connect again"):
        axis.arm()
