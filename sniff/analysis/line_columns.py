"""Tables as the line's findings see them: which rows are nothing but good frames, and who sent them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from dissectors.columns import DAMAGES, NONE, ROLES, Masks, Small, Times
from dissectors.frame import Damage, Role
from sniff.analysis.sender_findings import BUS, MASTER, Senders
from sniff.analysis.time_patterns import is_struck
from sniff.engine.table import Table

_OF_BUS, _OF_MASTER = -2, -3
_HEADER = DAMAGES.index(Damage.HEADER)
_REQUEST, _RESPONSE, _BROADCAST = (ROLES.index(role) for role in (Role.REQUEST, Role.RESPONSE, Role.BROADCAST))


@dataclass(frozen=True, slots=True)
class LineColumns:
    """A table for the line's findings.

    `plain`: good frames of which the columns say all. `sender`: of each row, its address, or who it is without one
    (`name`). `asks`: whether a master without an address sent it. `decisive`: place of the newest request or answer
    up to each row, -1 for none. `sound`: places of good frames without line errors. `broadcast`: of good broadcasts.
    """

    table: Table
    plain: Masks
    sender: Small
    asks: Masks
    decisive: Times
    sound: Times
    broadcast: Times

    @classmethod
    def of(cls, table: Table) -> LineColumns:
        """What a table holds."""
        frames, placed, good = table.frames, table.placed, table.good
        has_place = placed.tx != 0
        role = np.where(has_place, placed.role, frames.role)
        sender = np.where(has_place, placed.source, frames.source)
        master = (role == _REQUEST) | (role == _BROADCAST)
        sender = np.where(sender == NONE, np.where(master, _OF_MASTER, _OF_BUS), sender).astype(np.int16)
        sender[~table.is_frame | (frames.damage == _HEADER)] = _OF_BUS
        plain, sound = good.copy(), good.copy()
        for place, row in table.odd.items():
            plain[place] = False
            sound[place] &= not is_struck(row.event)
            if sender[place] == _OF_MASTER:  # a plug-in may give addresses that are in no column
                sender[place] = _OF_MASTER if _has_no_sender(row.placement, row.header) else _OF_BUS
        decides = has_place & ((placed.role == _REQUEST) | (placed.role == _RESPONSE))
        decisive = np.maximum.accumulate(np.where(decides, np.arange(len(table)), -1))
        broadcast = np.flatnonzero(good & has_place & (placed.role == _BROADCAST))
        return cls(table, plain, sender, sender == _OF_MASTER, decisive, np.flatnonzero(sound), broadcast)

    def name(self, code: int, nouns: Callable[[str], str]) -> str:
        """Who a code in `sender` stands for."""
        if code == _OF_BUS:
            return BUS
        return MASTER if code == _OF_MASTER else f"{nouns(self.table.protocol)} {code}"

    def is_new(self, senders: Senders, nouns: Callable[[str], str]) -> Masks:
        """bool[n]: the first of the plain frames of each sender that is not known: they are taken one by one, so that
        all are known in the order of first sight."""
        new: Masks = np.zeros(len(self.table), bool)
        codes, firsts = np.unique(self.sender[self.plain], return_index=True)
        unknown = [self.name(code, nouns) not in senders.by_name for code in codes.tolist()]
        new[np.flatnonzero(self.plain)[firsts[np.array(unknown, bool)]]] = True
        return new

    def sent(self, plain: Masks, nouns: Callable[[str], str]) -> Iterator[tuple[str, int, int]]:
        """Who sent some of the rows, how many frames and octets each."""
        codes, which = np.unique(self.sender[plain], return_inverse=True)
        counts = np.bincount(which, minlength=len(codes))
        octets = np.bincount(which, self.table.frames.length[plain], len(codes))
        for code, count, of_sender in zip(codes.tolist(), counts.tolist(), octets.tolist(), strict=True):
            yield self.name(code, nouns), count, int(of_sender)

    def role_before(self, begin: int, end: int) -> Role | None:
        """REQUEST or RESPONSE, whatever came last in rows [begin, end); None where there is neither."""
        place = int(self.decisive[end - 1])
        return None if place < begin else ROLES[self.table.placed.role[place]]

    def runs(self, plain: Masks) -> Iterator[tuple[int, int, int | None]]:
        """Rows [begin, end) that are plain, may be none, and the place behind them that is not; None at the end."""
        begin = 0
        for place in np.flatnonzero(~plain).tolist():
            yield begin, place, place
            begin = place + 1
        yield begin, len(plain), None


def _has_no_sender(placement: object, header: object) -> bool:
    told = placement if placement is not None else header
    return getattr(told, "source", None) is None
