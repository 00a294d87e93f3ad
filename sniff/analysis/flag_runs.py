"""Runs of error flags: whether a flag covers one octet or a whole read, seen from which octets are marked. Pure.

Some adapters tell only that there was an error somewhere in a USB packet, and then all its octets are marked. A capture
that names its adapter says so. In one that does not, the marks do: they come in long runs, which go on into frames
whose check agrees, where an error of one octet would have spoilt the check.
"""

from __future__ import annotations

RUN_LEAST = 4
"""So many marked octets in a row are a long run: a wrong parity setting marks half of all, hardly four together."""

GOOD_LEAST = 2
"""So many long runs in good frames prove that a mark is not the octet's own."""


class FlagRuns:
    """Fed all rows in their order; `cover_reads` may be asked at any time."""

    def __init__(self) -> None:
        self._runs = self._long = self._in_good = 0
        self._run = 0  # octets of the run under way
        self._is_in_good = False  # whether it touches a good frame

    def see(self, marked: list[int], octets: int, is_good: bool) -> None:
        """Take the next row. `marked`: offsets of its marked octets, ascending; `octets`: how many it has."""
        before = -1
        for offset in marked:
            if offset != before + 1:
                self._end()
            self._run += 1
            self._is_in_good |= is_good
            before = offset
        if before + 1 != octets:
            self._end()

    @property
    def cover_reads(self) -> bool:
        """Whether marks cover more than the octets with an error."""
        return self._in_good >= GOOD_LEAST and 4 * self._long >= 3 * self._runs

    def _end(self) -> None:
        if self._run:
            self._runs += 1
            if self._run >= RUN_LEAST:
                self._long += 1
                self._in_good += self._is_in_good
        self._run, self._is_in_good = 0, False
