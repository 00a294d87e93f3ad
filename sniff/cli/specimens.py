"""What rows say that depends on their octets: rows that are alike share one specimen, which is asked.

Alike are rows of the same octets of which the same was made, between the same stations. Of lines of text those are
alike too that differ only where a stencil (`dissectors/stencil.py`) says that nothing is read, or a plain number.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from dissectors.columns import ROLES, Masks, Octets, Times
from dissectors.frame import Frame
from dissectors.stencil import Form, Stencil, Stencils
from sniff.cli.byte_columns import stretches
from sniff.engine.engine import Row
from sniff.engine.table import Table, rows_at

MOST = 1 << 17
"""Specimens that are remembered."""

_LONGEST = 300
"""Octets of rows that are looked at by columns."""

Words = npt.NDArray[np.uint64]


@dataclass(slots=True)
class _Class:
    """Specimens of one length and stencil, by the words that rows share with them; found fast by ascending hashes,
    where no two have the same."""

    hashes: Words
    shared: Words
    numbers: Times
    by_words: dict[bytes, int]

    @classmethod
    def empty(cls, shared: Words) -> _Class:
        """One without specimens."""
        return cls(np.zeros(0, np.uint64), shared[:0], np.zeros(0, np.int64), {})

    def find(self, hashes: Words, shared: Words) -> Times:
        """Their numbers; `_UNKNOWN` where they are not found so."""
        if not len(self.hashes):
            return np.full(len(hashes), _UNKNOWN, np.int64)
        place = np.minimum(np.searchsorted(self.hashes, hashes), len(self.hashes) - 1)
        same = (self.shared[place] == shared).all(axis=1)
        which: Times = np.where(same, self.numbers[place], _UNKNOWN)
        return which

    def learn(self, hashes: Words, shared: Words, which: Times, rows: list[int]) -> None:
        """Find some rows fast from now on."""
        everything = np.concatenate([self.hashes, hashes[rows]])
        distinct, firsts = np.unique(everything, return_index=True)
        self.hashes = distinct
        self.shared = np.concatenate([self.shared, shared[rows]])[firsts]
        self.numbers = np.concatenate([self.numbers, which[rows]])[firsts]


@dataclass(slots=True)
class Numbers:
    """Rows whose lines hold numbers that are not their specimen's: `at`, places in what was asked for, all with the
    same `forms`; the numbers as they lie on the wire, uint8[n, octets] each."""

    at: Times
    forms: tuple[Form, ...]
    values: list[Octets]


@dataclass(slots=True)
class Found:
    """`which`: the specimen of each row, by number. `numbers`: rows with numbers of their own."""

    which: Times
    numbers: list[Numbers] = field(default_factory=list)


class Specimens:
    """Finds the specimen of each row. Specimens are numbered as they are asked.

    `ask(row, stencil)`: puts what a specimen says to the end of the caller's list and gives true; or gives false where
    the stencil does not hold, and is asked again without it.
    """

    def __init__(self, ask: Callable[[Row, Stencil | None], bool], stencils: Stencils | None = None) -> None:
        self._ask = ask
        self._stencils = stencils
        self._classes: dict[tuple[int, Stencil | None], _Class] = {}
        self._count = 0
        self.asked = 0

    @property
    def is_full(self) -> bool:
        """Whether it should be emptied before more is asked."""
        return self.asked >= MOST

    def clear(self) -> None:
        """Forget all."""
        self._classes.clear()
        self._count = self.asked = 0

    def find(self, table: Table, at: Times) -> Found:
        """Of rows at some places of a table; odd rows have none (-1)."""
        found = Found(np.full(len(at), -1, np.int64))
        lengths = table.frames.length[at].astype(np.int64)
        usual = np.ones(len(at), bool)
        if table.odd:
            usual &= ~np.isin(at, np.fromiter(table.odd, np.int64, len(table.odd)))
        for length in np.flatnonzero(np.bincount(lengths[usual & (lengths <= _LONGEST)])).tolist():
            rows = np.flatnonzero(usual & (lengths == length))
            self._find_of(table, at, rows, length, found)
        return found

    def _find_of(self, table: Table, at: Times, rows: Times, length: int, found: Found) -> None:
        octets = stretches(table.octets, table.frames.offset[at[rows]], length)
        made = _made_of(table, at[rows])
        left = np.ones(len(rows), bool)
        for stencil, inside in self._stencilled(table, at[rows], octets, length):
            chosen = np.flatnonzero(inside)
            blank = octets[chosen]
            blank[:, list(stencil.unread)] = 0
            for begin, form in stencil.numbers:
                blank[:, begin : begin + form.octets] &= ~np.frombuffer(form.mask, np.uint8)
            shared = np.concatenate([_words(blank), made[chosen]], axis=1)
            which = self._look_up(table, at[rows[chosen]], (length, stencil), shared)
            known = which >= 0
            chosen, which = chosen[known], which[known]
            found.which[rows[chosen]] = which
            left[chosen] = False
            if stencil.numbers and len(chosen):
                values = [octets[chosen, begin : begin + form.octets] for begin, form in stencil.numbers]
                found.numbers.append(Numbers(rows[chosen], tuple(form for _, form in stencil.numbers), values))
        chosen = np.flatnonzero(left)
        if len(chosen):
            shared = np.concatenate([_words(octets[chosen]), made[chosen]], axis=1)
            found.which[rows[chosen]] = self._look_up(table, at[rows[chosen]], (length, None), shared)

    def _stencilled(self, table: Table, at: Times, octets: Octets, length: int) -> list[tuple[Stencil, Masks]]:
        """Stencils that may fit rows of one length, and which."""
        if self._stencils is None:
            return []
        frames = table.frames
        plain = table.good[at] & frames.ok[at] & (frames.error[at] == 0)
        if not plain.any():
            return []
        roles, kinds = table.shown("role")[at].astype(np.int64), frames.kind[at].astype(np.int64)
        classes = roles << 16 | kinds
        fitting: list[tuple[Stencil, Masks]] = []
        for one in np.unique(classes[plain]).tolist():
            stencil = self._stencils(ROLES[one >> 16], frames.names[one & 0xFFFF], length)
            if stencil is None:
                continue
            inside = plain & (classes == one)
            for place, mask, value in stencil.needs:
                inside &= octets[:, place] & mask == value
            for begin, form in stencil.numbers:
                if form is Form.REAL:  # what is no finite number is a word
                    inside &= (octets[:, begin] & 0x7F != 0x7F) | (octets[:, begin + 1] & 0x80 == 0)
                elif form is Form.INSTANCE:
                    bits = np.frombuffer(form.mask, np.uint8)
                    inside &= (octets[:, begin : begin + form.octets] & bits != bits).any(axis=1)
            if inside.any():
                fitting.append((stencil, inside))
        return fitting

    def _look_up(self, table: Table, at: Times, of: tuple[int, Stencil | None], shared: Words) -> Times:
        """The specimen of each row; -1 where a stencil does not hold."""
        hashes = _hashed(shared)
        known = self._classes.setdefault(of, _Class.empty(shared))
        which = known.find(hashes, shared)
        while len(unknown := np.flatnonzero(which == _UNKNOWN)):
            some = unknown[:_FEW] if len(known.by_words) < _FEW else unknown  # the first teach most of the rest
            keys = [one.tobytes() for one in shared[some]]
            new = {key: row for row, key in zip(some.tolist(), keys, strict=True) if key not in known.by_words}
            for key, row in zip(new, rows_at(table, at[list(new.values())].tolist()), strict=True):
                known.by_words[key] = self._asked(row, of[1])
            which[some] = [known.by_words[key] for key in keys]
            if len(some) < len(unknown):
                known.learn(hashes, shared, which, list(new.values()))
                which[unknown] = known.find(hashes[unknown], shared[unknown])
            elif new:
                known.learn(hashes, shared, which, list(new.values()))
        return which

    def _asked(self, row: Row, stencil: Stencil | None) -> int:
        self.asked += 1
        if not self._ask(row, stencil):
            return -1
        self._count += 1
        return self._count - 1


_UNKNOWN = -2
_FEW = 1024


def _made_of(table: Table, at: Times) -> Words:
    """What was made of rows, and whom their exchange says they are between."""
    frames, placed = table.frames, table.placed
    made = (frames.check[at].astype(np.int64) << 16 | frames.found[at].astype(np.int64) << 8) | frames.damage[at]
    whole = made << 33 | (frames.expected[at].astype(np.int64) + 1)
    ways = (placed.source[at].astype(np.int64) + 1) << 16 | (placed.destination[at].astype(np.int64) + 1)
    between = np.where(placed.tx[at] > 0, ways << 8 | placed.role[at], -1)
    return np.stack([whole, between << 8 | frames.role[at]], axis=1).view(np.uint64)


def _words(octets: Octets) -> Words:
    """Rows of octets as words, zeros behind."""
    size = -(-octets.shape[1] // 8)
    padded = np.zeros((len(octets), 8 * size), np.uint8)
    padded[:, : octets.shape[1]] = octets
    return padded.view(np.uint64)


def _hashed(shared: Words) -> Words:
    hashes = np.zeros(len(shared), np.uint64)
    for column in range(shared.shape[1]):
        hashes = (hashes ^ shared[:, column]) * np.uint64(0x9E3779B97F4A7C15)
        hashes ^= hashes >> np.uint64(29)
    return hashes


def with_numbers(row: Row, stencil: Stencil, numbers: Sequence[bytes], unread: int) -> Row:
    """The row with other octets where a stencil says that they are not read (`unread`), or are plain numbers."""
    assert isinstance(row.event, Frame)
    octets = bytearray(row.event.octets)
    for place in stencil.unread:
        octets[place] ^= unread
    for (begin, form), number in zip(stencil.numbers, numbers, strict=True):
        for place, (bits, octet) in enumerate(zip(form.mask, number, strict=True), begin):
            octets[place] = octets[place] & ~bits | octet & bits
    event: Any = replace(row.event, octets=bytes(octets))
    return replace(row, event=event)
