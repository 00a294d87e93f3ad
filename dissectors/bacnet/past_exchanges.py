"""Exchanges that are over, by which a tracker knows repeats, late and double answers; those of columns come in late.

Of exchanges paired by columns nobody needs an object, unless the tracker asks: then the newest of them are made.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Iterator
from typing import Any

from dissectors.bacnet.exchange import Exchange, Key
from dissectors.bacnet.npdu_columns import Nets
from dissectors.tracker import Verdict

REMEMBERED = 256
"""Exchanges that are kept; `MstpTracker` keeps as many."""

_HELD_MOST = 4096
_FAILED_MOST = 4096
_FAILED = frozenset((Verdict.NO_RESPONSE, Verdict.DAMAGED_ANSWER))

Entry = tuple[Exchange, Verdict, int]
Newest = Callable[[set[Key], int], Iterator[tuple[Key, Entry]]]
"""Gives the newest exchanges of a run, the latest first, without keys that are in a set, at most so many."""


class PastExchanges(OrderedDict[Key, Entry]):
    """Key → (exchange, verdict, end), the latest last, as the tracker keeps them.

    `nets`: numbers of addresses behind routers, the same for everything on this bus. `failed`: numbers of keys whose
    exchange may have failed; no other has.
    """

    def __init__(self, entries: OrderedDict[Key, Entry]) -> None:
        super().__init__()
        self.nets = Nets()
        self.failed: set[int] = set()
        self._runs: list[Newest] = []
        self._held = 0
        for key, entry in entries.items():
            self[key] = entry

    def add_run(self, newest: Newest, count: int, failed: list[int]) -> None:
        """A run of `count` exchanges paired by columns, of which those with the keys `failed` had no answer."""
        self._runs.append(newest)
        self._held += count
        self.failed.update(failed)
        if self._held > _HELD_MOST:
            self.settle()

    def settle(self) -> None:
        """Make the exchanges of all runs that the tracker would still remember."""
        if not self._runs:
            return
        runs, self._runs, self._held = self._runs, [], 0
        newest: list[tuple[Key, Entry]] = []
        seen: set[Key] = set()
        for run in reversed(runs):
            if len(seen) >= REMEMBERED:
                break
            for key, entry in run(seen, REMEMBERED - len(seen)):
                seen.add(key)
                newest.append((key, entry))
        for key, entry in reversed(newest):
            super().__setitem__(key, entry)
            super().move_to_end(key)
        while super().__len__() > REMEMBERED:
            super().popitem(last=False)
        if len(self.failed) > _FAILED_MOST:
            self.failed = {self.nets.code(key) for key, entry in super().items() if entry[1] in _FAILED}

    def may_be_tried_again(self, code: int, now: int, within: int) -> bool:
        """Whether a request with that key at `now` may be a further attempt of one that failed."""
        if code not in self.failed:
            return False
        self.settle()
        entry = super().get(self.nets.key(code))
        if entry is not None and entry[1] in _FAILED and now - entry[2] < within:
            return True
        self.failed.discard(code)
        return False

    # What the tracker asks

    def get(self, key: Key, default: Any = None) -> Any:
        """As of a mapping."""
        self.settle()
        return super().get(key, default)

    def __contains__(self, key: object) -> bool:
        self.settle()
        return super().__contains__(key)

    def __len__(self) -> int:
        self.settle()
        return super().__len__()

    def __setitem__(self, key: Key, entry: Entry) -> None:
        self.settle()
        super().__setitem__(key, entry)
        if entry[1] in _FAILED:
            self.failed.add(self.nets.code(key))
