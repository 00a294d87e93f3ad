"""Framer and peek for many N2 frames at once; `dissectors/columns.py` has the contract.

A frame is what stands between two CR, where that is good by itself: `>` with a right checksum, `A` alone or with a
right checksum, `N` with two hex digits. Left out, and so doubtful: all that is damaged, holds another `>` or an octet
that is no text, is written in small letters or too long, a command directly behind another that may hold an answer,
frames with proved silence of two characters inside, and marked reads.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from dissectors.columns import CHECKS, FOUNDS, NONE, ROLES, FrameColumns, OctetTimes, holds_any
from dissectors.frame import Check, FoundBy, Frame
from dissectors.n2.commands import expected_length
from dissectors.n2.envelope import ANSWER, COMMAND, CR, REFUSAL
from dissectors.n2.framing import MAX_LENGTH
from dissectors.n2.header import peek

if TYPE_CHECKING:
    from dissectors.columns import Masks, Octets, Reads, Times
    from dissectors.line import Timing

_HEX = np.full(256, 0xFF, np.uint8)
for _digit in range(16):
    _HEX[ord(f"{_digit:X}")] = _digit
"""What a digit means; small letters are left to the reference."""

_LOWER = np.zeros(256, bool)
_LOWER[ord("a") : ord("z") + 1] = True
_STRANGE = np.ones(256, bool)
_STRANGE[0x20:0x7F] = False
_STRANGE[[COMMAND, CR]] = True
_STRANGE |= _LOWER
"""Octets that nothing between start character and CR may be."""

_LEAST_COMMAND, _LEAST_CHECKED, _REFUSAL_LENGTH = 7, 4, 4
_ROLES = {role: code for code, role in enumerate(ROLES)}


def kernel(reads: Reads, timing: Timing) -> FrameColumns:
    """The frames of all clean stretches."""
    octets: Octets = np.ascontiguousarray(reads.octets)
    ends = np.flatnonzero(octets == CR) + 1
    begins = np.concatenate((np.zeros(min(1, len(ends)), np.int64), ends[:-1]))
    good, checked = _good(octets, begins, ends)
    times = OctetTimes.of(reads, timing.char)
    reads_begin = reads.begins
    pauses = reads_begin[:-1][times.gaps() - timing.latency >= 2 * timing.char]
    good &= ~holds_any(begins + 1, ends, pauses)
    if reads.marked.any():
        good &= ~holds_any(begins, ends, np.flatnonzero(np.repeat(reads.marked, reads.lengths)))
    offset = begins[good]
    found = _columns(octets, times, offset, ends[good] - offset, checked[good])
    two = np.zeros(len(found), bool)
    two[1:] = _may_be_two(octets, found)
    return found.take(~two) if two.any() else found


def _may_be_two(octets: Octets, found: FrameColumns) -> Masks:
    """Which frames but the first may be the command before, given back cut short, and the answer to it."""
    offset, length, expected = found.offset, found.length, found.expected
    begins = octets.take(offset) == COMMAND
    again = begins[1:] & begins[:-1] & (offset[1:] == offset[:-1] + length[:-1])
    ends = (length[1:] == length[:-1]) & (octets.take(offset[1:] + length[1:] - 2) == ANSWER)
    two: Masks = again & (ends | ((expected[1:] != NONE) & (expected[1:] != length[1:])))
    return two


def _good(octets: Octets, begins: Times, ends: Times) -> tuple[Masks, Masks]:
    """Which stretches are good frames as they stand, and which of those by a checksum."""
    length, first = ends - begins, octets.take(begins)
    strange = np.concatenate(([0], np.cumsum(_STRANGE.take(octets), dtype=np.int64)))
    plain = (length <= MAX_LENGTH) & (strange[ends - 1] == strange[np.minimum(begins + 1, ends - 1)])
    sums = np.concatenate(([0], np.cumsum(octets, dtype=np.int64)))
    high, low = _HEX.take(octets.take(ends - 3, mode="clip")), _HEX.take(octets.take(ends - 2, mode="clip"))
    digits = (high != 0xFF) & (low != 0xFF)
    sent = high.astype(np.int64) << 4 | low
    body = np.maximum(ends - 3, begins + 1)
    right = digits & ((sums[body] - sums[np.minimum(begins + 1, body)]) & 0xFF == sent)
    checked = right & ((first == COMMAND) & (length >= _LEAST_COMMAND) | (first == ANSWER) & (length >= _LEAST_CHECKED))
    short = (first == ANSWER) & (length == 2) | (first == REFUSAL) & (length == _REFUSAL_LENGTH) & digits
    return plain & (checked | short), checked


def _columns(octets: Octets, times: OctetTimes, offset: Times, length: Times, checked: Masks) -> FrameColumns:
    said = _Said(len(offset))
    first = octets.take(offset)
    told_whole = np.flatnonzero(first != ANSWER)
    said.ask(told_whole, octets, offset[told_whole], length[told_whole])
    answers = np.flatnonzero(first == ANSWER)  # of which only counts whether they carry anything
    carries = length[answers] > _LEAST_CHECKED
    for alike in (answers[carries], answers[~carries]):
        said.ask(alike[:1], octets, offset[alike[:1]], length[alike[:1]])
        said.repeat(alike)
    count = len(offset)
    return FrameColumns(
        offset=offset,
        length=length.astype(np.int32),
        start=times.start(offset),
        end=times.end(offset + (length - 1)),
        check=np.where(checked, np.uint8(CHECKS.index(Check.GOOD)), np.uint8(CHECKS.index(Check.ABSENT))),
        found=np.full(count, FOUNDS.index(FoundBy.DELIMITER), np.uint8),
        damage=np.zeros(count, np.uint8),
        source=np.full(count, NONE, np.int16),
        count=np.full(count, NONE, np.int32),
        ok=np.ones(count, bool),
        names=said.names,
        **said.columns,
    )


class _Said:
    """Columns of what `peek` says of good frames; the same frame is asked once."""

    def __init__(self, count: int) -> None:
        self.columns: dict[str, Any] = {name: np.zeros(count, form) for name, form in _FORMS.items()}
        self._places = {"": 0}

    @property
    def names(self) -> tuple[str, ...]:
        """All names, by place."""
        return tuple(self._places)

    def ask(self, rows: Times, octets: Octets, offset: Times, length: Times) -> None:
        """Fill in rows; of frames of one length each different one is asked once."""
        for size in np.unique(length).tolist():
            alike = length == size
            wholes = octets.take(offset[alike][:, None] + np.arange(size))
            different, which = np.unique(wholes.view(f"V{size}")[:, 0], return_inverse=True)
            told = np.array([self._told(whole.tobytes()) for whole in different], np.int64)
            for column, values in zip(self.columns.values(), told.T, strict=True):
                column[rows[alike]] = values[which]

    def repeat(self, rows: Times) -> None:
        """The same for all rows as for the first of them."""
        for column in self.columns.values():
            column[rows[1:]] = column[rows[:1]]

    def _told(self, whole: bytes) -> tuple[int, ...]:
        header = peek(Frame("n2", whole, 0, 0, Check.GOOD, FoundBy.DELIMITER))
        expected = expected_length(whole) if whole[0] == COMMAND else None
        numbers = (expected, header.destination, header.function, header.address)
        said = _ROLES[header.role], self._place(header.kind), self._place(header.error)
        return (*said, *(NONE if number is None else number for number in numbers))

    def _place(self, name: str | None) -> int:
        return 0 if name is None else self._places.setdefault(name, len(self._places))


_FORMS = {
    "role": np.uint8,
    "kind": np.uint16,
    "error": np.uint16,
    "expected": np.int32,
    "destination": np.int16,
    "function": np.int16,
    "address": np.int32,
}
"""Columns of `_Said`, in the order in which a frame is told."""
