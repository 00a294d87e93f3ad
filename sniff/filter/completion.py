"""Completion of a filter that is being typed: fields, then operators, then values. Pure."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime

from dissectors.field_types import FieldType, Kind, plain_word
from dissectors.line import MS
from dissectors.manifest import Dissector
from dissectors.words import exact_duration
from sniff.filter import fields, told
from sniff.filter.expressions import Expression
from sniff.filter.grammar import FUNCTIONS, words_of

JOINS = ("&&", "||", "^^")
NUMERIC = ("==", "!=", "<", "<=", ">", ">=", "in {")
OPERATORS = {
    Kind.TEXT: ("==", "!=", "contains", "matches", "in {"),
    Kind.OCTETS: ("==", "!=", "contains", "matches", "["),
    Kind.TRUTH: ("==", "!="),
    Kind.TIME: ("==", "<", "<=", ">", ">="),
}
_COMPARE = frozenset(("==", "!=", "===", "!==", "<", "<=", ">", ">=", "contains", "matches", "~", "{", ",", ".."))
_TYPED = re.compile(r'(?:"[^"]*|[A-Za-z0-9_][\w.:-]*)$')
_PLAIN = re.compile(r"[A-Za-z0-9_](?:[A-Za-z0-9_:]|-(?=[A-Za-z0-9_])|\.(?!\.))*")

Counts = Callable[[str], Sequence[tuple[str, int]]]
"""Values that a field has, as they are written, and how many rows have each; the most frequent first."""


@dataclass(frozen=True, slots=True)
class Completion:
    """One way to go on: the whole text then, and the word with how many rows have it, for a list."""

    text: str
    word: str
    rows: int | None = None


def completions(
    text: str, dissector: Dissector, counts: Counts | None = None, points: Sequence[str] = ()
) -> list[Completion]:
    """Ways to go on; those that begin as what was typed last. `points`: names of points that frames may tell."""
    match = _TYPED.search(text)
    typed = match[0] if match is not None else ""
    before = text[: len(text) - len(typed)]
    words = words_of(before.rstrip())
    field = _field_before(words, dissector)
    offered: list[tuple[str, int | None]]
    if field is not None and words[-1][1] in _COMPARE:
        offered = _values(field, dissector, counts)
    elif field is not None and text.endswith(" ") and not typed:
        type = _type(field, dissector)
        offered = _alone((*OPERATORS.get(type.kind if type else Kind.NUMBER, NUMERIC), *JOINS))
    elif _value_ended(words) and not typed:
        offered = _alone(JOINS)
    elif _value_ended(words):
        offered = _alone(("contains", "matches", "in {", "and", "or", "xor"))
    else:
        names = [*fields.known_names(dissector), *fields.layers(dissector), *told.TYPES, *points]
        offered = _alone((*names, *(f"{name}(" for name in FUNCTIONS)))
    bare = typed.lower().lstrip('"')
    found = [
        Completion(before + word, word, rows)
        for word, rows in offered
        if word.lower().lstrip('"').startswith(bare) and word != typed
    ]
    if field is None and len(found) < 6 and bare:
        found += [
            Completion(before + word, word, rows)
            for word, rows in offered
            if bare in word.lower() and not word.lower().startswith(bare)
        ]
    return found


def _alone(words: Sequence[str]) -> list[tuple[str, int | None]]:
    return [(word, None) for word in words]


def written(value: object) -> str:
    """A value as it is written in a filter."""
    text = str(value)
    if _PLAIN.fullmatch(text):
        return text
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return f'"{escaped}"'


def shown_value(value: object, field: Expression, zone: Callable[[int], int] | None = None) -> str:
    """A value of a row as it is written in a filter. `zone`: as a scope has it."""
    type = field.type
    if isinstance(value, bytes):
        return value.hex(":") or '""'
    if type.kind is Kind.DURATION and isinstance(value, int):
        return f"{exact_duration(value, MS)}ms"
    if type.kind is Kind.TIME and isinstance(value, int):
        local = value if zone is None else value + zone(value)
        return f'"{datetime.fromtimestamp(local // 1_000_000_000, UTC):%H:%M:%S}"'
    word = next((word for word, number in type.words.items() if number == value), None)
    return written(value if word is None or type.kind is Kind.TRUTH else word)


def _type(name: str, dissector: Dissector) -> FieldType | None:
    name = fields.ALIASES.get(name, name)
    if name in fields.COLUMN_TYPES:
        return fields.column_type(name, dissector)
    if name in told.TYPES:
        return told.TYPES[name]
    return fields.types_of(dissector).get(name)


def _field_before(words: list[tuple[str, str, int]], dissector: Dissector) -> str | None:
    """The field that an operator or a value is to follow; None where a name is."""
    for kind, text, _ in reversed(words):
        if kind == "op" and text in ("&&", "||", "^^", "!", "("):
            return None
        if kind == "word" and _type(text, dissector) is not None:
            after = words[words.index((kind, text, _)) + 1 :]
            ended = any(one[1] in _COMPARE for one in after) and after[-1][1] not in _COMPARE
            return None if ended else text
    return None


def _value_ended(words: list[tuple[str, str, int]]) -> bool:
    return bool(words) and (words[-1][0] in ("word", "text", "slice") or words[-1][1] in ("}", ")"))


def _values(name: str, dissector: Dissector, counts: Counts | None) -> list[tuple[str, int | None]]:
    """Those that rows have, then the words of its type."""
    seen: list[tuple[str, int | None]] = list(counts(name)) if counts is not None else []
    have = {word for word, _ in seen}
    type = _type(name, dissector)
    once: dict[str, str] = {}
    for word in type.words if type is not None else ():
        once.setdefault(plain_word(word), written(word))
    words = list(once.values())
    return seen + [(word, None) for word in words if word not in have]
