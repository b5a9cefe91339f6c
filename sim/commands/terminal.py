"""What people see: tables on stdout, everything else on stderr."""

import rich.table
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
from rich.text import Text

from ..jobs.result import Table

log = Console(stderr=True, highlight=False)


def show(table: Table) -> None:
    """Print a table, as wide as the terminal is; words and headings may take several lines, numbers do not."""
    drawn = rich.table.Table(
        box=SIMPLE_HEAD if table.columns else None, show_header=bool(table.columns), pad_edge=False
    )
    if table.columns:
        for place, (heading, justify) in enumerate(table.columns.items()):
            words = [row[place] for row in table.rows] + heading.split()
            numbers = max(map(len, words), default=1) if justify == "right" else None
            drawn.add_column(heading, justify=justify, overflow="fold", min_width=numbers)
    else:
        drawn.add_column(style="bold", no_wrap=True)
        drawn.add_column(overflow="fold")
    for row in table.rows:
        drawn.add_row(*map(Text, row))
    Console(highlight=False).print(drawn)


class progress:
    """A progress bar on stderr while a run lasts; gives the function that moves it."""

    def __init__(self, title: str, total: int):
        columns = TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn()
        self._bar = Progress(*columns, console=log, transient=True, disable=not log.is_terminal)
        self._task = self._bar.add_task(escape(title), total=total)

    def __enter__(self):
        self._bar.start()
        return lambda done: self._bar.update(self._task, completed=done)

    def __exit__(self, *_) -> None:
        self._bar.stop()
