"""Telegrams among many that mean nothing but themselves: data exchange that goes on, tokens in turn, GAP polls.

A *unit* is a token, a Global_Control without Clear, a request and its answer in the next row, or a poll that nobody
answers. It is regular where what it says follows from its columns and from the one thing that a watch knows before it,
who holds the token:

    data exchange   answered, not refused, its slave's request before it, too; not the telegram before once more
    token           from its holder to another one, not said twice
    all             sent by who holds the token

What a slave's first exchange of some rows says, and the first one after anything else, the watch must see.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from dissectors.columns import NONE, ROLES
from dissectors.frame import Role
from dissectors.profibus.control import FCB, FCV, Status
from dissectors.profibus.parameters import CLEAR
from dissectors.profibus.services import Service
from dissectors.profibus.telegram import HIGHEST, SD2

if TYPE_CHECKING:
    from dissectors.columns import Masks, Times
    from dissectors.row_columns import RowColumns

_REQUEST, _POLL, _RESPONSE, _TO_ALL, _TOKEN, _DATA = (
    ROLES.index(role) for role in (Role.REQUEST, Role.POLL, Role.RESPONSE, Role.BROADCAST, Role.TOKEN, Role.DATA)
)
_URGENT = tuple(status.value for status in Status if status.is_urgent)
_GLOBAL_CONTROL_LENGTH, _COMMAND_AT = 13, 9


@dataclass(frozen=True, slots=True)
class Units:
    """Regular units in their order. `request`, `last`: rows. `answered`: by the row behind; `token`, `poll`,
    `exchange`: what it is, `to_all` where none of them. `urgent`: the answer is of high priority."""

    request: Times
    last: Times
    answered: Masks
    token: Masks
    poll: Masks
    exchange: Masks
    urgent: Masks
    source: Times
    destination: Times

    def __len__(self) -> int:
        return len(self.request)

    @classmethod
    def of(cls, rows: RowColumns) -> Units:
        """Among some rows."""
        return _Rows(rows).units()

    def take(self, which: Masks) -> Units:
        """Some of them."""
        return Units(*(getattr(self, name)[which] for name in self.__slots__))


class _Rows:
    """Rows, and what they may be."""

    def __init__(self, rows: RowColumns) -> None:
        self._rows, self._frames = rows, rows.frames
        frames = rows.frames
        fine = rows.good & rows.is_frame & frames.ok
        if rows.odd:
            fine[list(rows.odd)] = False
        role = np.where(fine, frames.role, NONE)
        self._role, self._row = role, np.arange(len(rows))
        self._source, self._destination = frames.source.astype(np.int64), frames.destination.astype(np.int64)
        self._asks = ((role == _REQUEST) | (role == _POLL)) & (self._destination <= HIGHEST)
        self._answered = self._find_answered()
        self._good = self._answered & (np.append(frames.error[1:], np.zeros(min(1, len(rows)), np.uint16)) == 0)
        self._token = role == _TOKEN
        self._newest_token = self._before(self._token)

    def units(self) -> Units:
        exchange, poll, token = self._exchanges(), self._polls(), self._tokens()
        rows = np.flatnonzero(exchange | poll | token | self._controls())
        rows = rows[self._are_in_turn(rows)]
        answered = self._answered[rows]
        behind = np.minimum(rows + 1, max(len(self._row) - 1, 0))
        return Units(
            rows,
            rows + answered,
            answered,
            token[rows],
            poll[rows],
            exchange[rows],
            answered & np.isin(self._frames.function[behind], _URGENT),
            self._source[rows],
            self._destination[rows],
        )

    def _before(self, which: Masks) -> Times:
        """For each row the newest before it that is one of those, or NONE."""
        newest = np.full(len(which), NONE, np.int64)
        newest[1:] = np.maximum.accumulate(np.where(which, self._row, NONE))[:-1]
        return newest

    def _find_answered(self) -> Masks:
        """Which requests the next row answers."""
        answered = np.zeros(len(self._row), bool)
        to, by = self._destination, self._source
        named = (by[1:] == to[:-1]) & (to[1:] == by[:-1])
        answered[:-1] = self._asks[:-1] & (self._role[1:] == _RESPONSE) & (named | (by[1:] == NONE))
        return answered

    def _exchanges(self) -> Masks:
        """Data exchange with a slave that was exchanging data before."""
        names = self._frames.names
        if Service.DATA_EXCHANGE.value not in names:
            return np.zeros(len(self._row), bool)
        good = self._good & (self._role == _REQUEST)
        good &= self._frames.kind == names.index(Service.DATA_EXCHANGE.value)
        asked = np.flatnonzero(self._asks & (self._role == _REQUEST))
        order = asked[np.argsort(self._destination[asked], kind="stable")]
        goes_on = np.zeros(len(self._row), bool)
        same = self._destination[order[1:]] == self._destination[order[:-1]]
        goes_on[order[1:]] = same & good[order[:-1]]
        exchange = np.flatnonzero(good & goes_on)
        control = self._rows.octets[self._body(exchange) + 2]
        exchange = exchange[(control & (FCB | FCV)) != FCB]
        exchanges = np.zeros(len(self._row), bool)
        exchanges[exchange[~self._are_again(exchange)]] = True
        return exchanges

    def _body(self, rows: Times) -> Times:
        offset = self._frames.offset[rows]
        return offset + np.where(self._rows.octets[offset] == SD2, 4, 1)

    def _are_again(self, rows: Times) -> Masks:
        """Which may be the telegram before once more, as far as its head, length and sum tell."""
        frames, octets = self._frames, self._rows.octets
        sends = (self._role == _REQUEST) | (self._role == _POLL) | (self._role == _TO_ALL) | (self._role == _DATA)
        before = self._before(sends)[rows]
        again: Masks = (before >= 0) & (self._newest_token[rows] < before)
        before = np.maximum(before, 0)
        sums = [octets[frames.offset[some] + frames.length[some] - 2] for some in (rows, before)]
        again &= (frames.length[rows] == frames.length[before]) & (sums[0] == sums[1])
        at, other = self._body(rows), self._body(before)
        for place in range(3):
            again &= octets[at + place] == octets.take(other + place, mode="clip")
        return again

    def _polls(self) -> Masks:
        """GAP polls with a good answer, or with none in the next row."""
        silent = np.zeros(len(self._row), bool)
        silent[:-1] = self._role[1:] >= 0
        silent[:-1] &= self._role[1:] != _RESPONSE
        polls: Masks = self._asks & (self._role == _POLL) & (self._good | silent)
        return polls

    def _tokens(self) -> Masks:
        """Tokens, but those of one that gave it to itself before, and now gives it to another one."""
        token: Masks = self._token.copy()
        twice = self._token[1:] & self._token[:-1] & (self._source[1:] == self._source[:-1])
        token[1:] &= ~(twice & (self._destination[1:] != self._destination[:-1]))
        return token

    def _controls(self) -> Masks:
        """Global_Control that does not clear."""
        names = self._frames.names
        controls = np.zeros(len(self._row), bool)
        if Service.GLOBAL_CONTROL.value in names:
            to_all = (self._role == _TO_ALL) & (self._frames.kind == names.index(Service.GLOBAL_CONTROL.value))
            rows = np.flatnonzero(to_all & (self._frames.length == _GLOBAL_CONTROL_LENGTH))
            rows = rows[self._frames.count[rows] == 2]
            controls[rows] = self._rows.octets[self._frames.offset[rows] + _COMMAND_AT] & CLEAR == 0
        return controls

    def _are_in_turn(self, rows: Times) -> Masks:
        """Whether who sends holds the token; where none was passed yet, the same as before."""
        token, source = self._newest_token[rows], self._source[rows]
        before = np.append(source[:1], source[:-1])
        in_turn: Masks = source == np.where(token >= 0, self._destination[np.maximum(token, 0)], before)
        return in_turn
