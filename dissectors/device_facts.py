"""What a judge can be told of devices that stands in their manuals, and nowhere on the line."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol, runtime_checkable

ExceptionWords = Callable[[int, int], str]
"""Station and exception code → what the manual of that device says of the code; empty where it is not known."""


@runtime_checkable
class WordsExceptions(Protocol):
    """A judge that can be told how makers word exception codes: what they mean in the standard may be untrue there."""

    def word_exceptions(self, words: ExceptionWords) -> None:
        """Use these words from here on, also for what was seen before."""
        ...


@runtime_checkable
class KnowsStations(Protocol):
    """A judge that can be told of which stations the device's manual says what numbers it can be given, so that the
    standard's range is not theirs."""

    def know_stations(self, said: Callable[[int], bool]) -> None:
        """Use these from here on, also for what was seen before."""
        ...


@runtime_checkable
class KnowsResponseTimes(Protocol):
    """A judge that can be told how long each station may take to answer by the manual of its device."""

    def know_response_times(self, most: Callable[[int], int | None]) -> None:
        """`most(station)`: ns, None where nobody says. Use it from here on."""
        ...


@runtime_checkable
class KnowsUnexecuted(Protocol):
    """A judge that can be told what a device acknowledges and does not do, by its manual."""

    def know_unexecuted(self, ignores: Callable[[int, str, str], bool]) -> None:
        """`ignores(station, kind of exchange, kind of object)`. Use it from here on."""
        ...
