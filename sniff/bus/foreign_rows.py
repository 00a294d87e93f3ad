"""Frames of a second protocol in rows that are looked at: a stretch around a row is read when it is asked for, so that
it costs the same in ten million rows."""

from __future__ import annotations

from collections import OrderedDict

from dissectors import registry
from dissectors.manifest import Dissector
from sniff.bus.rows import Store
from sniff.bus.second_protocol import of_both
from sniff.engine.engine import Row
from sniff.engine.verdict_join import JudgedRow

BLOCK, AROUND = 64, 16
"""Rows that are read together, and those at both sides of them that a frame may reach into."""
HELD = 16
"""Blocks that are remembered."""


class ForeignRows:
    """`second`: the protocol whose frames are looked for in what the first leaves, from row `since` on."""

    def __init__(self, store: Store, second: str, since: int = 0) -> None:
        self._store, self._since = store, since
        self.second: Dissector = registry.get(second)
        self._held: OrderedDict[int, tuple[int, dict[int, list[Row]]]] = OrderedDict()  # with the last row it was of

    def of(self, no: int) -> tuple[Row, ...]:
        """Its frames that begin in a row, as rows of the same number; none in most."""
        block = no // BLOCK
        last = min((block + 1) * BLOCK + AROUND, self._store.last_no)
        known = self._held.get(block)
        if known is None or known[0] != last:
            known = self._held[block] = last, self._read(block * BLOCK - AROUND, last)
            while len(self._held) > HELD:
                self._held.popitem(last=False)
        return tuple(known[1].get(no, ()))

    def _read(self, first: int, last: int) -> dict[int, list[Row]]:
        store = self._store
        rows = (store.by_no(no) for no in range(max(first, store.first_no), last + 1))
        judged = (JudgedRow(row, None) for row in rows if row is not None)
        found: dict[int, list[Row]] = {}
        both = of_both(
            judged, store.session, self.second.name, lambda row, tx: False, lambda row, tx: True, self._since
        )
        for item, _ in both:
            found.setdefault(item.row.no, []).append(item.row)
        return found
