"""Homing as tabs ask for it: what it waits for while the board is looked at, and what ends it."""

import pytest

from hardwall.host.homing import INDEX
from hardwall.host.status import State
from support.processes import wait_until

TAB = "tab"


def test_homing_waits_for_the_index_while_the_board_is_shown(driver, board, registers):
    said = []

    def follow(pulses: tuple[str, ...]) -> None:
        said.extend(pulses)
        if "index_arm" in pulses:
            board.show(index_armed=1, index_latched=0)
        if "origin_shift" in pulses:
            board.show(referenced=1)

    board.react = follow
    driver.home(TAB, 0.02)
    wait_until(lambda: driver.view.homing == INDEX)
    number, _ = driver.samples_since(0)
    wait_until(lambda: driver.samples_since(0)[0] > number + 5)
    board.show(index_armed=0, index_latched=1, index_count=100, count=250)
    wait_until(lambda: driver.view.said.startswith("it is homed"))
    assert not driver.view.homing
    assert driver.view.moved_m == pytest.approx(0.02 - 100e-6)
    assert said == ["index_arm", "commit", "origin_shift"]
    assert board.server.file.active["preload_count"] * registers["count"].lsb == pytest.approx(0.02 - 100e-6, abs=1e-9)


@pytest.mark.parametrize("way", ["left", "armed", "gone", "out of range", "slipped"])
def test_homing_ends(driver, board, way):
    board.react, react = (
        lambda pulses: (react(pulses), "index_arm" in pulses and board.show(index_armed=1)),
        board.react,
    )
    driver.home(TAB, 1e3 if way == "out of range" else 0.0)
    if way == "out of range":
        wait_until(lambda: driver.view.said.startswith("index_m must be "))
    else:
        wait_until(lambda: driver.view.homing == INDEX)
    if way == "left":
        driver.leave_home()
    if way == "armed":
        driver.ping(TAB)
        driver.arm(TAB)
        wait_until(lambda: driver.ping(TAB) or driver.view.status.state is State.ARMED)
    if way == "gone":
        board.hang_up()
    if way == "slipped":
        board.show(index_armed=0, index_latched=0)
        wait_until(lambda: driver.view.said.startswith("the index was found, but the scale has slipped"))
    wait_until(lambda: not driver.view.homing)
