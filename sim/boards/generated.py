"""The files of constraints/, which show the pins and the `top` of every board.

Each is for the scene that its board runs if none is given. `hardwall verilog --board` writes them for any scene.
"""

from .constraints import constraints
from .description import BOARDS
from .top import top_verilog


def files(clocks_hz: dict[str, int]) -> dict[str, str]:
    """Return the text of every file by its name.

    Args:
        clocks_hz: the clock of the scene that a board runs, by the board's name.
    """
    texts = {}
    for board in BOARDS.values():
        texts[board.family + board.part.suffixes.pins] = constraints(board)
        texts[f"{board.family}.v"] = top_verilog(board, clocks_hz[board.name])
    return texts
