"""Draw every diagram: `python -m docs.diagrams.draw`, in the project's folder."""

from collections.abc import Callable
from functools import partial
from pathlib import Path

from . import (
    bench,
    choose_estimator,
    estimator_files,
    force_law,
    link_frame,
    loop,
    one_and_many,
    pin_to_drive,
    pipeline,
    supervisor_states,
    tree,
    wiring,
)

FOLDER = Path(__file__).absolute().parent
DRAWN: dict[str, Callable[[], str]] = {
    "pin-to-drive.svg": pin_to_drive.draw,
    "pipeline.svg": pipeline.draw,
    "supervisor.svg": supervisor_states.draw,
    "link-frame.svg": link_frame.draw,
    "one-axis-many-axes.svg": one_and_many.draw,
    "loop.svg": loop.draw,
    "tree.svg": tree.draw,
    "choose-estimator.svg": choose_estimator.draw,
    "test-bench.svg": bench.draw,
    "estimator-files.svg": estimator_files.draw,
    "force-law.svg": force_law.draw,
    "wiring-ulx3s.svg": partial(wiring.draw, "ulx3s-25f"),
    "wiring-icebreaker.svg": partial(wiring.draw, "icebreaker"),
    "wiring-tangnano9k.svg": partial(wiring.draw, "tangnano9k"),
}
"""What draws each file, by the file's name."""


def every() -> dict[str, str]:
    """Return the SVG of every diagram by the name of its file."""
    return {name: draw() for name, draw in DRAWN.items()}


if __name__ == "__main__":
    for name, svg in every().items():
        (FOLDER / name).write_text(svg, encoding="utf-8")
        print(f"docs/diagrams/{name}")
