"""Random filters of the grammar accept by columns what they accept row by row."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from dissectors.field_types import FieldType, Kind
from sniff.bus.offline import settled, settled_columns
from sniff.engine.column_join import SettledRows
from sniff.engine.follow_settings import dissector_for
from sniff.engine.session import Session
from sniff.engine.verdict_join import JudgedRow
from sniff.filter import FilterError, Scope, compile_filter
from sniff.filter.choosing import chosen
from sniff.filter.fields import COLUMN_TYPES, column_type, types_of
from sniff.formats import read
from tests.seeds import examples

CAPTURES = Path(__file__).parents[2] / "captures"
NAMES = (
    "rtu-usual-faults",
    "ascii-noisy-ftdi",
    "mstp-exceptions",
    "mstp-segments-lost",
    "n2-usual-faults",
    "findings/line-breaks-of-one-station",
)

ANY = ("==", "!=", "===", "!==")
SLICES = (("0", "03"), ("1:2", "03:00"), ("-2:2", "55:ff"), ("0-2", "01:03:00"), ("4:", "00:00"), ("-1", "06"))
ORDER = ("<", "<=", ">", ">=")
NUMBERS = ("0", "1", "2", "3", "5", "8", "0x10", "40", "300", "-1", "9473")
TIMES = ("10:00", "10:00:00.2", "2026-03-01", "2026-03-01T10:00:00.5Z", "2026-03-01T11:00:01+01:00")


@cache
def capture_of(name: str) -> tuple[Session, list[JudgedRow], list[SettledRows]]:
    """Its rows one by one, and as columns."""
    capture = read(CAPTURES / f"{name}.cap.txt")
    rows = list(settled(capture.items(), capture.session))
    return capture.session, rows, list(settled_columns(capture, capture.session))


def literals(type: FieldType) -> st.SearchStrategy[str]:
    """What such a field may be compared with."""
    words = [f'"{word}"' for word in type.words if '"' not in word]
    if type.kind in (Kind.NUMBER, Kind.STATION):
        return st.sampled_from([*(number for number in NUMBERS if can_be(type, int(number, 0))), *words])
    if type.kind is Kind.TRUTH:
        return st.sampled_from(("0", "1", "true", "false"))
    if type.kind is Kind.DURATION:
        return st.sampled_from(("0", "5ms", "1", "0.02s", "800us", "20 ms".replace(" ", "")))
    if type.kind is Kind.TIME:
        return st.sampled_from([f'"{time}"' for time in TIMES])
    if type.kind is Kind.OCTETS:
        return st.sampled_from(("03", "55:ff", "00:00", "0x01", "01:03:00", "06"))
    return st.sampled_from(words or ['"read"', '"a"', '"CRC"', '"1"', '""'])


def can_be(type: FieldType, number: int) -> bool:
    """Whether a field can be such a number."""
    return (type.least is None or number >= type.least) and (type.most is None or number <= type.most)


def parts(type: FieldType) -> st.SearchStrategy[str]:
    """What such a text may hold."""
    if not type.closed:
        return literals(FieldType(type.kind))
    return st.sampled_from([f'"{str(word)[1:5]}"' for word in type.words.values() if '"' not in str(word)])


@cache
def types_in(capture: str) -> dict[str, FieldType]:
    """What a filter on a capture may name, in order."""
    dissector = dissector_for(capture_of(capture)[0])
    own = {name: type for name, type in types_of(dissector).items() if name not in COLUMN_TYPES}
    names = {**{name: column_type(name, dissector) for name in COLUMN_TYPES if name != "finding"}, **own}
    return dict(sorted(names.items()))


@st.composite
def relations(draw: st.DrawFn, capture: str) -> str:
    """One test. `capture`: by name, since what a strategy is made of is written out at each draw."""
    names = types_in(capture)
    name = draw(st.sampled_from(list(names)))
    type = names[name]
    shape = draw(st.integers(0, 11))
    numeric = type.kind in (Kind.NUMBER, Kind.STATION, Kind.DURATION)
    ordered = numeric or type.kind in (Kind.TIME, Kind.OCTETS)
    if shape == 0:
        return name
    if shape == 1:
        items = draw(st.lists(literals(type), min_size=1, max_size=3))
        return f"{name} {draw(st.sampled_from(('in', 'not in')))} {{{', '.join(items)}}}"
    if shape == 2 and numeric:
        return f"{name} in {{{draw(st.integers(1, 5))}..{draw(st.integers(5, min(400, type.most or 400)))}, 7}}"
    if shape == 3 and type.kind is Kind.OCTETS:
        place, octets = draw(st.sampled_from(SLICES))
        return f"{name}[{place}] {draw(st.sampled_from(ANY))} {octets}"
    if shape == 4 and type.kind in (Kind.OCTETS, Kind.TEXT):
        return f"{name} contains {draw(parts(type))}"
    if shape == 5 and type.kind in (Kind.OCTETS, Kind.TEXT):
        return f'{name} matches "{draw(st.sampled_from(("^0?1", "re.d", "[a-c]$", "00")))}"'
    if shape == 6 and numeric:
        sign = draw(st.sampled_from(("+", "-", "*", "/", "%")))
        right = draw(st.sampled_from(("1", "2", "3")))
        return f"{name} {sign} {right} {draw(st.sampled_from((*ANY, *ORDER)))} {draw(literals(FieldType(type.kind)))}"
    if shape == 7 and type.kind in (Kind.NUMBER, Kind.STATION):
        other = draw(st.sampled_from(("dst", "src", "len", "no", "func", "tx", "addr", "count")))
        return f"{name} {draw(st.sampled_from((*ANY, *ORDER)))} {other}"
    if shape == 8:
        return f"count({name}) {draw(st.sampled_from((*ANY, *ORDER)))} {draw(st.integers(0, 3))}"
    if shape == 9 and ordered:
        return f"{draw(st.sampled_from(('any', 'all')))} {name} {draw(st.sampled_from(ORDER))} {draw(literals(type))}"
    operators = (*ANY, *ORDER) if ordered else ANY
    return f"{name} {draw(st.sampled_from(operators))} {draw(literals(type))}"


@cache
def filters(capture: str) -> st.SearchStrategy[str]:
    """Tests, joined as the grammar joins them."""
    return st.recursive(
        relations(capture),
        lambda inner: st.one_of(
            inner.map(lambda one: f"!({one})"),
            st.tuples(inner, st.sampled_from(("&&", "||", "^^", "and", "or", "xor")), inner).map(
                lambda parts: f"({parts[0]}) {parts[1]} ({parts[2]})"
            ),
        ),
        max_leaves=4,
    )


@pytest.mark.parametrize("name", NAMES)
@settings(deadline=None, max_examples=examples(120), suppress_health_check=[HealthCheck.too_slow])
@given(st.data())
def test_columns_accept_what_rows_accept(name: str, data: st.DataObject) -> None:
    session, rows, columns = capture_of(name)
    text = data.draw(filters(name))
    scope = Scope(session.started)
    try:
        by_rows, by_columns = (compile_filter(text, dissector_for(session), scope, others=True) for _ in range(2))
    except FilterError as error:
        if ", never " in str(error) or " fits " in str(error):  # which a test of its own is about
            return
        raise
    expected = [item.row.no for item in rows if by_rows(item.row, item.transaction)]
    found = [place + some.table.first for some in columns for place in chosen(some, by_columns)]
    assert found == expected, text
