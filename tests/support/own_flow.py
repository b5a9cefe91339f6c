"""Write the files of constraints/ anew from the boards' descriptions: `make constraints`."""

from importlib.resources import files

from hardwall.sim.boards.description import BOARDS
from hardwall.sim.boards.generated import files as generated
from hardwall.sim.scene.load import load

CLOCKS_HZ = {name: load(board.scene, board.changes).spec.clock_hz for name, board in BOARDS.items()}
"""The clock of the scene that every board runs."""

if __name__ == "__main__":
    for name, text in generated(CLOCKS_HZ).items():
        (files("hardwall.constraints") / name).write_text(text, encoding="utf-8")
        print(name)
