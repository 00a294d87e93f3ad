"""All names of a filter: what they are, what a row says of them, and which columns of a table hold them. Pure."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace

from dissectors import registry
from dissectors.field_types import FieldType, Kind, texts
from dissectors.frame import Damage, FoundBy, Frame, LineError, Role
from dissectors.line import MS
from dissectors.manifest import Dissector
from dissectors.tracker import Transaction, Verdict
from sniff.analysis.line_rules import LINE_RULES
from sniff.analysis.wording import describe
from sniff.engine.engine import Row
from sniff.filter.scope import Scope

Value = int | float | str | bytes
Values = tuple[Value, ...]
Getter = Callable[[Row, Transaction | None], Values]

OF_CLOSING = frozenset(
    ("verdict", "latency_ms", "attempt", "tx.latency_low_ms", "tx.latency_high_ms", "tx.station", "tx.of")
)
"""What became of a row, which may become known later than the row."""

OF_TIME = frozenset(
    (
        *("frame.time", "frame.time_relative", "frame.time_delta", "start_ns", "end_ns"),
        *("latency_ms", "tx.latency_low_ms", "tx.latency_high_ms"),
    )
)
"""What only a capture has that says when anything came."""

ALIASES = {
    "frame.number": "no",
    "frame.len": "len",
    "tx.id": "tx",
    "tx.verdict": "verdict",
    "tx.latency_ms": "latency_ms",
    "tx.attempt": "attempt",
    "line.marks": "marks",
    "t": "frame.time",
}

_VERDICTS = {**{one.value: one.value for one in Verdict}, **{one.words: one.value for one in Verdict}}
_NUMBER, _TEXT, _STATION = Kind.NUMBER, Kind.TEXT, Kind.STATION
_LINE_ERRORS = {one: (one.name or "").lower() for one in LineError}

COLUMN_TYPES: Mapping[str, FieldType] = {
    "no": FieldType(_NUMBER, "number of the row, from 1", least=1),
    "frame.time": FieldType(Kind.TIME, "when it began; UTC, in the terminal UI local time"),
    "frame.time_relative": FieldType(Kind.DURATION, "since the capture began", unit="s"),
    "frame.time_delta": FieldType(Kind.DURATION, "from the begin of the row before to its own", unit="s"),
    "start_ns": FieldType(_NUMBER, "ns since the capture began, of its begin", least=0),
    "end_ns": FieldType(_NUMBER, "the same of its end", least=0),
    "proto": FieldType(_TEXT, "protocol", closed=True),
    "src": FieldType(_STATION, "who sent it"),
    "dst": FieldType(_STATION, "to whom it was sent"),
    "addr": FieldType(_STATION, "either of them"),
    "role": FieldType(_TEXT, "what it is in its exchange", texts(one.value for one in Role), closed=True),
    "kind": FieldType(_TEXT, "what it is"),
    "func": FieldType(_NUMBER, "function code, frame type or service"),
    "register": FieldType(_NUMBER, "first register or object named"),
    "count": FieldType(_NUMBER, "how many of them", least=0),
    "ok": FieldType(Kind.TRUTH, "a good frame"),
    "error": FieldType(_TEXT, "exception, or why it is damaged", several=False),
    "noise": FieldType(Kind.TRUTH, "octets that are no frame"),
    "searching": FieldType(Kind.TRUTH, "heard while settings were searched for"),
    "found": FieldType(_TEXT, "how its limits were found", texts(one.value for one in FoundBy), closed=True),
    "damage": FieldType(_TEXT, "why it is not good", texts(one.value for one in Damage), closed=True),
    "len": FieldType(_NUMBER, "octets", least=0),
    "noise_before": FieldType(_NUMBER, "octets of noise directly before it", least=0),
    "marks": FieldType(_NUMBER, "octets with a line error", least=0),
    "line.error": FieldType(_TEXT, "line errors of its octets", texts(_LINE_ERRORS.values()), closed=True),
    "tx": FieldType(_NUMBER, "number of its exchange", least=0),
    "verdict": FieldType(_TEXT, "how its exchange ended", _VERDICTS, closed=True),
    "latency_ms": FieldType(Kind.DURATION, "end of request to begin of answer", unit="ms"),
    "tx.latency_low_ms": FieldType(Kind.DURATION, "the least that it can have been", unit="ms"),
    "tx.latency_high_ms": FieldType(Kind.DURATION, "the most that it can have been", unit="ms"),
    "attempt": FieldType(_NUMBER, "which try its exchange was, from 1", least=1),
    "tx.station": FieldType(_STATION, "the station that its exchange is about"),
    "tx.of": FieldType(_NUMBER, "the exchange that its own repeats, echoes or answers late", least=0),
    "finding": FieldType(_TEXT, "findings that it is evidence of", closed=True),
    "hex": FieldType(Kind.OCTETS, "its octets"),
    "frame.octets": FieldType(Kind.OCTETS, "its octets"),
    "text": FieldType(_TEXT, "the line that says what it is", several=False),
}
"""The names that every protocol has."""

FLAGS = frozenset(("ok", "noise", "searching"))
"""Alone they ask whether it is so."""
SHARED_WORDS = frozenset(("kind", "finding"))
"""Their words are those of all protocols."""
SPELLED = frozenset(("hex",))
"""Octets of which texts in quotes are spelled in hex digits too."""

# --- what rows say --------------------------------------------------------------------------------------------------


def _source(row: Row, _: Transaction | None) -> Values:
    place, header = row.placement, row.header
    found = place.source if place is not None else header.source if header is not None else None
    return () if found is None else (found,)


def _destination(row: Row, _: Transaction | None) -> Values:
    place, header = row.placement, row.header
    found = place.destination if place is not None else header.destination if header is not None else None
    return () if found is None else (found,)


def _of_header(name: str) -> Getter:
    def get(row: Row, _: Transaction | None) -> Values:
        found = getattr(row.header, name, None)
        return () if found is None else (found,)

    return get


def _ok(row: Row, _: Transaction | None) -> Values:
    return () if row.searched is not None else (int(isinstance(row.event, Frame) and row.event.ok),)


def _kind(row: Row, _: Transaction | None) -> Values:
    if row.header is not None:
        return (row.header.kind,)
    return ("noise" if row.searched is None else "searching",)


def _role(row: Row, _: Transaction | None) -> Values:
    if row.header is None:
        return ()
    return ((row.placement.role if row.placement is not None else row.header.role).value,)


def _line_errors(row: Row, _: Transaction | None) -> Values:
    found = {word for mark in row.event.marks for one, word in _LINE_ERRORS.items() if one in mark.error}
    return tuple(sorted(found))


def _latency(name: str) -> Getter:
    def get(_: Row, tx: Transaction | None) -> Values:
        return () if tx is None or tx.latency is None else (getattr(tx.latency, name),)

    return get


def _of_frame(name: str) -> Getter:
    def get(row: Row, _: Transaction | None) -> Values:
        found = getattr(row.event, name, None)
        return () if found is None else (found.value,)

    return get


def _of_transaction(name: str) -> Getter:
    def get(_: Row, tx: Transaction | None) -> Values:
        found = getattr(tx, name, None)
        return () if found is None else (found,)

    return get


GETTERS: Mapping[str, Getter] = {
    "no": lambda row, _: (row.no,),
    "frame.time": lambda row, _: (row.event.start,),
    "proto": lambda row, _: (row.header.protocol,) if row.header is not None else (),
    "src": _source,
    "dst": _destination,
    "addr": lambda row, tx: _source(row, tx) + _destination(row, tx),
    "role": _role,
    "kind": _kind,
    "func": _of_header("function"),
    "register": _of_header("address"),
    "count": _of_header("count"),
    "ok": _ok,
    "error": _of_header("error"),
    "noise": lambda row, _: (int(not isinstance(row.event, Frame) and row.searched is None),),
    "searching": lambda row, _: (int(row.searched is not None),),
    "found": _of_frame("found"),
    "damage": _of_frame("damage"),
    "len": lambda row, _: (len(row.event.octets),),
    "noise_before": lambda row, _: (row.event.skipped if isinstance(row.event, Frame) else 0,),
    "marks": lambda row, _: (len(row.event.marks),),
    "line.error": _line_errors,
    "tx": lambda row, _: (row.placement.tx,) if row.placement is not None else (),
    "verdict": lambda _, tx: (tx.verdict.value,) if tx is not None else (),
    "latency_ms": _latency("nominal"),
    "tx.latency_low_ms": _latency("low"),
    "tx.latency_high_ms": _latency("high"),
    "attempt": _of_transaction("attempt"),
    "tx.station": _of_transaction("station"),
    "tx.of": _of_transaction("of"),
    "hex": lambda row, _: (row.event.octets,),
    "frame.octets": lambda row, _: (row.event.octets,),
}
"""Durations and times are ns here."""


Answered = Callable[[Row], Mapping[str, int | float | str]]
"""What an answer says that only its request tells."""


class DecodedFields:
    """The fields of a frame; those of the last one are remembered, for several tests may ask for them."""

    def __init__(self, dissector: Dissector, answered: Answered | None = None) -> None:
        self._dissector = dissector
        self._answered = answered
        self._last: tuple[Row, Mapping[str, int | float | str]] | None = None

    def of(self, row: Row) -> Mapping[str, int | float | str]:
        """As `Dissector.fields` gives them; none of noise."""
        if not isinstance(row.event, Frame):
            return {}
        if self._last is None or self._last[0] is not row:
            role = row.placement.role if row.placement is not None else Role.UNKNOWN
            found = self._dissector.fields(row.event, role)
            self._last = row, found if self._answered is None else {**found, **self._answered(row)}
        return self._last[1]


def of_protocol(name: str, type: FieldType, decoded: DecodedFields) -> Getter:
    """A field in the form of its type."""
    read = _READ.get(type.kind, _as_it_is)

    def get(row: Row, _: Transaction | None) -> Values:
        found = decoded.of(row).get(name)
        if found is None:
            return ()
        if isinstance(found, str) and type.several and "," in found:
            whole = (found,) if type.kind is _TEXT else ()
            return (*whole, *(value for part in found.split(",") for value in read(part, type)))
        return tuple(read(found, type))

    return get


def _as_it_is(found: int | float | str, type: FieldType) -> Iterator[Value]:
    yield found


def _number(found: int | float | str, type: FieldType) -> Iterator[Value]:
    if not isinstance(found, str):
        yield found
        return
    try:
        yield int(found) if "." not in found and "e" not in found and "n" not in found else float(found)
    except ValueError:
        return


def _octets(found: int | float | str, type: FieldType) -> Iterator[Value]:
    try:
        yield bytes.fromhex(str(found).replace(":", " "))
    except ValueError:
        return


def _text(found: int | float | str, type: FieldType) -> Iterator[Value]:
    yield str(found)


def _duration(found: int | float | str, type: FieldType) -> Iterator[Value]:
    for value in _number(found, type):
        if isinstance(value, int | float):
            yield round(value * (MS if type.unit == "ms" else 1000 * MS))


_READ = {
    Kind.NUMBER: _number,
    Kind.TRUTH: _number,
    Kind.STATION: _number,
    Kind.OCTETS: _octets,
    Kind.TEXT: _text,
    Kind.DURATION: _duration,
}


# --- the catalogue --------------------------------------------------------------------------------------------------


_types: dict[str, tuple[Dissector, Mapping[str, FieldType]]] = {}
"""By the name of the protocol, as long as it is the same."""


def types_of(dissector: Dissector) -> Mapping[str, FieldType]:
    """The types of a protocol's fields; empty where it does not say."""
    known = _types.get(dissector.name)
    if known is None or known[0] is not dissector:
        made = dict(dissector.field_types()) if dissector.field_types is not None else {}
        known = _types[dissector.name] = dissector, made
    return known[1]


def protocols(dissector: Dissector) -> tuple[Dissector, ...]:
    """That protocol, and behind it all others: a filter may be for several captures."""
    return tuple(each_protocol(dissector))


def each_protocol(dissector: Dissector) -> Iterator[Dissector]:
    """The same one by one: whoever is content with the first needs no other imported."""
    yield dissector
    yield from (one for one in registry.usable() if one.name != dissector.name)


def column_type(name: str, dissector: Dissector) -> FieldType:
    """The type of a name that every protocol has, with the words of all protocols."""
    found = COLUMN_TYPES[name]
    if name == "proto":
        return replace(found, words=texts(one.name for one in protocols(dissector)))
    if name == "finding":
        codes = {code: code for one in protocols(dissector) for code in one.rules}
        return replace(found, words={**codes, **{code: code for code in LINE_RULES}})
    own = types_of(dissector).get(_SAID_BY.get(name, name))
    if name == "error" and own is not None:
        return replace(found, words={**own.words, **texts(one.value for one in Damage)})
    if name == "kind":
        others = [types_of(one)[name] for one in protocols(dissector) if name in types_of(one)]
        silent = any("kind" not in types_of(one) for one in protocols(dissector))  # of a plug-in nobody knows them
        words = {word: word for one in others for word in one.words} | {"noise": "noise", "searching": "searching"}
        return replace(found, words=words, closed=not silent, also="|".join(one.also for one in others if one.also))
    if own is not None and own.kind is found.kind:
        return replace(own, says=own.says or found.says)
    return found


_SAID_BY = {"src": "addr", "dst": "addr", "tx.station": "addr"}
"""What a protocol says of one name for others too."""


def having_word(name: str, value: str, dissector: Dissector) -> set[str]:
    """The protocols whose frames may have such a `kind` or `finding`; empty where nobody can tell."""
    if name == "finding":
        return {one.name for one in protocols(dissector) if value in one.rules}
    having = set()
    for one in protocols(dissector):
        type = types_of(one).get(name)
        if type is None:
            return set()
        if value in type.words.values() or (type.also and re.fullmatch(type.also, value)):
            having.add(one.name)
    return having


def known_names(dissector: Dissector) -> list[str]:
    """All names, those that every protocol has first, then those of this one."""
    own = [name for name in types_of(dissector) if name not in COLUMN_TYPES]
    return [*COLUMN_TYPES, *ALIASES, *own]


def layers(dissector: Dissector) -> dict[str, str]:
    """Names of what a frame may carry, and how the names of its fields begin."""
    known = {one.name for one in protocols(dissector)}
    prefixes = [prefix for one in protocols(dissector) for prefix in one.prefixes]
    return {prefix[:-1]: prefix for prefix in prefixes if prefix[:-1] not in known}


def row_text(dissector: Dissector, scope: Scope) -> Getter:
    """The line that says what a row is."""
    says = scope.says
    if says is not None:
        return lambda row, _: (says(row),)
    return lambda row, _: (describe(dissector, row),)


def of_findings(scope: Scope) -> Getter:
    """Codes of the findings that a row is evidence of."""
    findings = scope.findings or {}
    return lambda row, _: tuple(sorted(findings.get(row.no, ())))
