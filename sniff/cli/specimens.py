"""Specimens: rows that are alike share one, which is asked what depends on their octets.

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
from sniff.cli.distinct import distinct_codes
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
    shared: list[Words]
    numbers: Times
    by_words: dict[bytes, int]

    @classmethod
    def empty(cls, shared: Sequence[Words]) -> _Class:
        """One without specimens."""
        return cls(np.zeros(0, np.uint64), [one[:0] for one in shared], np.zeros(0, np.int64), {})

    def find(self, hashes: Words, shared: Sequence[Words]) -> Times:
        """Their numbers; `_UNKNOWN` where they are not found so."""
        if not len(self.hashes):
            return np.full(len(hashes), _UNKNOWN, np.int64)
        place = np.minimum(np.searchsorted(self.hashes, hashes), len(self.hashes) - 1)
        same = np.ones(len(hashes), bool)
        for theirs, ours in zip(self.shared, shared, strict=True):
            same &= theirs[place] == ours
        which: Times = np.where(same, self.numbers[place], _UNKNOWN)
        return which

    def learn(self, hashes: Words, shared: Sequence[Words], which: Times, rows: list[int]) -> None:
        """Find some rows fast from now on."""
        everything = np.concatenate([self.hashes, hashes[rows]])
        order = np.argsort(everything, kind="stable")
        everything = everything[order]
        first = np.ones(len(order), bool)
        first[1:] = everything[1:] != everything[:-1]
        order, self.hashes = order[first], everything[first]
        self.shared = [np.concatenate([old, new[rows]])[order] for old, new in zip(self.shared, shared, strict=True)]
        self.numbers = np.concatenate([self.numbers, which[rows]])[order]


@dataclass(slots=True)
class Numbers:
    """Rows whose lines hold numbers that are not their specimen's: `at`, places in what was asked for, all with the
    same `forms`; the numbers as they lie on the wire, uint8[n, octets] each."""

    at: Times
    forms: tuple[Form, ...]
    values: list[Octets]


@dataclass(slots=True)
class FoundSpecimens:
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

    def find(self, table: Table, at: Times) -> FoundSpecimens:
        """Of rows at some places of a table; odd rows have none (-1)."""
        found = FoundSpecimens(np.full(len(at), -1, np.int64))
        lengths = table.frames.length[at].astype(np.int64)
        usual = np.ones(len(at), bool)
        if table.odd:
            usual &= ~np.isin(at, np.fromiter(table.odd, np.int64, len(table.odd)))
        for length in np.flatnonzero(np.bincount(lengths[usual & (lengths <= _LONGEST)])).tolist():
            rows = np.flatnonzero(usual & (lengths == length))
            self._find_of(table, at, rows, length, found)
        return found

    def _find_of(self, table: Table, at: Times, rows: Times, length: int, found: FoundSpecimens) -> None:
        octets = stretches(table.octets, table.frames.offset[at[rows]], length)
        made = _made_of(table, at[rows])
        left = np.ones(len(rows), bool)
        for stencil, inside in self._stencilled(table, at[rows], octets, length):
            chosen = np.flatnonzero(inside)
            blank = octets[chosen]
            blank[:, list(stencil.unread)] = 0
            for begin, form in stencil.numbers:
                blank[:, begin : begin + form.octets] &= ~np.frombuffer(form.mask, np.uint8)
            shared = [*_words(blank), *(one[chosen] for one in made)]
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
            if len(chosen) < len(rows):
                octets, made, rows = octets[chosen], [one[chosen] for one in made], rows[chosen]
            found.which[rows] = self._look_up(table, at[rows], (length, None), [*_words(octets), *made])

    def _stencilled(self, table: Table, at: Times, octets: Octets, length: int) -> list[tuple[Stencil, Masks]]:
        """Stencils that may fit rows of one length, and which."""
        if self._stencils is None:
            return []
        frames = table.frames
        plain = table.good[at] & frames.ok[at] & (frames.error[at] == 0)
        if not plain.any():
            return []
        classes = frames.kind[at].astype(np.int64) * len(ROLES) + table.shown("role")[at]
        fitting: list[tuple[Stencil, Masks]] = []
        for one in distinct_codes(classes[plain])[0].tolist():
            kind, role = divmod(one, len(ROLES))
            stencil = self._stencils(ROLES[role], frames.names[kind], length)
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

    def _look_up(self, table: Table, at: Times, of: tuple[int, Stencil | None], shared: list[Words]) -> Times:
        """The specimen of each row; -1 where a stencil does not hold."""
        hashes = _hashed(shared)
        known = self._classes.setdefault(of, _Class.empty(shared))
        which = known.find(hashes, shared)
        while len(unknown := np.flatnonzero(which == _UNKNOWN)):
            some = unknown[:_FEW] if len(known.by_words) < _FEW else unknown  # the first teach most of the rest
            keys = [one.tobytes() for one in np.stack([word[some] for word in shared], axis=1)]
            new = {key: row for row, key in zip(some.tolist(), keys, strict=True) if key not in known.by_words}
            for key, row in zip(new, rows_at(table, at[list(new.values())].tolist()), strict=True):
                known.by_words[key] = self._asked(row, of[1])
            which[some] = [known.by_words[key] for key in keys]
            if len(some) < len(unknown):
                known.learn(hashes, shared, which, list(new.values()))
                which[unknown] = known.find(hashes[unknown], [word[unknown] for word in shared])
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


def _made_of(table: Table, at: Times) -> list[Words]:
    """What was made of rows, and whom their exchange says they are between."""
    frames, placed = table.frames, table.placed
    made = (frames.check[at].astype(np.int64) << 16 | frames.found[at].astype(np.int64) << 8) | frames.damage[at]
    whole = made << 33 | (frames.expected[at].astype(np.int64) + 1)
    ways = (placed.source[at].astype(np.int64) + 1) << 16 | (placed.destination[at].astype(np.int64) + 1)
    between = np.where(placed.tx[at] > 0, ways << 8 | placed.role[at], -1)
    return [whole.view(np.uint64), (between << 8 | frames.role[at]).view(np.uint64)]


def _words(octets: Octets) -> list[Words]:
    """Rows of octets as columns of words, zeros behind."""
    size = -(-octets.shape[1] // 8)
    if octets.shape[1] < 8 * size:
        padded = np.zeros((len(octets), 8 * size), np.uint8)
        padded[:, : octets.shape[1]] = octets
        octets = padded
    words = np.ascontiguousarray(octets).view(np.uint64)
    return [words[:, column] for column in range(size)]


def _hashed(shared: Sequence[Words]) -> Words:
    hashes = np.zeros(len(shared[0]), np.uint64)
    for column in shared:
        hashes = (hashes ^ column) * np.uint64(0x9E3779B97F4A7C15)
        hashes ^= hashes >> np.uint64(29)
    return hashes


def with_numbers(row: Row, stencil: Stencil, numbers: Sequence[bytes]) -> Row:
    """The row with other octets where a stencil says that they are not read, or are plain numbers."""
    assert isinstance(row.event, Frame)
    octets = bytearray(row.event.octets)
    for place in stencil.unread:
        octets[place] ^= 0xFF
    for (begin, form), number in zip(stencil.numbers, numbers, strict=True):
        for place, (bits, octet) in enumerate(zip(form.mask, number, strict=True), begin):
            octets[place] = octets[place] & ~bits | octet & bits
    event: Any = replace(row.event, octets=bytes(octets))
    return replace(row, event=event)
