"""Interruption by the user or the system: signals that end a command in good order."""

from __future__ import annotations

import contextlib
import signal
from collections.abc import Iterator

_collecting: list[list[int]] = []
"""What the outermost collects, while there is one."""


@contextlib.contextmanager
def until_interrupted() -> Iterator[list[int]]:
    """Collect SIGINT and SIGTERM instead of dying of them; the list holds their numbers. Within another it is that
    one's list: what came before is not forgotten."""
    if _collecting:
        yield _collecting[0]
        return
    caught: list[int] = []
    numbers = [signal.SIGINT, signal.SIGTERM]
    before = [signal.signal(number, lambda received, _frame: caught.append(received)) for number in numbers]
    _collecting.append(caught)
    try:
        yield caught
    finally:
        _collecting.clear()
        for number, handler in zip(numbers, before, strict=True):
            signal.signal(number, handler)


def is_interrupted() -> bool:
    """Whether a signal was collected that somebody is yet to heed."""
    return any(_collecting)
