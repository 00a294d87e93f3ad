"""With how much a property is tried: all where one searches (`HYPOTHESIS_PROFILE=thorough`), some in the suite."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import TypeVar

T = TypeVar("T")


IS_SEARCH = os.environ.get("HYPOTHESIS_PROFILE") == "thorough"


MOST_READS = 6000 if IS_SEARCH else 1000
"""Of a capture that is read in two ways to be compared: all but one have fewer than 6000."""


def seeds(many: int, usual: int = 1) -> range:
    """The seeds 0 … of a run: `many` in a search, `usual` in the suite."""
    return range(many if IS_SEARCH else usual)


def examples(many: int) -> int:
    """Examples of a property for which the usual number is too few: `many` in a search, a sixth in the suite."""
    return many if IS_SEARCH else max(12, many // 6)


def some(things: Sequence[T], every: int) -> Sequence[T]:
    """All of them in a search, every n-th in the suite."""
    return things if IS_SEARCH else things[::every]


def in_turn(things: Sequence[T], place: int, of: int) -> Sequence[T]:
    """What one of several tests takes that ask much the same of many things: all in a search; in the suite each thing
    goes to every `of`-th of the tests, to each of which belongs a `place` (0 …)."""
    return things if IS_SEARCH else things[place % of :: of]
