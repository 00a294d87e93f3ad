"""The filter language: what it accepts, what it means, and where it says that it cannot read something."""

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dissectors.field_types import FieldType, Kind
from dissectors.frame import Check, FoundBy, Frame, Header, Noise, Place, Reason, Role
from dissectors.manifest import Dissector
from dissectors.tracker import Interval, Placement, Transaction, Verdict
from sniff.engine.engine import Row
from sniff.filter import FilterError, compile_filter

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
    field_types=lambda: {
        "modbus.func_code": FieldType(Kind.NUMBER, words={"Write Multiple Registers": 16}),
        "modbus.regval_uint16": FieldType(Kind.NUMBER),
    },
)
FRAME = Frame("test", bytes.fromhex("0310"), 0, 1, Check.GOOD, FoundBy.GAP)
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
        ('kind contains "write"', True),
        ('kind contains "WRITE"', False),  # as in Wireshark, capitals matter
        ('upper(kind) contains "WRITE"', True),
        ('kind matches "WRITE"', True),
        ('kind matches "(?-i)WRITE"', False),
        ('kind == "Write Multiple Registers"', True),  # one of its words
        ('lower(kind) == "write-multiple-registers"', True),
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
        ("modbus.regval_uint16 in {2..19, 300}", True),
        ("count(modbus.regval_uint16) == 3", True),
        ("all modbus.regval_uint16 > 1", False),
        ("any modbus.regval_uint16 > 299", True),
        ("modbus.regval_uint16 != 20", False),  # as in Wireshark: none of them is
        ("modbus.regval_uint16 !== 20", True),  # one of them is not
        ("dst in {1..2}", False),
        ("dst in {2..4}", True),
        ("dst in {4, 1..3}", True),
        ("dst not in {4, 1..3}", False),
        ("2 < dst <= 3", True),
        ("dst + 4 == no", True),
        ("no - dst == 4 && no % 2 == 1 && no / 2 == 3 && no & 3 == 3", True),
        ("dst == no - 4", True),
        ("addr != 3", False),
        ("role == response || role == request", True),
        ("latency_ms > 5ms && latency_ms < 0.1s && latency_ms == 8200us", True),
        ("latency_ms * 2 > 16ms", True),
        ("frame.octets == 03:10 && frame.octets[0] == 03 && frame.octets[-1] == 10", True),
        ("frame.octets[0:2] == 03:10 && frame.octets[1-1] == 0x10", True),
        ("frame.octets[2]", False),
        ("hex contains 31", False),  # 0x0310 holds 31 at half an octet only
        ('hex contains "03:10" && hex contains 03-10', True),
        ('frame.octets contains "\\x10"', False),
        ("len(frame.octets) == 2 && len == 2", True),
        ('hex matches "^03"', True),
        ('hex matches "31"', False),
        ("tx == 4 ^^ dst == 3", False),
        ("tx == 4 xor dst == 4", True),
        ('string(dst) matches "^3$"', True),
        ('string(latency_ms) == "8.2"', True),  # as it is shown
        ('string(frame.time) == "1970-01-01T00:00:00.000000000Z"', True),
        ("max(dst, no) == 7 && min(dst, no) == 3", True),
        ("max(dst, 9) == 9 && min(9, dst) == 3", True),
        ("frame.time == 1970-01-01", True),
        ('frame.time >= "00:01"', False),
        ("frame.time_relative >= 0", True),
        ("frame.time_delta", False),
        ("test", True),
        ("noise_before && marks", True),  # a name alone asks whether it is there, also for 0
        ("noise_before > 0 || marks > 0", False),
        ("noise", False),
        ("error", False),
        ('"3 ← write"', True),
        ('"3 ← WRITE"', True),  # a text alone is looked for as people look for it
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
        ("dst = 3", 4, "did you mean ==?"),
        ("verdict == noanswer", 11, "unknown verdict 'noanswer' (did you mean \"no answer\"?)"),
        ("dst == 3 && role in {request, 7}", 30, "unknown role '7' (expected one of request,"),
        ("found == splt", 9, "did you mean 'split'?"),
        ("damage != chek", 10, "did you mean 'check'?"),
        ("tx.verdict == lat", 14, "did you mean 'late'?"),
        ("!" * 500 + "ok", 64, "nested"),
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
