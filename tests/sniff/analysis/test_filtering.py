"""The filter language: what it accepts, what it means, and where it says that it cannot read something."""

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dissectors.frame import Check, Found, Frame, Header, Noise, Place, Reason, Role
from dissectors.manifest import Dissector
from dissectors.tracker import Interval, Placement, Transaction, Verdict
from sniff.analysis.filtering import FilterError, compile_filter
from sniff.engine.engine import Row

NO: Any = None
DISSECTOR = Dissector(
    name="test",
    title="Test",
    framer=NO,
    peek=NO,
    tracker=NO,
    text=lambda frame, header, role: f"3 ← {header.kind}",
    fields=lambda frame, role: {"modbus.func_code": 16, "modbus.regval_uint16": "1,20,300"},
    packet=NO,
)
FRAME = Frame("test", bytes.fromhex("0310"), 0, 1, Check.GOOD, Found.GAP)
ROW = Row(
    7,
    FRAME,
    Header("test", None, 3, Role.REQUEST, "write-multiple-registers", 16, 0x2501, 2),
    Placement(7, 4, Role.REQUEST, None, 3),
)
TX = Transaction(
    4, 3, "write-multiple-registers", 7, None, Verdict.NO_RESPONSE, 0, 9, Interval(8_200_000, 8_200_000, 8_200_000)
)
NOISE = Row(8, Noise(b"\x00\x00", 2, 3, Place.BETWEEN, Reason.NO_FRAME))


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", True),
        ("dst == 3", True),
        ("dst == 4", False),
        ("src == 3", False),
        ("src != 3", False),  # it has no source: any comparison is false
        ("addr in {1, 2 3}", True),
        ("register == 0x2501 && count >= 2", True),
        ("dst == 4 or dst == 3", True),
        ("!(dst == 3)", False),
        ("not dst == 4 and ok", True),
        ('kind contains "WRITE"', True),
        ('kind matches "^write-(single|multiple)"', True),
        ("verdict in {no-response, late}", True),
        ('verdict == "no answer"', True),
        ('verdict in {late, "no answer"}', True),
        ("verdict == one-way", False),
        ("verdict == answered", False),
        ("latency_ms > 8 && latency_ms < 8.5", True),
        ("modbus.func_code == 0x10", True),
        ("modbus.regval_uint16 == 20", True),
        ("modbus.regval_uint16 == 2", False),
        ("modbus.nothing_such", False),
        ("noise", False),
        ("error", False),
        ('"3 ← write"', True),
        ("hex contains 0310", True),
        ("role eq request", True),
    ],
)
def test_what_a_filter_means(text: str, expected: bool) -> None:
    assert compile_filter(text, DISSECTOR)(ROW, TX) is expected


@pytest.mark.parametrize(
    ("text", "expected"), [("noise", True), ("kind == noise", True), ("ok", False), ("dst", False)]
)
def test_noise_has_only_what_it_has(text: str, expected: bool) -> None:
    assert compile_filter(text, DISSECTOR)(NOISE, None) is expected


@pytest.mark.parametrize(
    ("text", "column", "expected"),
    [
        ("dts == 3", 0, "unknown name 'dts'"),
        ("dst == ", 6, "expected a value"),
        ("dst == 3 4", 9, "expected && or ||"),
        ("(dst == 3", 9, "expected )"),
        ("dst in 3", 7, "expected {"),
        ("dst == 3 &&", 11, "expected a name"),
        ('kind matches "("', 13, "regular expression"),
        ("dst == 3 # x", 9, "unexpected '#'"),
        ("verdict == noanswer", 11, "unknown verdict 'noanswer' (did you mean 'no-response'?)"),
        ("dst == 3 && role in {request, 7}", 30, "unknown role 7 (expected one of request,"),
        ("found == splt", 9, "did you mean 'split'?"),
        ("damage != chek", 10, "did you mean 'check'?"),
        ("tx.verdict == lat", 14, "did you mean 'late'?"),
        ("!" * 500 + "ok", 200, "nested"),
    ],
)
def test_a_mistake_is_shown_at_its_column(text: str, column: int, expected: str) -> None:
    with pytest.raises(FilterError) as caught:
        compile_filter(text, DISSECTOR)
    assert expected in str(caught.value)
    assert caught.value.column == column


@given(st.text(alphabet='dst=!<>&|(){}," 0x3ok.contaismhe~\\', max_size=40))
def test_any_text_is_a_filter_or_a_filter_error(text: str) -> None:
    column = 0
    try:
        predicate = compile_filter(text, DISSECTOR)
        assert predicate(ROW, TX) in {True, False}
    except FilterError as error:
        column = error.column
    assert 0 <= column <= len(text)
