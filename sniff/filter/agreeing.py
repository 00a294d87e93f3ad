"""Type check of a filter: operands that cannot go together by type, range or word are refused. Pure."""

from __future__ import annotations

import re
from typing import Any

from dissectors.field_types import FieldType, Kind
from sniff.filter import fields
from sniff.filter.errors import FilterError, nearest
from sniff.filter.expressions import Expression
from sniff.filter.syntax import Arithmetic, Call, Quoted, Slice, Value, Word

ORDERED = frozenset(("<", "<=", ">", ">="))
_ARTICLES = {Kind.OCTETS: "octets", Kind.ANY: "anything", Kind.TRUTH: "true or false", Kind.STATION: "a station"}
_WHOLE = frozenset((Kind.NUMBER, Kind.STATION))


def article(type: FieldType) -> str:
    """What something is, as a sentence has it."""
    return _ARTICLES.get(type.kind, f"a {type.kind.value}")


def spelled(value: Value | None) -> str:
    """A value as it was written."""
    if isinstance(value, Quoted):
        return f'"{value.text}"'
    if isinstance(value, Word):
        return value.text
    if isinstance(value, Arithmetic):
        return f"{spelled(value.left)} {value.operator} {spelled(value.right)}"
    if isinstance(value, Call):
        return f"{value.name}({', '.join(map(spelled, value.arguments))})"
    return f"{spelled(value.of)}[…]" if isinstance(value, Slice) else ""


def check_alike(left: Expression, right: Expression, column: int) -> None:
    """Whether two values can be compared. Raises FilterError."""
    one, other = left.type.kind, right.type.kind
    if one is other or Kind.ANY in (one, other) or (one in _WHOLE and other in _WHOLE):
        return
    raise FilterError(
        f"{left.words} is {article(left.type)}, {right.words} is {article(right.type)}: they do not compare", column
    )


def check_order(left: Expression, operator: str, column: int) -> None:
    """Whether its values have an order, where one is asked for. Raises FilterError."""
    if operator not in ORDERED and operator != "..":
        return
    if left.type.kind is Kind.TRUTH:
        raise FilterError(f"{left.words} is true or false: it has no order", column)
    if left.type.kind is Kind.TEXT and left.type.closed:
        raise FilterError(f"the words of {left.words} have no order", column)


def check_range(left: Expression, wanted: Any, written: Value) -> None:
    """Refuse numbers that it can never be, as Wireshark does with any comparison. Raises FilterError."""
    type = left.type
    least, most = type.least, type.most
    if not isinstance(wanted, int | float) or isinstance(wanted, bool) or (least is None and most is None):
        return
    if (least is None or wanted >= least) and (most is None or wanted <= most):
        return
    raise FilterError(f"{left.words} is {_span(type)}, never {spelled(written)}", written.column)


def check_reach(left: Expression, operator: str, wanted: Any, written: Value) -> None:
    """Refuse an order that no number it can be is in: more than the most, less than the least. Raises FilterError."""
    type = left.type
    least = 0 if type.kind is Kind.DURATION and left.field else type.least  # no time of a field is before 0
    if not isinstance(wanted, int | float) or isinstance(wanted, bool):
        return
    if operator == ">" and type.most is not None and wanted >= type.most:
        raise FilterError(f"{left.words} is {_span(type)}, never more than {spelled(written)}", written.column)
    if operator == "<" and least is not None and wanted <= least:
        said = _span(type) if type.least is not None else "0 or more"
        raise FilterError(f"{left.words} is {said}, never less than {spelled(written)}", written.column)


def _span(type: FieldType) -> str:
    return f"{type.least} … {type.most}" if type.most is not None else f"{type.least} or more"


def check_equal(left: Expression, wanted: int | float | str | bytes, written: Word | Quoted) -> None:
    """Refuse what is equal to nothing that there can be. Raises FilterError."""
    if isinstance(wanted, str | bytes) and left.size is not None and len(wanted) != left.size:
        refuse_size(left, wanted, written)
    whole = left.type.kind is Kind.STATION or (
        left.type.kind is Kind.NUMBER and (left.field in fields.COLUMN_TYPES or left.type.least is not None)
    )
    if whole and isinstance(wanted, float):
        raise FilterError(f"{left.words} is a whole number, {written.text} is none", written.column)
    check_letters(left, wanted, written)


def refuse_size(left: Expression, wanted: str | bytes, written: Word | Quoted) -> None:
    """Say that it is longer or shorter than that. Raises FilterError."""
    unit = "octets" if isinstance(wanted, bytes) else "characters"
    raise FilterError(f"{left.words} has {left.size} {unit}, {spelled(written)} {len(wanted)}", written.column)


def check_letters(left: Expression, wanted: Any, written: Word | Quoted) -> None:
    """Refuse capitals of what has none, and the other way round. Raises FilterError."""
    if not left.letters or not isinstance(wanted, str):
        return
    fitting = wanted.lower() if left.letters == "lower" else wanted.upper()
    if fitting != wanted:
        raise FilterError(f"{left.words} is all in {left.letters} case: {spelled(written)} never is", written.column)


def check_holding(left: Expression, wanted: str, written: Word | Quoted) -> None:
    """Refuse texts that none of its words holds. Raises FilterError."""
    check_letters(left, wanted, written)
    type = left.type
    if not type.closed:
        return
    words = [str(value) for value in type.words.values()]
    if any(wanted in word for word in words):
        return
    close = next((word for word in words if wanted.lower() in word.lower()), None)
    if close is not None:
        raise FilterError(
            f"no {left.words} holds {spelled(written)}, {close!r} does otherwise written: "
            "contains minds capitals (matches does not)",
            written.column,
        )
    if not type.also or (not _MAY_HOLD.search(wanted) and not re.search(r"\d", wanted)):
        raise FilterError(f"no {left.words} holds {spelled(written)} ({nearest(wanted, words)})", written.column)


def check_fitting(left: Expression, pattern: re.Pattern[str], written: Word | Quoted) -> None:
    """Refuse a regular expression that none of its words fits. Raises FilterError."""
    type = left.type
    if not type.closed or type.also or left.letters:
        return
    words = [str(value) for value in type.words.values()]
    if not any(pattern.search(word) for word in words):
        raise FilterError(f"no {left.words} fits {spelled(written)} ({nearest(written.text, words)})", written.column)


_MAY_HOLD = re.compile(r"function|reserved|proprietary|service|vendor|message|network|0x|/|-")
"""What texts beyond the words of an open enumeration are made of."""
