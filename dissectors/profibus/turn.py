"""The turn to send, as far as the telegrams before tell: by it a damaged telegram has a sender.

After a request its slave answers, or the master goes on; after an answer, a token or what nobody answers the holder of
the token sends. What a damaged telegram says of itself decides between those who may send now, and names nobody else
but who was heard before. After octets that are no telegram the token may have gone on.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, NamedTuple

from dissectors.line import MS, Timing
from dissectors.profibus.telegram import FIXED, HIGHEST, SD4, Telegram

if TYPE_CHECKING:
    from dissectors.columns import Masks, Times

_CLAIM = 6 * 37
"""Bit times of silence after which another master may take the token: six slot times, of 37 bits at least."""

_UNUSUAL = 2
"""Times the longest pause that a master ever made before it went on; less tells of no other one."""

_PAUSE = 100 * MS
"""ns; longer ones are no pauses."""


class Speaker(NamedTuple):
    """Who sent a damaged telegram, to whom, as far as can be told. `answers`: it is the answer that is due."""

    source: int | None
    destination: int | None
    answers: bool = False


class Due(NamedTuple):
    """An answer that is due: from whom (None where the request was damaged), to whom; `may_fail`: nobody need be
    there."""

    source: int | None
    destination: int | None
    may_fail: bool


class Turn:
    """Fed the telegrams of a bus in order; total, and bounded by the addresses.

    `holders`: who may hold the token; empty: not known.
    """

    __slots__ = ("_asked", "_claim", "_end", "_heard", "_masters", "_next", "_pause", "holders")

    def __init__(self, timing: Timing) -> None:
        self.holders: frozenset[int] = frozenset()
        self._next: dict[int, int] = {}  # whom each master passed its token to last
        self._heard: set[int] = set()
        self._asked: set[int] = set()
        self._masters: set[int] = set()
        self._end: int | None = None
        self._pause = 0
        self._claim = timing.line.bits(_CLAIM)

    def see(self, telegram: Telegram, start: int, end: int, is_good: bool) -> None:
        """A telegram of which it is known what it says; of one that was put right nobody is known by it."""
        source, to = telegram.source, telegram.destination
        goes_on = telegram.is_request or (telegram.is_token and source != to)
        if is_good and goes_on and self._end is not None and start - self._end < _PAUSE:
            self._pause = max(self._pause, start - self._end)
        self._end = end
        if source is None or to is None:
            return
        if telegram.is_token or telegram.is_request:
            self.holders = frozenset((to if telegram.is_token else source,))
        if is_good and telegram.is_token:  # which has no check: nobody is known by it
            self._next[source] = to
        elif is_good:
            self._heard.add(source)
            self._asked.add(to)
            self._masters.update((source,) if telegram.is_request else ())

    def pass_by(
        self,
        sources: Iterable[int],
        masters: Iterable[int],
        destinations: Iterable[int],
        tokens: Mapping[int, int],
        holder: int,
    ) -> None:
        """Good telegrams that were seen elsewhere. `sources`, `destinations`: of checked ones; `masters`: who sent
        such requests; `tokens`: to whom each passed its last one; `holder`: at their end."""
        self._heard.update(sources)
        self._masters.update(masters)
        self._asked.update(destinations)
        self._next.update(tokens)
        self.holders = frozenset((holder,))

    def wait(self, starts: Times, ends: Times, goes_on: Masks) -> None:
        """Times of the same telegrams, ns; `goes_on`: those by who holds the token, a claim of it aside."""
        import numpy as np

        before = ends[:-1] if self._end is None else np.concatenate(([self._end], ends[:-1]))
        pauses = (starts[len(starts) - len(before) :] - before)[goes_on[len(starts) - len(before) :]]
        self._pause = max(self._pause, int(pauses[pauses < _PAUSE].max(initial=0)))
        self._end = int(ends[-1])

    def see_noise(self, end: int) -> None:
        """Octets that are no telegram: a token may have been among them."""
        self.holders |= self._following()
        self._end = end

    def speaker(self, telegram: Telegram, octets: int, start: int, end: int, due: Due | None) -> Speaker:
        """Who sent a damaged telegram of so many octets, and the turn behind it."""
        is_token = telegram.start == SD4 or octets <= FIXED[SD4]
        if due is not None and not is_token and self._is_answer(telegram, due):
            self._end = end
            said = telegram.source if telegram.source in self._heard and telegram.source != due.destination else None
            return Speaker(due.source if due.source is not None else said, due.destination, True)
        source = self._sender(telegram, self._end is not None and self._is_long(start - self._end))
        to = telegram.destination
        if source is None or source in self.holders:
            sent = self._following() if is_token else frozenset(() if source is None else (source,))
            self.holders = sent or self.holders
        self._end = end
        return Speaker(source, to if to in self._asked or to in self._heard else None)

    def _is_answer(self, telegram: Telegram, due: Due) -> bool:
        """Whether it is rather the answer than the next thing that the master says."""
        asks = telegram.is_request
        if self._is_elsewhere(telegram) and due.source != telegram.source and due.destination != telegram.destination:
            return False
        if asks and telegram.source in self._masters and telegram.source != due.destination:
            return False
        answer = (telegram.source == due.source) + (telegram.destination == due.destination) + (not asks)
        master = (telegram.source == due.destination) + (telegram.destination != due.destination) + asks
        return answer > master if due.may_fail else answer > 0 or master < 3

    def _is_elsewhere(self, telegram: Telegram) -> bool:
        """Whether it says that it is an answer between stations that are known."""
        is_answer = telegram.control is not None and not telegram.is_request
        return is_answer and telegram.source in self._heard and telegram.destination in self._masters

    def _sender(self, telegram: Telegram, is_late: bool) -> int | None:
        """Who may send now, and says so; one that says nobody's name may be of the only one who can."""
        said = telegram.source
        if self._is_elsewhere(telegram) or said in self.holders:  # the request of an answer need not have been heard
            return said
        if said in self._masters:  # the turn, or the octet, is wrong
            return None if self.holders else said
        return next(iter(self.holders)) if len(self.holders) == 1 and not is_late else None

    def _is_long(self, pause: int) -> bool:
        return pause >= max(self._claim, _UNUSUAL * self._pause)

    def _following(self) -> frozenset[int]:
        return frozenset(self._next[one] for one in self.holders if self._next.get(one, 127) <= HIGHEST)
