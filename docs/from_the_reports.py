"""What pages take from `docs/results/reports/`: a line `%report NAME... VIEW%` becomes a table of reports, see `views`.

A report that is not there, a view that is none, or a report that the schema of its command does not know is a warning,
and so fails the build.
"""

import re

import views
from sphinx.application import Sphinx
from sphinx.util import logging

log = logging.getLogger(__name__)
LINE = re.compile(r"^%report ([\w-]+(?: [\w-]+)*) ([\w-]+)%$", re.MULTILINE)


def shown(names: str, view: str) -> str:
    """Return a table of reports, and where they come from."""
    try:
        return "\n".join(views.shown(names.split(), view))
    except views.UnknownError as error:
        log.warning("%%report %s %s%%: %s", names, view, error)
        return ""


def fill(_: Sphinx, __: str, source: list[str]) -> None:
    """Put the tables where a page wants them."""
    source[0] = LINE.sub(lambda match: shown(match[1], match[2]), source[0])


def setup(app: Sphinx) -> dict[str, bool]:
    """Add the tables to Sphinx."""
    app.connect("source-read", fill)
    return {"parallel_read_safe": True}
