"""Messages about long stages of work: their name after a second, and the time that they took at their end.

Messages go to the logger of the project at level INFO. They are shown only where that logger has a handler: the
command line adds one; a worker of a cluster or a user's own study has none.
"""

import logging
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

logger = logging.getLogger("hardwall")
PATIENCE_S = 1.0


@contextmanager
def stage(doing: str) -> Iterator[None]:
    """Log the name of the block's work, and its time at the end; log nothing if it takes less than `PATIENCE_S`."""
    begins = threading.Timer(PATIENCE_S, logger.info, [f"{doing} ..."])
    begins.daemon = True
    begins.start()
    began = time.perf_counter()
    try:
        yield
    finally:
        begins.cancel()
    seconds = time.perf_counter() - began
    if seconds > PATIENCE_S:
        logger.info(f"{doing}: {seconds:.0f} s")
