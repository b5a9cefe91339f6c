"""A board's words as a file: as the board has them, of that board alone, and loaded all or none."""

import re
from dataclasses import replace
from types import MappingProxyType

import pytest

from hardwall.host.config import Config, Difference
from hardwall.host.connect import connect
from hardwall.host.errors import ChangedError, ConfigError, HostError, NotReadyError
from hardwall.host.status import State
from hardwall.model.axis.registers import LIVE, WRITTEN, RegisterMap
from hardwall.sim.scene.load import load
from host.twin_board import PATIENT, TwinBoard

FOR_GOOD = 1 << 30


@pytest.fixture
def file(axis, tmp_path):
    """The words of a board after its reset, in a file."""
    path = tmp_path / "words.toml"
    Config.of(axis).write(path, axis.device)
    return path


def edited(file, **words: str) -> Config:
    """Return the configuration of a file with other values, as they are written."""
    text = file.read_text()
    for name, value in words.items():
        text, found = re.subn(rf"^{name} = \S+", f"{name} = {value}", text, flags=re.MULTILINE)
        assert found == 1
    file.write_text(text)
    return Config.read(file)


def test_a_file_may_begin_with_a_byte_order_mark(file):
    """As editors on Windows write it."""
    read = Config.read(file)
    file.write_text(file.read_text(), encoding="utf-8-sig")
    assert Config.read(file) == read


def words_of(board) -> dict[str, int]:
    return dict(board.server.file.active)


@pytest.mark.parametrize("end", ["low", "high", "reset", "between"])
def test_every_word_is_saved_as_it_is(board, axis, registers, tmp_path, end):
    words = {each.name: each for each in (*registers.words, *registers.live) if each.name in axis.names}
    assert len(words) == len(axis.names) > 25
    picked = {
        name: (2 * each.low + each.high) // 3 if end == "between" else getattr(each, end)
        for name, each in words.items()
    }
    axis.set(**{name: word * words[name].lsb for name, word in picked.items()})
    before = words_of(board)
    assert {name: before[name] for name in words} == picked
    Config.of(axis).write(tmp_path / "words.toml", axis.device)
    read = Config.read(tmp_path / "words.toml")
    assert read.differences(axis) == []
    # Others, then those of the file again.
    axis.set(**{name: (each.reset if end != "reset" else each.high) * each.lsb for name, each in words.items()})
    read.load(axis, read.differences(axis))
    assert read.differences(axis) == []
    after = words_of(board)
    assert {name: after[name] for name in words} == picked


def test_a_file_has_the_virtual_masses_of_a_board_with_them(accelerated_axis, tmp_path):
    axis, path = accelerated_axis, tmp_path / "words.toml"
    axis.set(wall_mass=0.03, free_mass=-0.01)
    Config.of(axis).write(path, axis.device)
    for name, value in (("wall_mass", "0.03"), ("free_mass", "-0.01")):
        most = f"{axis.device.registers[name].high * axis.device.registers[name].lsb:g}"
        assert f"\n{name} = {value}  # kg, -{most} to {most}\n" in path.read_text()
    axis.set(wall_mass=0, free_mass=0)
    read = Config.read(path)
    assert [(each.name, each.board, each.unit) for each in read.differences(axis)] == [
        ("wall_mass", 0.0, "kg"),
        ("free_mass", 0.0, "kg"),
    ]
    read.load(axis, read.differences(axis))
    assert (axis.wall.mass, axis.free.mass) == pytest.approx((0.03, -0.01), abs=1e-5)


def test_a_file_is_read_by_people(file, axis):
    text = file.read_text()
    assert f'identity = "{axis.device.identity}"' in text
    assert "\nwall_stiffness = 0.0  # N/m, 0 to 255996\n" in text
    assert "\nwall_left = 0  # 0 to 1\n" in text
    assert "\nsupervisor_watchdog = 0.2  # s, 0.05 to 2\n" in text


def test_a_difference_has_both_values(file, axis):
    config = edited(file, wall_stiffness="1000", supervisor_force_limit="7.1234")
    stiffness, limit = axis.device.registers["wall_stiffness"].lsb, axis.device.registers["supervisor_force_limit"].lsb
    found = config.differences(axis)
    assert [each.name for each in found] == ["wall_stiffness", "supervisor_force_limit"]
    assert found[0][1::2] == (0.0, "N/m")
    assert found[0].file == pytest.approx(1000, abs=stiffness / 2)
    assert found[1].file == pytest.approx(7.1234, abs=limit / 2)


def test_words_of_a_load_are_staged_and_committed_by_one_request_and_live_ones_are_one(board, file, axis, registers):
    config = edited(file, wall_stiffness="1000", supervisor_force_limit="7", capture_before="9")
    differences = config.differences(axis)
    before = len(board.requests)
    config.load(axis, differences)
    written = [request for request in board.requests[before:] if request[1] == 16]
    heartbeat = registers["heartbeat"].address
    places = [int.from_bytes(request[2:4], "big") for request in written]
    assert [place for place in places if place != heartbeat] == [LIVE + 4, WRITTEN - 1]
    assert "arm" not in board.server.file.pulses
    assert axis.status.state is State.DISARMED


def test_what_the_file_leaves_out_stays_though_another_value_waits_for_a_commit(board, file, axis, registers):
    axis.set(wall_damping=20.0)
    # A host before has written a word, and not committed it.
    damping = registers["wall_damping"]
    axis._port.write(damping.address, damping.to_registers(3))
    text = re.sub(r"^(wall_damping|drive_invert) = .*\n", "", file.read_text(), flags=re.MULTILINE)
    file.write_text(text)
    with connect_again(board, axis) as other:
        config = edited(file, wall_stiffness="1000")
        config.load(other, config.differences(other))
        assert other.get("wall_damping") == pytest.approx(20.0, abs=damping.lsb)
        assert other.get("wall_stiffness") == pytest.approx(1000, abs=4)


def connect_again(board, axis):
    axis.close()
    return connect(board.name, **PATIENT)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ({"wall_stiffness": "1e9"}, "wall_stiffness must be 0 to 255996 N/m, not 1000000000.0"),
        ({"wall_stiffness": "nan"}, "wall_stiffness must be 0 to 255996 N/m, not nan"),
        ({"wall_stiffness": '"stiff"'}, "wall_stiffness must be a number, not 'stiff'"),
        ({"wall_stiffness": "true"}, "wall_stiffness must be a number, not True"),
        ({"wall_left": "0.5"}, "wall_left must be a whole number of 0 to 1, not 0.5"),
        ({"supervisor_watchdog": "0.01"}, "supervisor_watchdog must be 0.05 to 2 s, not 0.01"),
        ({"supervisor_turn": "1" + "0" * 400}, "supervisor_turn must be 0 to 1.04858e+06, not 1000"),
    ],
)
def test_a_value_that_its_word_cannot_hold_writes_nothing(board, file, axis, words, message):
    config = edited(file, wall_damping="3", **words)
    before = words_of(board)
    for act in (lambda: config.differences(axis), lambda: config.load(axis, [])):
        with pytest.raises(ConfigError, match=re.escape(message)) as found:
            act()
        assert str(found.value).startswith("'words.toml': ")
    assert words_of(board) == before


def test_a_word_that_is_none_is_refused(file, axis):
    config = edited(file)
    config = replace(config, words=MappingProxyType({**config.words, "wall_colour": 1.0}))
    with pytest.raises(ConfigError, match=r"\[words\] must be words of the board, not 'wall_colour'"):
        config.differences(axis)
    # The heartbeat is no setting.
    config = replace(config, words=MappingProxyType({"heartbeat": 1.0}))
    with pytest.raises(ConfigError, match="not 'heartbeat'"):
        config.differences(axis)


def test_a_file_of_another_board_is_refused(file):
    other = RegisterMap(load("seed-2011", {"controller.estimator": "kalman"}).spec)
    with TwinBoard(other) as foreign, connect(foreign.name, **PATIENT) as axis:
        before = words_of(foreign)
        config = Config.read(file)
        for act in (lambda: config.differences(axis), lambda: config.load(axis, [])):
            with pytest.raises(ChangedError, match=r"words\.toml' is of another board: identity is '") as found:
                act()
            said = str(found.value)
            assert other.identity in said
            assert "clock_hz is " in said
            assert "the board has no word 'levant_alpha'" in said
            assert "\n" not in said
        assert words_of(foreign) == before


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", r"must have only the tables \[board\] and \[words\]"),
        ("board = 1\nwords = 2", r"must have only the tables \[board\] and \[words\]"),
        ("[board]\n[words]\n[more]", r"must have only the tables \[board\] and \[words\]"),
        ("[board]\n[words]", r"\[board\] must have identity, clock_hz, .*, not \[\]"),
        ("[board", "is no TOML: "),
        ("x = " + "[" * 5000, "is no TOML: "),
        ("x = " + "9" * 5000, "is no TOML: "),
        ("\udcff", "is no TOML: "),
    ],
)
def test_what_is_no_configuration_is_refused(tmp_path, text, message):
    path = tmp_path / "words.toml"
    path.write_bytes(text.encode("utf-8", "surrogateescape"))
    with pytest.raises(ConfigError, match=message):
        Config.read(path)


@pytest.mark.parametrize(("name", "message"), [("absent", "No such file"), (".", "it is not a regular file")])
def test_what_cannot_be_read_is_refused(tmp_path, name, message):
    with pytest.raises(ConfigError, match=f"cannot be read: {message}"):
        Config.read(tmp_path / name)


def test_an_axis_that_drives_is_not_loaded(board, file, axis):
    config = edited(file, wall_stiffness="1000")
    differences = config.differences(axis)
    board.show(state=State.ARMED)
    before = words_of(board)
    with pytest.raises(NotReadyError, match="disarm it before a configuration is loaded"):
        config.load(axis, differences)
    assert words_of(board) == before


def test_only_what_was_shown_is_loaded(board, file, axis):
    config = edited(file, wall_stiffness="1000")
    shown = config.differences(axis)
    axis.set(wall_damping=5.0)
    before = words_of(board)
    with pytest.raises(ChangedError, match="have changed since they were shown: nothing was loaded"):
        config.load(axis, shown)
    with pytest.raises(ChangedError):
        config.load(axis, [])
    assert words_of(board)["wall_stiffness"] == before["wall_stiffness"]
    assert isinstance(shown[0], Difference)


def test_a_load_whose_commit_fails_leaves_what_was_before(board, file, axis, registers):
    axis.set(wall_damping=20.0, supervisor_force_limit=5.0)
    config = edited(file, wall_stiffness="1000", supervisor_force_limit="7")
    differences = config.differences(axis)
    before = words_of(board)
    silent = []

    def hear(pulses: tuple[str, ...]) -> None:
        # The live words have come, and then the cable is out for a while: no answer to anything, and nothing is heard.
        if board.server.file.active["supervisor_force_limit"] != before["supervisor_force_limit"] and not silent:
            silent.append(True)
            board.server.file.refusing = frozenset({"commit"})

    board.react = hear
    refused = board.server.take

    def take(verdict, frame):
        answer = refused(verdict, frame)
        if answer and answer[1] & 0x80:
            # The refused commit is the only one.
            board.server.file.refusing = frozenset()
        return answer

    board.server.take = take
    with pytest.raises(HostError, match="nothing was loaded, because the board did not take all: the board refuses"):
        config.load(axis, differences)
    assert silent
    after = words_of(board)
    assert {name: after[name] for name in axis.names} == {name: before[name] for name in axis.names}


def test_a_load_whose_board_falls_silent_says_so(board, file, axis):
    config = edited(file, wall_stiffness="1000", supervisor_force_limit="7")
    differences = config.differences(axis)
    before = words_of(board)["supervisor_force_limit"]

    def hear(pulses: tuple[str, ...]) -> None:
        if board.server.file.active["supervisor_force_limit"] != before:
            board.lost = FOR_GOOD

    board.react = hear
    with pytest.raises(HostError, match=r"some words may be loaded and others not, .* load again"):
        config.load(axis, differences)
