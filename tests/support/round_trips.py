"""Round trips: from the first bit of a request to the last of its answer, in the time of the board.

    PYTHONPATH=tests .venv/bin/python -m support.round_trips

The board of `mhz` with a clock of 12 MHz, simulated clock by clock, with serial lines of several rates. Prints a table.
"""

from virtual.virtual_host import SerialHost

from hardwall.cli.terminal import show
from hardwall.model.axis.registers import CONSTANTS, TELEMETRY, WRITTEN, RegisterMap
from hardwall.model.runtime.result import Table
from hardwall.sim.scene.load import load
from hardwall.sim.virtual import virtual_board
from stimuli import frames

CLOCK_HZ, SAMPLE_HZ = 12_000_000, 100_000
BAUDS = 115_200, 460_800, 921_600, 1_500_000, 3_000_000
RESOLUTION_S = 1 / SAMPLE_HZ
SCENE = {"controller.clock_hz": CLOCK_HZ, "controller.sample_hz": SAMPLE_HZ, "controller.actuation_hz": SAMPLE_HZ}


def requests(registers: RegisterMap) -> dict[str, bytes]:
    """Return what `hardwall.host` asks: its status, a commit of the words up to the wall's place, and a beat."""
    last = registers.status[-1]
    wall, beat = registers["wall_position"], registers["heartbeat"]
    state, moved = last.address + last.size - TELEMETRY, wall.address + wall.size - (WRITTEN - 1)
    return {
        f"the state of the axis, {state} registers": frames.read(TELEMETRY, state),
        f"a moved wall, {moved} registers": frames.write(WRITTEN - 1, [1] + [0] * (moved - 1)),
        "a beat": frames.write(beat.address, list(beat.to_registers(1))),
    }


def main() -> None:
    """Measure, and print."""
    virtual_board.GRASP_S = RESOLUTION_S
    scene = load("mhz", SCENE)
    asked = requests(RegisterMap(scene.spec))
    rows = []
    for baud in BAUDS:
        with virtual_board.VirtualBoard(scene, baud) as board:
            host = SerialHost(board)
            host.took_s(frames.read(CONSTANTS, 2))
            rows.append([f"{baud}", *(f"{1e3 * host.took_s(request):.2f}" for request in asked.values())])
    show(Table(dict.fromkeys(("baud", *(f"{name} (ms)" for name in asked)), "right"), rows))


if __name__ == "__main__":
    main()
