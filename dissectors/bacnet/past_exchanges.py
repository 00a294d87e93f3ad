"""Exchanges that are over, by which a tracker knows repeats, late and double answers; those of columns are made late.

Of exchanges paired by columns nobody needs an object unless the tracker asks for one. So keys are numbers here, and an
exchange may be kept as a place among the rows of a run.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Sized
from typing import Any, Protocol

from dissectors.bacnet.exchange import Exchange, Key, RequestParty
from dissectors.tracker import Verdict

NO_KEY = -1
_NETS_MAX = 1 << 15
_KEPT_MOST = 1 << 17
"""Rows of blocks that are kept for exchanges nobody asked for."""

_FAILED = frozenset((Verdict.NO_RESPONSE, Verdict.DAMAGED_ANSWER))

Entry = tuple[Exchange, Verdict, int]
Net = tuple[int | None, bytes | None]


class Nets:
    """Numbers for networks and addresses behind routers, so that keys of exchanges can be compared as numbers."""

    def __init__(self) -> None:
        self._nets: list[Net] = [(None, None)]
        self._numbers: dict[Net, int] = {(None, None): 0}

    def number(self, net: Net) -> int | None:
        """The number of an address behind a router, 0 for none; None when there are too many."""
        known = self._numbers.get(net)
        if known is None and len(self._nets) < _NETS_MAX:
            known = self._numbers[net] = len(self._nets)
            self._nets.append(net)
        return known

    def code(self, key: Key) -> int:
        """A key as a number; `NO_KEY` where it has none."""
        client, server = (self.number((party.net, party.address)) for party in (key.client, key.server))
        if client is None or server is None:
            return NO_KEY
        return (((client << 8 | key.client.mac) << 15 | server) << 8 | key.server.mac) << 8 | key.invoke_id

    def key(self, code: int) -> Key:
        """The key that a number stands for."""
        (client_net, client), (server_net, server) = self._nets[code >> 39], self._nets[code >> 16 & 0x7FFF]
        return Key(
            RequestParty(code >> 31 & 0xFF, client_net, client),
            RequestParty(code >> 8 & 0xFF, server_net, server),
            code & 0xFF,
        )


class PairedRows(Protocol):
    """Exchanges of a run of rows that are over. `block`: the rows of a block, which it keeps."""

    block: Sized

    def entry(self, row: int) -> Entry:
        """The exchange that a row opened, how it ended and when."""
        ...

    def failed_at(self, row: int) -> int | None:
        """When the exchange that a row opened was over without an answer; None where it had one."""
        ...


class PastExchanges(OrderedDict[Key, Entry]):
    """Key → (exchange, verdict, end), the latest last, with what of a mapping the tracker uses.

    `nets`: numbers of addresses behind routers, the same for everything on this bus.
    """

    def __init__(self, entries: OrderedDict[Key, Entry]) -> None:
        super().__init__()
        self.nets = Nets()
        self._entries: OrderedDict[int | Key, Entry | tuple[PairedRows, int]] = OrderedDict()
        self._newest: Sized = ()  # block of the newest run
        self._kept = 0  # rows of blocks that may be kept
        for key, entry in entries.items():
            self[key] = entry

    def add(self, rows: PairedRows, codes: list[int], places: list[int], most: int) -> None:
        """Exchanges of a run, the latest last; of all at most so many are kept."""
        if rows.block is not self._newest:
            self._newest = rows.block
            self._kept += len(rows.block)
        entries = self._entries
        for code, row in zip(codes, places, strict=True):
            entries.pop(code, None)  # the latest last
            entries[code] = rows, row
        for _ in range(len(entries) - most):
            entries.popitem(last=False)

    def known(self, codes: list[int]) -> list[int]:
        """Which of these keys, by their place, an exchange has."""
        entries = self._entries
        return [place for place, code in enumerate(codes) if code in entries]

    def failed_at(self, code: int) -> int | None:
        """When the newest exchange with that key was over, if it had no answer or a damaged one; else None."""
        entry = self._entries.get(code)
        if entry is None:
            return None
        if len(entry) == 2:
            return entry[0].failed_at(entry[1])
        return entry[2] if entry[1] in _FAILED else None

    def settle(self) -> None:
        """Make all exchanges that are still places in a run, where these keep so many rows that it is time to."""
        if self._kept < _KEPT_MOST:
            return
        self._kept, self._newest = 0, ()
        for place, entry in self._entries.items():
            if len(entry) == 2:
                self._entries[place] = entry[0].entry(entry[1])

    # What the tracker asks

    def _place(self, key: Key) -> int | Key:
        code = self.nets.code(key)
        return key if code == NO_KEY else code

    def get(self, key: Key, default: Any = None) -> Any:
        """As of a mapping."""
        place = self._place(key)
        entry = self._entries.get(place)
        if entry is None:
            return default
        if len(entry) == 2:
            entry = self._entries[place] = entry[0].entry(entry[1])
        return entry

    def __contains__(self, key: object) -> bool:
        return isinstance(key, Key) and self._place(key) in self._entries

    def __len__(self) -> int:
        return len(self._entries)

    def __setitem__(self, key: Key, entry: Entry) -> None:
        self._entries[self._place(key)] = entry

    def move_to_end(self, key: Key, last: bool = True) -> None:
        """As of an ordered mapping."""
        self._entries.move_to_end(self._place(key), last)

    def popitem(self, last: bool = True) -> tuple[Key, Entry]:
        """As of an ordered mapping."""
        place, entry = self._entries.popitem(last)
        made = entry[0].entry(entry[1]) if len(entry) == 2 else entry
        return self.nets.key(place) if isinstance(place, int) else place, made
