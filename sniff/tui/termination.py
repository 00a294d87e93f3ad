"""SIGTERM: who draws on a terminal is asked to end, and leaves it as it was, his recording closed.

Otherwise the system ends the process where it stands (`kill`, `timeout`, a session that is closed): a terminal at which
nobody can type, and a capture process that goes on as after a crash, with the port in its hands.
"""

from __future__ import annotations

import asyncio
import contextlib
import signal
from collections.abc import Callable


def ends_when_asked(end: Callable[[], object]) -> None:
    """From now on SIGTERM calls `end` in the loop that runs. Does nothing where loops take no signals."""
    with contextlib.suppress(NotImplementedError, RuntimeError, ValueError):
        asyncio.get_running_loop().add_signal_handler(signal.SIGTERM, end)
