"""What is new in a ring in each of some stretches of rows, as flat numbers: for a line a second in a recording.

Whoever watches the ring notes what happens by row (`RingJournal`), one by one or many at once; so a table of an hour is
watched as a whole, and its seconds are counted afterwards.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum, auto
from typing import TYPE_CHECKING

from dissectors.bacnet.ring import order_of
from dissectors.line import MS

if TYPE_CHECKING:
    from dissectors.columns import Times

Numbers = Mapping[str, int | float]

ADDRESSES = 256

MOST = 1 << 62
"""ns; the times of a damaged file may lie further apart."""


class Happening(Enum):
    """What is noted, with its value."""

    PASSED = auto()  # the token, by a station; to whom
    RECEIVED = auto()  # the token, not as a repeat
    LOOP = auto()  # ns from token to token
    USE = auto()  # ns from the token to its first frame
    RETRY = auto()  # a token sent again by a station
    UNANSWERED = auto()  # a poll of a station
    WASTED = auto()  # ns, by a poll of a station
    POSTPONED = auto()  # an answer of a station
    LOST = auto()  # a token


_COUNTED = (Happening.RECEIVED, Happening.RETRY, Happening.UNANSWERED, Happening.POSTPONED)


@dataclass(frozen=True, slots=True)
class _Noted:
    """What happened of one kind: row, station and value of each, in the order of rows."""

    no: Times
    mac: Times
    value: Times

    def between(self, begin: int, end: int) -> _Noted:
        return _Noted(self.no[begin:end], self.mac[begin:end], self.value[begin:end])


class RingJournal:
    """What happens in a ring, until somebody asks."""

    def __init__(self) -> None:
        self._single: defaultdict[Happening, list[tuple[int, int, int]]] = defaultdict(list)
        self._many: defaultdict[Happening, list[_Noted]] = defaultdict(list)
        self._newest: dict[int, int] = {}  # to whom each station passed the token last
        self._masters = 0
        self._end: int | None = None

    def note(self, what: Happening, no: int, mac: int, value: int = 0) -> None:
        """It happened in a row."""
        self._single[what].append((no, mac, min(max(value, 0), MOST)))

    def note_many(self, what: Happening, no: Times, mac: Times, value: Times | None = None) -> None:
        """It happened in each of some rows."""
        import numpy as np

        if len(no):
            self._many[what].append(_Noted(no, mac, np.zeros(len(no), np.int64) if value is None else value))

    def windows(self, stops: Sequence[tuple[int, int]], first: int | None) -> list[MstpRingWindow]:
        """What is new before each of some rows, and not before the one named before it; all of it is forgotten then.

        `stops`: numbers of rows, ascending, with the end of all rows before, ns. `first`: begin of the first row, ns.
        """
        import numpy as np

        before = np.array([no for no, _ in stops], np.int64)
        noted = {what: self._taken(what, stops[-1][0]) for what in Happening}
        masters = self._masters_by(noted[Happening.PASSED], before)
        whole = _Windows(noted, before)
        made: list[MstpRingWindow] = []
        for at, (_, end) in enumerate(stops):
            begin = first if self._end is None else self._end
            self._end = None if begin is None else max(begin, end)
            made.append(MstpRingWindow(whole, at, masters[at], 0 if begin is None else max(0, end - begin)))
        return made

    def _taken(self, what: Happening, stop: int) -> _Noted:
        """What is noted of rows before one; the rest stays."""
        import numpy as np

        single = np.array(self._single.pop(what, []), np.int64).reshape(-1, 3)
        parts = [_Noted(single[:, 0], single[:, 1], single[:, 2]), *self._many.pop(what, ())]
        no, mac, value = (
            np.concatenate([getattr(part, name) for part in parts]).astype(np.int64) for name in ("no", "mac", "value")
        )
        if (no[1:] < no[:-1]).any():
            order = np.argsort(no, kind="stable")
            no, mac, value = no[order], mac[order], value[order]
        whole, end = _Noted(no, mac, value), int(np.searchsorted(no, stop))
        if end < len(no):
            self._many[what].append(whole.between(end, len(no)))
        return whole.between(0, end)

    def _masters_by(self, passed: _Noted, before: Times) -> list[int]:
        """How many stations the ring has by each of some rows."""
        import numpy as np

        masters, at = [], 0
        ways = list(zip(passed.mac.tolist(), passed.value.tolist(), strict=True))
        for stop in np.searchsorted(passed.no, before).tolist():
            newest = dict(ways[at:stop])
            if newest and newest.items() - self._newest.items():
                self._newest |= newest
                self._masters = len(order_of(self._newest))
            masters.append(self._masters)
            at = stop
        return masters


class _Windows:
    """What was noted, by window and station."""

    def __init__(self, noted: Mapping[Happening, _Noted], before: Times) -> None:
        import numpy as np

        self.count = len(before)
        at = {what: np.searchsorted(before, one.no, side="right") for what, one in noted.items()}
        self.totals = {what: np.bincount(where, minlength=self.count).tolist() for what, where in at.items()}
        wasted = np.bincount(at[Happening.WASTED], noted[Happening.WASTED].value, self.count)
        self.wasted: list[int] = wasted.astype(np.int64).tolist()  # exact: sums below 2**53
        self.keys = {what: np.sort(at[what] * ADDRESSES + noted[what].mac) for what in _COUNTED}
        loop, use = noted[Happening.LOOP], noted[Happening.USE]
        self.loops = _Grouped(at[Happening.LOOP] * ADDRESSES + loop.mac, loop.value)
        self.all_loops = _Grouped(at[Happening.LOOP], loop.value)
        self.uses = _Grouped(at[Happening.USE] * ADDRESSES + use.mac, use.value)

    def times(self, what: Happening, key: int) -> int:
        """How often it happened in a window to a station."""
        begin, end = self.keys[what].searchsorted([key, key + 1])
        return int(end - begin)


class _Grouped:
    """Values by group, to be asked for their middle and their greatest."""

    def __init__(self, groups: Times, values: Times) -> None:
        import numpy as np

        order = np.lexsort((values, groups))
        self._groups, self._values = groups[order], np.maximum(values[order], 0)

    def told(self, name: str, group: int) -> Numbers:
        """Times of a group, ms; nothing where there are none."""
        begin, end = (int(self._groups.searchsorted(group, side)) for side in ("left", "right"))
        if begin == end:
            return {}
        middle = begin + (end - begin + 1) // 2 - 1
        return {f"{name}_p50_ms": int(self._values[middle]) / MS, f"{name}_max_ms": int(self._values[end - 1]) / MS}


@dataclass(frozen=True, slots=True)
class MstpRingWindow:
    """One stretch of rows. Names say the unit; times that nothing is known of are absent."""

    _whole: _Windows
    _at: int
    _masters: int
    _span: int

    @property
    def bus(self) -> Numbers:
        """Of the whole ring."""
        whole, at = self._whole, self._at
        return {
            "ring_masters": self._masters,
            "tokens": whole.totals[Happening.PASSED][at],
            "token_retries": whole.totals[Happening.RETRY][at],
            "tokens_lost": whole.totals[Happening.LOST][at],
            "poll_waste": min(1.0, whole.wasted[at] / self._span) if self._span else 0.0,
            **whole.all_loops.told("loop", at),
        }

    def of(self, address: int) -> Numbers:
        """Of a station that got the token or polled; empty for any other."""
        whole, key = self._whole, self._at * ADDRESSES + address
        if not 0 <= address < ADDRESSES:
            return {}
        tokens, retries, unanswered, postponed = (whole.times(what, key) for what in _COUNTED)
        if not (tokens or unanswered):
            return {}
        return {
            "tokens": tokens,
            "token_retries": retries,
            "polls_unanswered": unanswered,
            "postponed": postponed,
            **whole.loops.told("loop", key),
            **whole.uses.told("token_use", key),
        }
