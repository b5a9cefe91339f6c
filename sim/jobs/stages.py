"""What takes a while is said: what is being done once it has taken a second, and how long it took at its end.

Messages go to the logger of the project at level INFO. Who wants them gives it a handler, as the command line does; in
a worker process or in a study of one's own nobody hears them.
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
    """Say what is being done in the block, and when it is done how long it took; nothing of what is soon over."""
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
