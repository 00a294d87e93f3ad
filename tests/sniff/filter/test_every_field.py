"""Every field of every protocol: each kind of question that goes with its type, and each that does not."""

from __future__ import annotations

import pytest

from dissectors import registry
from dissectors.field_types import FieldType, Kind
from dissectors.manifest import Dissector
from sniff.filter import FilterError, Scope, compile_filter
from sniff.filter.completion import written
from sniff.filter.fields import COLUMN_TYPES, column_type, types_of

PROTOCOLS = [registry.get(name) for name in registry.names()]
VALUES = {
    Kind.NUMBER: "1",
    Kind.STATION: "1",
    Kind.TRUTH: "1",
    Kind.OCTETS: "01:02",
    Kind.TEXT: '"x"',
    Kind.DURATION: "5ms",
    Kind.TIME: '"10:02"',
}


def every_field() -> list[tuple[Dissector, str, FieldType]]:
    found = []
    for one in PROTOCOLS:
        columns = {name: column_type(name, one) for name in COLUMN_TYPES}
        found += [(one, name, type) for name, type in {**types_of(one), **columns}.items() if name != "addr"]
        found.append((one, "addr", columns["addr"]))
    return found


def value_of(type: FieldType) -> str:
    return written(next(iter(type.words))) if type.words else VALUES[type.kind]


@pytest.mark.parametrize("one", PROTOCOLS, ids=lambda one: one.name)
def test_what_goes_with_each_type(one: Dissector) -> None:
    for dissector, name, type in every_field():
        if dissector is not one or type.never:
            continue
        value = value_of(type)
        right = [name, f"!{name}", f"{name} == {value}", f"{name} in {{{value}}}", f"not {name} in {{{value}}}"]
        if type.kind in (Kind.NUMBER, Kind.STATION, Kind.DURATION, Kind.TIME):
            right += [f"{name} >= {VALUES[type.kind]}", f"{name} in {{{VALUES[type.kind]}..{VALUES[type.kind]}}}"]
        if type.kind in (Kind.TEXT, Kind.OCTETS):
            right += [f'{name} matches "."', f"len({name}) > 1", f"{name}[0:1]"]
        for text in right:
            compile_filter(text, dissector, Scope(), others=True)
        for word in type.words:
            compile_filter(f"{name} == {written(word)}", dissector, Scope(), others=True)


@pytest.mark.parametrize("one", PROTOCOLS, ids=lambda one: one.name)
def test_what_goes_with_none(one: Dissector) -> None:
    for dissector, name, type in every_field():
        if dissector is not one:
            continue
        wrong = [f"{name} == ", f"{name} in {{}}", f"{name} = 1", f"{name}x == 1"]
        if type.never:
            wrong += [name, f"{name} == 1"]
        if type.kind is not Kind.TEXT:
            wrong.append(f'{name} == "no such thing"' if type.kind is not Kind.OCTETS else f"{name} == xyz")
        if type.kind in (Kind.NUMBER, Kind.STATION, Kind.TRUTH):
            wrong += [f'{name} contains "1"', f"{name}[0] == 01", f"{name} == 5ms", f"{name} == 01:02"]
        if type.most is not None:
            over = type.most + 1
            wrong += [f"{name} == {over}", f"{name} < {over}", f"{name} in {{1, {over}}}", f"!({name} == {over})"]
            wrong += [f"{name} == -1", f"{name} == 0.5"]
        if type.kind is Kind.TEXT and type.closed:
            wrong += [f'{name} == "no such word"', f'{name} > "a"']
        if type.kind is Kind.TRUTH:
            wrong += [f"{name} == 2", f"{name} > 0"]
        for text in wrong:
            with pytest.raises(FilterError):
                print(name, text, compile_filter(text, dissector, Scope()))


@pytest.mark.parametrize("one", PROTOCOLS, ids=lambda one: one.name)
def test_a_field_of_another_protocol_is_named_as_such(one: Dissector) -> None:
    own = types_of(one)
    for dissector, name, type in every_field():
        if name in own or name in COLUMN_TYPES:
            continue
        with pytest.raises(FilterError, match=rf"is a field of .*{dissector.title}|these frames are {one.title}"):
            compile_filter(f"{name} == {value_of(type)}", one, Scope())
