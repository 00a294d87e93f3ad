"""The turn to speak, as far as the frames before tell: by it a frame with a damaged header has a sender.

A token says who speaks next, a poll or a request who answers, silence that the one before has given up. A damaged frame
is compared with what each of those could have sent; octets may be wrong, missing or too many.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import cache, lru_cache
from operator import getitem
from typing import NamedTuple

from dissectors.bacnet.frame_types import EXPECTING, HEADER, PREAMBLE, FrameType
from dissectors.bacnet.limits import (
    BROADCAST,
    MS,
    T_NO_TOKEN,
    T_REPLY_DELAY,
    T_USAGE_DELAY,
    T_USAGE_TIMEOUT,
    T_USAGE_TIMEOUT_MAX,
)
from dissectors.checksums import crc8_mstp
from dissectors.frame import Frame, Noise
from dissectors.line import Timing

_TOKEN, _POLL, _POLL_REPLY = map(int, (FrameType.TOKEN, FrameType.POLL_FOR_MASTER, FrameType.REPLY_TO_POLL_FOR_MASTER))
_ASKING = frozenset((*EXPECTING, int(FrameType.TEST_REQUEST)))
_ANSWERING = (6, 7, 33, 4)
_OF_HOLDER = (5, 6, 32, 33)
_USE_MOST = 100 * MS  # older texts let a station wait so long for the next one

_FAR = 1 << 30  # a cost that no guess has
_ANY = -1  # an octet of which nothing is known
_ANY_COST, _SPOILT, _A_BIT, _LOST, _TOO_MANY = 2, 4, 3, 4, 5
"""What it costs to take an octet for one of which nothing is known, for one with several bits or with one bit wrong,
to miss one, to have one too many."""

_UNLIKELY, _STRANGE = 3, 6


class Speaker(NamedTuple):
    """Who sent a damaged frame, to whom, and of what type, as far as can be told."""

    source: int
    destination: int | None
    frame_type: int | None


class _Guess(NamedTuple):
    """A frame that somebody could send now; `cost` 0 where it is what should come."""

    cost: int
    frame_type: int
    destination: int  # or _ANY
    source: int


class Turn:
    """Fed the frames of a bus in order; total, and bounded by the 256 addresses.

    `holder`: who has the token, or was sent it. `passed_by`: who sent it, while unused. `asked`: type,
    source and destination of the frame that waits for its answer. `end`: ns, of the newest frame. None: not known.
    """

    __slots__ = ("_heard", "_latency", "_next", "asked", "end", "holder", "passed_by", "slack")

    def __init__(self, timing: Timing) -> None:
        self.holder: int | None = None
        self.passed_by: int | None = None
        self.asked: tuple[int, int, int] | None = None
        self.end: int | None = None
        self.slack = 0
        self._latency = timing.latency
        self._next: dict[int, int] = {}  # whom each station passed its token to last
        self._heard: set[int] = set()

    def see(self, frame: Frame, frame_type: int, source: int, destination: int) -> None:
        """A frame of which it is known who sent it."""
        self._heard.add(source)
        self._take(frame_type, source, destination)
        self.end, self.slack = frame.end, frame.slack

    def see_likely(self, frame: Frame, frame_type: int, source: int, destination: int) -> None:
        """A damaged frame, taken for what `speaker` said."""
        self._take(frame_type, source, destination)
        self.end, self.slack = frame.end, frame.slack

    def see_noise(self, noise: Noise) -> None:
        """Octets that are no frame: as many as a frame has were one of whom it was to speak."""
        if len(noise.octets) < HEADER - 3:
            return
        holder = self.holder
        if holder is not None and self.asked is None and len(noise.octets) <= HEADER + 2 and holder in self._next:
            self._take(_TOKEN, holder, self._next[holder])
        else:
            self.asked = self.passed_by = None
        self.end, self.slack = noise.end, self._latency

    def knows(self, address: int) -> bool:
        """Whether a frame of that address was ever heard."""
        return address in self._heard

    def speaker(self, frame: Frame) -> Speaker | None:
        """Who most likely sent a frame whose header is damaged; None where nothing is known of the bus."""
        octets = frame.octets[: HEADER + 2]
        made = [(guess, _expected(*guess[1:])) for guess in self._guesses(frame)]
        # what it costs at most: octet for octet, and the end lost, so that others need not be reckoned to their end
        lost = max(0, HEADER - len(octets)) * _LOST
        guesses = [(guess, header, lost + sum(map(getitem, header, octets))) for guess, header in made]
        best: _Guess | None = None
        least = min([guess.cost + plainly for guess, _, plainly in guesses], default=_FAR) + 1
        for guess, header, plainly in guesses:
            limit = least - guess.cost
            if limit <= 0:
                continue
            if limit > _LOST:
                plainly = _distance(octets, header, limit)
            if plainly < limit:
                least, best = guess.cost + plainly, guess
        if best is None:
            return None
        return Speaker(best.source, None if best.destination == _ANY else best.destination, best.frame_type)

    def _take(self, frame_type: int, source: int, destination: int) -> None:
        if frame_type == _TOKEN:
            self.holder, self.passed_by, self.asked = destination, source, None
            self._next[source] = destination
            return
        asked, self.passed_by = self.asked, None
        if frame_type == _POLL or (frame_type in _ASKING and destination != BROADCAST):
            self.holder, self.asked = source, (frame_type, source, destination)
        elif asked is not None and (source, destination) == (asked[2], asked[1]):
            self.holder, self.asked = asked[1], None
            if frame_type == _POLL_REPLY:
                self._next[asked[1]] = source
        elif frame_type != _POLL_REPLY:
            self.holder, self.asked = source, None

    def _guesses(self, frame: Frame) -> list[_Guess]:
        """All that may be said now, what should come first."""
        gap = 0 if self.end is None else max(0, frame.start - self.end)
        most, least = gap + self.slack, max(0, gap - frame.slack)
        made: list[_Guess] = []
        holder, asked = self.holder, self.asked
        if holder is None or least >= T_NO_TOKEN:
            pass
        elif asked is not None:
            kind, source, destination = asked
            waits = T_USAGE_TIMEOUT_MAX if kind == _POLL else T_REPLY_DELAY + T_USAGE_TIMEOUT_MAX
            soonest = T_USAGE_DELAY if kind == _POLL else T_REPLY_DELAY
            absent = _UNLIKELY if kind == _POLL and destination not in self._heard else 0
            late = _UNLIKELY if least > waits else 0
            types = (_POLL_REPLY,) if kind == _POLL else _ANSWERING
            made += [_Guess(absent + late, reply, source, destination) for reply in types]
            made += self._of_holder(source, 0 if most >= soonest else _UNLIKELY)
        else:
            by = self.passed_by
            is_given_up = by is not None and least > T_USAGE_TIMEOUT  # a slow one may still use it
            late = _UNLIKELY if by is not None and least > _USE_MOST else int(is_given_up)
            made += self._of_holder(holder, late)
            if by is not None:
                again = 0 if most >= T_USAGE_DELAY else _UNLIKELY
                made.append(_Guess(again, _TOKEN, holder, by))
                made += self._of_holder(by, again + (not is_given_up))
        read = frame.octets[4] if len(frame.octets) > 4 else None
        if read is not None and (read in self._heard or not made):
            made += self._of_holder(read, _STRANGE if made else 0)
            made.append(_Guess(_STRANGE if made else 0, 6, _ANY, read))
        return made

    def _of_holder(self, mac: int, cost: int) -> list[_Guess]:
        following = self._next.get(mac, _ANY)
        made = [_Guess(cost, _TOKEN, following, mac)] if following != mac else []
        made.append(_Guess(cost, _POLL, _ANY, mac))
        return made + [_Guess(cost, kind, _ANY, mac) for kind in _OF_HOLDER]

    def learn(self, following: Mapping[int, int], heard: Iterable[int]) -> None:
        """What frames taught that were not seen one by one: to whom stations passed the token, and who spoke."""
        self._next.update(following)
        self._heard.update(heard)


Header = tuple[bytes, ...]
"""What a guessed frame's header is, octet by octet: what it costs to take each octet for that one."""


@lru_cache(1 << 14)
def _expected(frame_type: int, destination: int, source: int) -> Header:
    """The header of a guessed frame."""
    crc = size = _ANY
    if frame_type <= _POLL_REPLY or frame_type == FrameType.REPLY_POSTPONED:
        size = 0
        if destination != _ANY:
            crc = crc8_mstp(bytes((frame_type, destination, source, 0, 0)))
    return tuple(map(_costs, (*PREAMBLE, frame_type, destination, source, size, size, crc)))


def _distance(octets: bytes, header: Header, limit: int) -> int:
    """What it costs to take the begin of `octets` for that header; octets after it cost nothing.

    `limit`, 1 or more, where it is that or more: a row never costs less than the one before it, so the rest need not be
    known, nor what is further from the diagonal than octets may be lost or too many for less.
    """
    least, count, reach = 0, len(octets), (limit - 1) // _LOST
    row = [at * _TOO_MANY for at in range(count + 1)]
    for number, costs in enumerate(header, 1):
        before = row
        first = max(1, number - reach)
        if first > count + 1:
            return limit
        row = [_FAR] * (count + 1)
        if number <= reach:
            row[0] = number * _LOST
        left = least = row[first - 1]
        diagonal = before[first - 1]
        for at in range(first, min(count, number + reach) + 1):
            cost, above = diagonal + costs[octets[at - 1]], before[at]
            if above + _LOST < cost:
                cost = above + _LOST
            if left + _TOO_MANY < cost:
                cost = left + _TOO_MANY
            row[at] = cost
            diagonal, left = above, cost
            if cost < least:
                least = cost
        if least >= limit:
            return limit
    return least


@cache
def _costs(wanted: int) -> bytes:
    """What it costs to take each octet for a wanted one, or for one of which nothing is known."""
    if wanted == _ANY:
        return bytes([_ANY_COST] * 256)
    costs = bytearray(_A_BIT if (wanted ^ octet).bit_count() == 1 else _SPOILT for octet in range(256))
    costs[wanted] = 0
    return bytes(costs)
