"""Names of a filter: which field, protocol or point each stands for, and what rows and tables have of it. Pure."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

from dissectors.field_types import FieldType, Kind
from dissectors.manifest import Dissector
from sniff.engine.engine import Row
from sniff.filter import fields, told
from sniff.filter.asking import delta, leaf, nowhere
from sniff.filter.comparing import With
from sniff.filter.errors import FilterError, OfOthers, OfTimes, closest, nearest, shown
from sniff.filter.expressions import Expression
from sniff.filter.literals import number_of
from sniff.filter.plan import Begins, Leaf, TestNode, joined
from sniff.filter.scope import Scope
from sniff.filter.syntax import Quoted, Value, Word


@dataclass(frozen=True, slots=True)
class Elsewhere:
    """A name or a word that only other protocols have, or (`of_time`) captures with times. `column`: its place."""

    words: str
    column: int
    of_time: bool = False


class Names:
    """What names stand for in the frames of one protocol. `asked`: fields that were asked for; `points`: those that
    frames tell; `by_request`: those that answers have by their request; `begins`: kept where
    the time since the row before is; `elsewhere`: what only other protocols have."""

    def __init__(self, dissector: Dissector, scope: Scope) -> None:
        self.dissector = dissector
        self.scope = scope
        self.stations = scope.stations()
        self.asked: set[str] = set()
        self.points: set[str] = set()
        self.by_request: set[str] = set()
        self.begins: Begins | None = None
        self.elsewhere: list[Elsewhere] = []
        self._decoded: dict[str, fields.DecodedFields] = {}
        self._types: dict[str, FieldType | None] = {}
        self._points: set[str] = set()

    @cached_property
    def layers(self) -> dict[str, str]:
        """Names of what a frame may carry, and how the names of its fields begin."""
        return fields.layers(self.dissector)

    def type(self, name: str) -> FieldType | None:
        """What a field is, of whatever protocol; None where there is no such field."""
        name = fields.ALIASES.get(name, name)
        if name not in self._types:
            self._types[name] = self._type_of(name)
        return self._types[name]

    def _type_of(self, name: str) -> FieldType | None:
        if name in told.TYPES:
            return told.type_of(name, self.scope.devices)
        if name in fields.COLUMN_TYPES:
            return fields.column_type(name, self.dissector)
        for one in () if name[:1].isdigit() else fields.each_protocol(self.dissector):  # no field begins with a digit
            types = fields.types_of(one)
            if name in types:
                return types[name]
            if not types and name.startswith(one.prefixes):
                return FieldType(Kind.ANY)
        point = told.type_of_point(name, self.scope.devices)
        if point is not None:
            self._points.add(name)
        return point

    def field(self, word: Word) -> Expression:
        """What rows have of a name. Raises FilterError."""
        name = fields.ALIASES.get(word.text, word.text)
        type = self.type(name)
        if type is None and number_of(word.text) is not None:
            raise FilterError(f"expected a field, not {word.text}", word.column)
        if type is None:
            raise FilterError(self.unknown(word.text), word.column)
        self.asked.add(name)
        if name in fields.COLUMN_TYPES:
            return self._column(name, type, word.column)
        if name in told.TYPES or name in self._points:
            self.points.add(name)
            return told.expression(name, type, self.scope)
        return self._of_protocol(name, type, word.column)

    def _column(self, name: str, type: FieldType, column: int) -> Expression:
        from sniff.filter.columns import held

        if type.never:
            self.elsewhere.append(Elsewhere(f"frames of {self.dissector.title} have no {name}", column))
            return Expression(name, type, lambda row, tx: (), nowhere, nowhere=True, field=name)
        if name in fields.OF_TIME and not self.scope.has_times:
            self.elsewhere.append(
                Elsewhere(f"{name}: this capture does not say when anything came", column, of_time=True)
            )
            return Expression(name, type, lambda row, tx: (), nowhere, nowhere=True, field=name)
        started, closing = self.scope.started or 0, name in fields.OF_CLOSING
        columns = held(name, started)
        get = fields.GETTERS.get(name)
        if name == "text":
            get = fields.row_text(self.dissector, self.scope)
        elif name == "finding":
            get = fields.of_findings(self.scope)
        elif name in ("start_ns", "end_ns"):
            end = name[:-3]
            get = lambda row, _: (max(0, getattr(row.event, end) - started),)  # noqa: E731  one of several
        elif name == "frame.time_relative":
            get = lambda row, _: (max(0, row.event.start - started),)  # noqa: E731
        elif name == "frame.time_delta":
            begins = self.begins = self.begins or Begins(self.scope.begin_of)
            get, columns = delta(begins)
        assert get is not None
        return Expression(name, type, get, columns, closing, name in fields.SPELLED, name)

    def decoded(self) -> fields.DecodedFields:
        """The fields of frames of this protocol."""
        made = self._decoded.get(self.dissector.name)
        if made is None:
            made = self._decoded[self.dissector.name] = fields.DecodedFields(self.dissector, self._answered)
        return made

    def _answered(self, row: Row) -> Mapping[str, int | float | str]:
        return self.scope.answered(row) if self.by_request and self.scope.answered is not None else {}

    def _of_protocol(self, name: str, type: FieldType, column: int) -> Expression:
        own = fields.types_of(self.dissector)
        if own and name not in own:
            self.elsewhere.append(Elsewhere(self._others_have(name), column))
            return Expression(name, type, lambda row, tx: (), nowhere, nowhere=True)
        if type.by_request:
            self.by_request.add(name)
        columns = None
        if type.octet is not None:
            from sniff.filter.columns import octet_of_frames

            columns = octet_of_frames(type.octet, type.mask, self.dissector.name)
        return Expression(name, type, fields.of_protocol(name, type, self.decoded()), columns, field=name)

    def layer(self, word: Word) -> TestNode | None:
        """A protocol by its name, or what frames of one carry; None for any other name."""
        name = fields.ALIASES.get(word.text, word.text)
        if self.type(name) is not None:
            return None
        known = {one.name for one in fields.protocols(self.dissector)}
        if name in known:
            if name != self.dissector.name:
                title = next(one.title for one in fields.protocols(self.dissector) if one.name == name)
                return self._no_frame(name, f"no frame is {title}", word.column)
            return leaf(self.field(Word("proto", word.column)), With("==", (name,)), False, f"protocol {name}")
        prefix = self.layers.get(name)
        if prefix is None:
            return None
        holding = [one for one in fields.protocols(self.dissector) if prefix in one.prefixes]
        if all(one.name != self.dissector.name for one in holding):
            others = _listed([one.title for one in holding])
            return self._no_frame(name, f"{name} is carried by {others}", word.column)
        decoded = self.decoded()
        proto = self.field(Word("proto", word.column))
        own = leaf(proto, With("==", (self.dissector.name,)), False, f"protocol {self.dissector.name}")
        inside = Leaf(
            lambda row, tx: any(one.startswith(prefix) for one in decoded.of(row)), None, f"has fields {prefix}*"
        )
        return joined("&&", [own, inside])

    def _no_frame(self, name: str, said: str, column: int) -> Leaf:
        """What no frame of this protocol is or carries."""
        self.elsewhere.append(Elsewhere(f"{said}; {self._these()}", column))
        return Leaf(lambda row, tx: False, None, f"{name}: of other protocols", fixed=False)

    def is_elsewhere(self, left: Expression, wanted: object, written: Word | Quoted) -> bool:
        """Whether only frames of other protocols can have this value; remembered then."""
        if left.field == "proto" and wanted != self.dissector.name and isinstance(wanted, str):
            self.elsewhere.append(Elsewhere(f"no frame is {written.text!r}; {self._these()}", written.column))
            return True
        if left.field not in fields.SHARED_WORDS or not isinstance(wanted, str):
            return False
        having = fields.having_word(left.field, wanted, self.dissector)
        if not having or self.dissector.name in having:
            return False
        titles = _listed([one.title for one in fields.protocols(self.dissector) if one.name in having])
        self.elsewhere.append(
            Elsewhere(f"{written.text!r} is a {left.words} of {titles}; {self._these()}", written.column)
        )
        return True

    def _others_have(self, name: str) -> str:
        having = [one.title for one in fields.protocols(self.dissector) if name in fields.types_of(one)]
        end = name.rpartition(".")[2]
        own = [one for one in fields.types_of(self.dissector) if one.rpartition(".")[2] == end]
        alike = [one for one in (end, _COLUMNS.get(end, "")) if one in fields.COLUMN_TYPES]
        hint = f" (did you mean {(own + alike)[0]}?)" if own or alike else ""
        return f"{name} is a field of {_listed(having)}; {self._these()}{hint}"

    def _these(self) -> str:
        return f"these frames are {self.dissector.title}"

    def of_others(self) -> OfOthers | None:
        """The first of what only other protocols or captures have, as an error."""
        first = min(self.elsewhere, key=lambda one: one.column, default=None)
        if first is None:
            return None
        return (OfTimes if first.of_time else OfOthers)(first.words, first.column)

    def unknown(self, name: str) -> str:
        """That there is no such name, and which is nearest."""
        own = [*fields.known_names(self.dissector), *self.layers, *told.TYPES, *told.names(self.scope.devices)]
        others = [one for each in fields.protocols(self.dissector)[1:] for one in fields.types_of(each)]
        meant = _MEANT.get("address" if name.lower() == self.dissector.noun.lower() else name.lower())
        known = [one for one in own if one.rpartition(".")[2] == name]
        found = meant or next(iter(known), None) or closest(name, own) or closest(name, others)
        close = nearest(name, own, most=12) if found is None else f"did you mean {shown(found)}?"
        return f"unknown name {name!r} ({close}; show --help-fields lists them)"

    def no_field(self, value: Value, written: str) -> FilterError:
        """Neither side of a comparison is a field."""
        if isinstance(value, Word) and number_of(value.text) is None:
            return FilterError(self.unknown(value.text), value.column)
        return FilterError(f"expected a field, not {written}", value.column)


_COLUMNS = {"func_code": "func", "unit_id": "addr", "frame_type": "func", "reference_num": "register"}
"""What every protocol has, by how the name of one ends."""

_MEANT = {
    **dict.fromkeys(("address", "station", "node", "unit", "slave", "device", "id"), "addr"),
    **dict.fromkeys(("time", "timestamp", "when"), "frame.time"),
    **dict.fromkeys(("latency", "delay", "response_time", "answer_time"), "latency_ms"),
    **dict.fromkeys(("function", "function_code", "fc", "command"), "func"),
    **dict.fromkeys(("crc", "checksum", "damaged", "bad"), "damage"),
    **dict.fromkeys(("length", "size"), "len"),
    **dict.fromkeys(("info", "message", "what"), "text"),
    **dict.fromkeys(("result", "outcome", "status"), "verdict"),
    **dict.fromkeys(("octets", "bytes", "payload", "data"), "hex"),
    **dict.fromkeys(("type", "kinds"), "kind"),
    "reg": "register",
}
"""What other programs, and people, call what every protocol has."""


def _listed(names: list[str], word: str = "and") -> str:
    once = list(dict.fromkeys(names))
    return once[0] if len(once) == 1 else f"{', '.join(once[:-1])} {word} {once[-1]}"
