"""Ask the system to run the reader before others; what it grants is said, not assumed."""

from __future__ import annotations

import contextlib
import os

REALTIME = 20
"""SCHED_FIFO priority: above everything ordinary, below interrupt threads (50)."""

NICE = -10


def raise_priority() -> str:
    """Ask for real-time priority, else a lower nice value; what was granted, in words. Affects this thread and those
    that it starts later."""
    if os.name == "nt":
        return "high (priority class, set at the start)"
    if hasattr(os, "sched_setscheduler"):
        with contextlib.suppress(OSError):
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(REALTIME))
            return f"real-time (SCHED_FIFO {REALTIME})"
    if hasattr(os, "setpriority"):
        with contextlib.suppress(OSError):
            os.setpriority(os.PRIO_PROCESS, 0, NICE)
            return f"raised (nice {NICE})"
    return "normal (no right to more)"
