"""What the rows of a dump mean, told by all of them: the base of their offsets, and which repeat others. Pure."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from sniff.formats.dump_rows import SAME_ROWS
from sniff.formats.log_lines import Kind, Line, head_of

_ROWS_LEAST = 0.7
_REPEATS = 0.6
_TELLING = 3


def heads_of(texts: Sequence[str], lines: Sequence[Line]) -> frozenset[str]:
    """The heads whose rows repeat those of one of the two blocks before, nearly always."""
    blocks: list[tuple[str, bytearray]] = []
    head, is_row = "", False
    for text, line in zip(texts, lines, strict=True):
        if line.kind is Kind.ROW and is_row and line.offset.strip("0"):
            blocks[-1][1].extend(line.octets)
        elif line.kind is Kind.ROW:
            blocks.append((head, bytearray(line.octets)))
        elif line.kind is not Kind.EMPTY:
            head = head_of(text)
        is_row = line.kind is Kind.ROW
    many, repeated = Counter(name for name, _ in blocks), Counter[str]()
    for at, (name, octets) in enumerate(blocks):
        before = [told for other, told in blocks[max(0, at - 2) : at] if other != name]
        repeated[name] += len(octets) >= _TELLING and any(octets in told for told in before)
    return frozenset(name for name in many if many[name] >= 2 and repeated[name] >= _REPEATS * many[name])


def offsets_of(rows: Sequence[tuple[Line, str]]) -> int | None:
    """The base in which offsets of rows, each with the line before it, fit to what the rows hold; None when they do
    not."""
    for base in (16, 8, 10):
        fitting = expected = 0
        for row, before in rows:
            try:
                offset = int(row.offset, base)
            except ValueError:
                continue
            is_behind_same = before.strip() == SAME_ROWS and offset > expected
            fitting += offset in (0, expected) or (not row.octets and offset <= expected) or is_behind_same
            expected = offset + len(row.octets)
        if rows and fitting >= _ROWS_LEAST * len(rows):
            return base
    return None
