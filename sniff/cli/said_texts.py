"""The texts of many rows as a column: what `describe` says of a specimen, and numbers that are a row's own in it."""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence

import numpy as np

from dissectors.columns import Masks, Octets, Times
from dissectors.manifest import Dissector
from dissectors.single_reals import shortest_text
from dissectors.stencil import Form, Stencil
from sniff.analysis.wording import describe, is_error
from sniff.cli.byte_columns import Bytes, Chosen, Column, digits, hex_words, matrix, short_numbers, side_by_side, width
from sniff.cli.distinct import distinct_codes
from sniff.cli.specimens import Numbers, Specimens, with_numbers
from sniff.engine.engine import Row
from sniff.engine.table import Table

Pieces = tuple[bytes, ...]
"""A text in one piece, or what stands before, between and behind its numbers."""


def _probe(form: Form, place: int) -> bytes:
    """A number that nothing else in a line is likely to look like, by its place among its numbers."""
    if form is Form.REAL:
        return struct.pack(">f", -1.234567e-37 * (1 + place))
    if form is Form.INSTANCE:
        return (2_718_281 + 103 * place).to_bytes(4)
    return ((0xA7B1 if form is Form.HEX else 51_234) + 0x111 * place).to_bytes(2)


class SaidTexts:
    """Gives the column of texts of rows. `render(text)`: how one is written, as octets."""

    def __init__(self, dissector: Dissector, render: Callable[[str], bytes]) -> None:
        self._dissector = dissector
        self._render = render
        self._specimens = Specimens(self._ask, dissector.stencil)
        self._pieces: list[Pieces] = []
        self._notes: dict[tuple[bool, str], int] = {}
        self._note_of: list[int] = []

    def column(self, table: Table, at: Times) -> tuple[Bytes, Times, Masks]:
        """The texts of rows, the number of what is noted of each (see `notes`), and which rows have no such text: odd
        ones, and those whose texts are much longer than the others'."""
        if self._specimens.is_full:
            self._specimens.clear()
            self._pieces.clear()
            self._note_of.clear()
            self._notes.clear()
        found = self._specimens.find(table, at)
        which = np.maximum(found.which, 0)
        if not self._pieces:
            return np.zeros((len(at), 0), np.uint8), np.zeros(len(at), np.int64), np.ones(len(at), bool)
        alone = found.which < 0
        distinct, codes = distinct_codes(which)
        pieces = [self._pieces[one] for one in distinct.tolist()]
        sizes = np.array([sum(map(len, one)) for one in pieces], np.int64)[codes]
        alone |= sizes > 4 * sizes.mean() + 32
        numbers = [_with_numbers(one, self._pieces, found.which) for one in found.numbers]
        whole = [one[0] if len(one) == 1 and size else b"" for one, size in zip(pieces, map(bool, pieces), strict=True)]
        most = max((len(one) for one in whole), default=0)
        limit = min(most, int(4 * sizes.mean() + 32))
        column = np.zeros((len(at), max([limit, *(texts.shape[1] for _, texts in numbers)])), np.uint8)
        column[:, :limit] = matrix([one[:limit] for one in whole]).take(codes, axis=0)[:, :limit] if limit else 0
        for rows, texts in numbers:
            column[rows, : texts.shape[1]] = texts
            alone[rows] = False
        return column, np.array(self._note_of, np.int64)[which], alone

    @property
    def notes(self) -> list[tuple[bool, str]]:
        """Whether a row itself is trouble, and what is noted of it beside its text; by number."""
        return list(self._notes)

    def _ask(self, row: Row, stencil: Stencil | None) -> bool:
        text = describe(self._dissector, row)
        said = self._render(text)
        pieces: Pieces | None = (said,) if stencil is None else self._divided(row, stencil, said)
        if pieces is None or b"\0" in said:
            return False
        error = row.header.error if row.header is not None else None
        note = error if not getattr(row.event, "ok", True) and error and error not in text else ""
        self._pieces.append(pieces)
        self._note_of.append(self._notes.setdefault((is_error(row), note or ""), len(self._notes)))
        return True

    def _divided(self, row: Row, stencil: Stencil, said: bytes) -> Pieces | None:
        """The pieces of a text around its numbers; None where the text is not as the stencil says."""
        forms = [form for _, form in stencil.numbers]
        probes = [_probe(form, place) for place, form in enumerate(forms)]
        probed = self._render(describe(self._dissector, with_numbers(row, stencil, probes)))
        pieces = _split(probed, list(map(_number_text, forms, probes)))
        if pieces is None:
            return None
        octets = row.event.octets
        own = [_number_text(form, octets[begin : begin + form.octets]) for begin, form in stencil.numbers]
        whole = b"".join(piece + number for piece, number in zip(pieces, [*own, b""], strict=True))
        return pieces if whole == said else None


def _split(text: bytes, numbers: Sequence[bytes]) -> Pieces | None:
    """A text around numbers that stand in it in this order, each once."""
    pieces = []
    for number in numbers:
        if text.count(number) != 1:
            return None
        piece, _, text = text.partition(number)
        pieces.append(piece)
    return *pieces, text


def _number_text(form: Form, octets: bytes) -> bytes:
    if form is Form.REAL:
        return shortest_text(struct.unpack(">f", octets)[0]).encode()
    number = int.from_bytes(octets) & int.from_bytes(form.mask)
    return (b"%04X" if form is Form.HEX else b"%d") % number


def _with_numbers(numbers: Numbers, pieces: Sequence[Pieces], which: Times) -> tuple[Times, Bytes]:
    """Rows with numbers of their own, and their texts."""
    specimens = which[numbers.at]
    distinct, inverse = distinct_codes(specimens)
    held = [pieces[one] for one in distinct.tolist()]
    columns: list[Column] = []
    for place in range(len(numbers.forms) + 1):
        columns.append(Chosen.of([one[place] for one in held], inverse))
        if place < len(numbers.forms):
            columns.append(_numbers(numbers.forms[place], numbers.values[place]))
    return numbers.at, side_by_side([one for one in columns if width(one)], slice(0, len(inverse)))


def _numbers(form: Form, values: Octets) -> Column:
    if form is Form.REAL:
        distinct, which = np.unique(np.ascontiguousarray(values).view(">u4"), return_inverse=True)
        reals = distinct.astype(np.uint32).view(np.float32).astype(np.float64).tolist()
        return Chosen.of([shortest_text(real).encode() for real in reals], which.ravel())
    if form is Form.INSTANCE:
        return digits((values.copy().view(">u4").ravel() & int.from_bytes(form.mask)).astype(np.int64))
    words = values[:, 0].astype(np.uint16) << 8 | values[:, 1]
    return short_numbers(words) if form is Form.DECIMAL else hex_words(words)
