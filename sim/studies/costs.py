"""The logic cost of a velocity estimator: synthesised alone, and placed and routed as part of a board."""

from collections.abc import Iterable
from typing import Any

from ...model.runtime.result import Rows, Table, table_of
from ..boards.description import board_of
from ..rtl.flow import DoesNotFitError
from ..rtl.synthesis import estimator_cells, synthesise
from ..scene.load import load

DEVICES = ("ecp5-25k", "ice40-up5k", "gw1nr-9")
"""The parts that are compared, one of each kind; each runs the scene of its board."""


class Costs(Rows):
    """Costs of estimators on parts: rows of `cost`."""

    def tables(self) -> list[Table]:
        """Return two tables for every part: the estimators alone, and the board with each estimator."""
        tables = []
        for device in dict.fromkeys(row["device"] for row in self.rows):
            own = [row for row in self.rows if row["device"] == device]
            tables.append(table_of((f"{device}: alone",), ALONE, [_alone(row) for row in own]))
            tables.append(table_of((f"{device}: board",), BOARD, [_board(row) for row in own]))
        return tables


ALONE = ("LUT4", "FF", "DSP", "BRAM", "clocks")
BOARD = ("LUT4", "FF", "DSP", "BRAM", "fmax (MHz)", "samples/s")


def _alone(row: dict[str, Any]) -> list[str]:
    return [row["estimator"], *(str(row[name]) for name in ("lut4", "ff", "dsp", "bram", "latency_clocks"))]


def _board(row: dict[str, Any]) -> list[str]:
    board = row["board"]
    if board is None:
        lacking = (f"{used} of {most} {name.upper()}" for name, (used, most) in row["lacking"].items())
        return [row["estimator"], *[""] * 4, "does not fit", ", ".join(lacking)]
    cells = [str(board[name]) for name in ("lut4", "ff", "dsp", "bram")]
    return [row["estimator"], *cells, f"{board['fmax_mhz']:.1f}", f"{board['max_sample_hz']:,}"]


def jobs(estimators: list[str], device: str, seeds: int) -> list[dict[str, Any]]:
    """Return the arguments of `cost` for every estimator."""
    return [{"estimator": name, "device": device, "seeds": list(range(1, seeds + 1))} for name in estimators]


def cost(estimator: str, device: str, seeds: Iterable[int]) -> dict:
    """Return the cost of an estimator on a part, at the rates of the scene that its board runs.

    Returns:
        estimator, device, clock_mhz, sample_hz: what was synthesised.
        lut4, ff, dsp, bram: cells of the estimator alone, before placing.
        latency_clocks: latency of the estimator, from strobe to valid.
        board: the report of `synthesis.synthesise`; None if the part has too few cells.
        lacking: the cells needed and available of each resource that is too small for the board.

    Raises:
        SynthesisError: if a tool is missing or fails.
    """
    on = board_of(device)
    scene = load(on.scene, {**on.changes, "controller.estimator": estimator, "controller.output": None})
    board, lacking = None, {}
    try:
        board = {"scene": scene.name} | synthesise(scene.spec, device, list(seeds), scene.glitch_clocks)
    except DoesNotFitError as error:
        lacking = {name: list(cells) for name, cells in error.lacking.items()}
    return {
        "estimator": estimator,
        "device": device,
        "clock_mhz": scene.spec.clock_hz / 1e6,
        "sample_hz": scene.spec.sample_hz,
        **estimator_cells(scene.spec, device),
        "latency_clocks": scene.spec.design.estimator.latency,
        "board": board,
        "lacking": lacking,
    }
