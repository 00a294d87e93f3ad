"""Columns of text as arrays of octets, and lines made of them, for millions of lines: no Python object a line.

A column is uint8[n, width] of UTF-8; octets 0 are nothing and fall out when lines are put together, so that a cell may
be shorter than its column is wide. No text has an octet 0 of its own.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt

from dissectors.columns import Masks, Octets, Times
from sniff.cli.standard_streams import ESCAPE

Bytes = npt.NDArray[np.uint8]
Codes = npt.NDArray[np.integer[Any]]

_ALL_64 = (1 << 64) - 1
_AT_ONCE = 4096
"""Lines put together at a time: they stay in the processor's cache."""


@dataclass(frozen=True, slots=True)
class Chosen:
    """A column of few different texts: each row's text is that at its code."""

    texts: Bytes
    codes: Codes

    @classmethod
    def of(cls, texts: Sequence[bytes], codes: Codes) -> Chosen:
        """Of texts by number."""
        return cls(matrix(texts), codes)


Column = bytes | Bytes | Chosen
"""The same octets in every row, octets by row, or texts by code."""


def encoded(text: str) -> bytes:
    """A text as it is written."""
    return text.encode("utf-8", ESCAPE)


def matrix(texts: Sequence[bytes]) -> Bytes:
    """Texts below one another."""
    held = np.array(texts, "S")
    octets: Bytes = np.ascontiguousarray(held).view(np.uint8).reshape(len(texts), -1)
    return octets


def joined(columns: Sequence[Column], begin: int, end: int) -> Iterator[bytes]:
    """The columns of rows [begin, end) side by side, row after row; in parts."""
    for first in range(begin, end, _AT_ONCE):
        yield _some(columns, slice(first, min(first + _AT_ONCE, end)))


def pieced(columns: Sequence[Column], alone: Masks, line: Callable[[int], bytes]) -> Iterator[bytes]:
    """Lines of columns, with those rows that stand alone as `line` gives them."""
    begin = 0
    for at in np.flatnonzero(alone).tolist():
        yield from joined(columns, begin, at)
        yield line(at)
        begin = at + 1
    yield from joined(columns, begin, len(alone))


def _some(columns: Sequence[Column], rows: slice) -> bytes:
    return side_by_side(columns, rows).tobytes().translate(None, b"\0")


def side_by_side(columns: Sequence[Column], rows: slice) -> Bytes:
    """Some rows of columns as one column."""
    count = rows.stop - rows.start
    line = np.empty((count, sum(map(width, columns))), np.uint8)
    at = 0
    for column in columns:
        end = at + width(column)
        if isinstance(column, bytes):
            line[:, at:end] = np.frombuffer(column, np.uint8)
        elif isinstance(column, Chosen):
            line[:, at:end] = column.texts.take(column.codes[rows], axis=0)  # twice as fast as an index
        else:
            line[:, at:end] = column[rows]
        at = end
    return line


def width(column: Column) -> int:
    """Octets of the longest possible cell."""
    if isinstance(column, bytes):
        return len(column)
    return int((column.texts if isinstance(column, Chosen) else column).shape[1])


def since(times: Times, begin: int) -> npt.NDArray[np.uint64]:
    """How long after the begin (ns) each time is, at least 0; between the ends of int64 lies twice what it holds."""
    return np.where(times > begin, times.astype(np.uint64) - np.uint64(begin & _ALL_64), np.uint64(0))


def digits(values: Times | npt.NDArray[np.uint64], least: int = 0) -> Bytes:
    """Whole numbers, 0 or more, in decimal; to the right of spaces in a field of `least` places."""
    if not len(values):
        return np.zeros((0, max(least, 1)), np.uint8)
    most, fewest = int(values.max()), int(values.min())
    places = len(str(most))
    groups = -(-places // 4)
    out = np.empty((len(values), groups), np.uint32)
    rest = values.astype(np.uint32) if most < 1 << 32 else values.astype(np.uint64)
    ten_thousand = rest.dtype.type(10_000)
    for group in range(groups - 1, 0, -1):
        above = rest // ten_thousand
        out[:, group] = _four_digits()[rest - above * ten_thousand]
        rest = above
    out[:, 0] = _four_digits()[rest]
    octets: Bytes = out.view(np.uint8)[:, 4 * groups - places :]
    for place in range(1, places):
        if fewest >= 10**place:
            continue
        pad = 0x20 if place < least else 0
        octets[values < 10**place, places - 1 - place] = pad
    if places < least:
        spaces = np.full((len(values), least - places), 0x20, np.uint8)
        return np.concatenate([spaces, octets], axis=1)
    return octets


def fixed_digits(values: Times | npt.NDArray[np.uint64], places: int) -> Bytes:
    """Whole numbers below 10 ** `places` with zeros in front."""
    groups = -(-places // 4)
    out = np.empty((len(values), groups), np.uint32)
    rest = values.astype(np.uint32)
    for group in range(groups - 1, -1, -1):
        above = rest // np.uint32(10_000)
        out[:, group] = _four_digits()[rest - above * np.uint32(10_000)]
        rest = above
    octets: Bytes = out.view(np.uint8)[:, 4 * groups - places :]
    return octets


def short_numbers(values: npt.NDArray[np.integer[Any]]) -> Chosen:
    """Numbers of two octets in decimal."""
    return Chosen(_decimals(), values)


def hex_words(values: npt.NDArray[np.integer[Any]]) -> Bytes:
    """Numbers of two octets as four digits, upper case."""
    pairs = _hex_pairs(True)[np.stack([values >> 8, values & 0xFF], axis=1)]
    octets: Bytes = pairs.view(np.uint8)
    return octets


def hex_octets(octets: Octets, begins: Times, lengths: Times) -> Bytes:
    """Stretches of octets as hexadecimal digits, lower case."""
    longest = int(lengths.max()) if len(lengths) else 0
    digits_of: Bytes = np.zeros((len(begins), 2 * longest), np.uint8)
    for length in np.flatnonzero(np.bincount(lengths)).tolist():  # most rows are much shorter than the longest
        rows = np.flatnonzero(lengths == length)
        digits_of[rows, : 2 * length] = _hex_pairs(False)[stretches(octets, begins[rows], length)].view(np.uint8)
    return digits_of


def stretches(octets: Octets, begins: Times, length: int) -> Octets:
    """uint8[n, length]: what stands from each begin on; 0 behind the end."""
    if not len(begins) or not length:
        return np.zeros((len(begins), length), np.uint8)
    first, last = int(begins.min()), int(begins.max()) + length
    held = octets[first:last]
    if len(held) < last - first:
        held = np.concatenate([held, np.zeros(last - first - len(held), np.uint8)])
    windows: Octets = np.lib.stride_tricks.sliding_window_view(held, length)[begins - first]
    return windows


def where(mask: Masks, column: Bytes) -> Bytes:
    """The column with nothing where the mask is false."""
    if mask.all():
        return column
    out: Bytes = np.where(mask[:, None], column, np.uint8(0))
    return out


@cache
def _four_digits() -> npt.NDArray[np.uint32]:
    return np.frombuffer(b"".join(b"%04d" % number for number in range(10_000)), np.uint32)


@cache
def _decimals() -> Bytes:
    return matrix([b"%d" % number for number in range(1 << 16)])


@cache
def _hex_pairs(upper: bool) -> npt.NDArray[np.uint16]:
    form = b"%02X" if upper else b"%02x"
    return np.frombuffer(b"".join(form % number for number in range(256)), np.uint16)
