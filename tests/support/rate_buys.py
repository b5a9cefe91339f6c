"""Draw the picture of what the rate buys from the reports of two commands.

`make sight` runs it, with what `hardwall accuracy --json` and `hardwall rates --json` print.
"""

import json
import sys
from pathlib import Path

from hardwall.sim.pictures.rates import draw_beside_errors
from hardwall.sim.pictures.style import save


def main(accuracy: str, rates: str, picture: str) -> None:
    """Draw two reports; the arguments are paths."""
    reports = (json.loads(Path(path).read_text(encoding="utf-8")) for path in (accuracy, rates))
    save(draw_beside_errors(*reports), Path(picture))
    print(picture)


if __name__ == "__main__":
    main(*sys.argv[1:])
