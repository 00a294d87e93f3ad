"""Lines of many rows at once: stencils are taken, and only where the line is what `text` says."""

from __future__ import annotations

import struct
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dissectors import registry
from dissectors.bacnet.envelope import npdu_frame
from dissectors.bacnet.stencils import mstp_stencil
from dissectors.frame import Chunk, Role
from dissectors.line import LineSettings
from dissectors.manifest import Dissector
from dissectors.modbus.stencils import rtu_stencil
from dissectors.single_reals import shortest
from dissectors.stencil import Form
from sniff.bus import row_words as rows
from sniff.bus.offline import settled as settled_rows
from sniff.bus.offline import settled_columns
from sniff.cli.byte_columns import digits, fixed_digits, hex_octets, joined
from sniff.cli.row_lines import RowLines
from sniff.engine.column_join import SettledRows
from sniff.engine.follow_settings import dissector_for
from sniff.engine.session import Session
from sniff.formats import create_of_items, read

CAPTURES = Path(__file__).parents[3] / "captures"


def _lines(made: RowLines, settled: SettledRows) -> str:
    return b"".join(made.lines(settled, np.arange(settled.begin, settled.end))).decode()


@pytest.mark.parametrize("name", ["rtu-clean", "mstp-clean", "rtu-noisy-ftdi", "mstp-exceptions", "n2-clean"])
@pytest.mark.parametrize("colour", [False, True])
def test_lines_are_those_of_rows(name: str, colour: bool) -> None:
    capture = read(CAPTURES / f"{name}.cap.txt")
    dissector = dissector_for(capture.session)
    made = RowLines(dissector, capture.session, colour)
    for settled in settled_columns(capture, capture.session):
        items = map(settled.item, range(settled.begin, settled.end))
        wanted = "".join(f"{rows.text_line(item, dissector, capture.session, colour)}\n" for item in items)
        assert _lines(made, settled) == wanted


@pytest.mark.parametrize("name", ["rtu-clean", "mstp-clean"])
def test_few_rows_are_put_into_words(name: str) -> None:
    capture = read(CAPTURES / f"{name}.cap.txt")
    dissector = dissector_for(capture.session)
    asked: list[Any] = []

    def text(*of: Any) -> str:
        asked.append(of)
        return dissector.text(*of)

    made = RowLines(replace(dissector, text=text), capture.session)
    count = 0
    for settled in settled_columns(capture, capture.session):
        count += len(settled)
        _lines(made, settled)
    first = len(asked)
    for settled in settled_columns(capture, capture.session):
        _lines(made, settled)
    assert first < count
    assert len(asked) - first < count // 10


def test_a_stencil_that_is_wrong_changes_no_line(monkeypatch: pytest.MonkeyPatch) -> None:
    """It says that nothing is read at all, and that the unit is a number of two octets."""

    def everything(_: Role, __: str, length: int) -> Any:
        return replace(_STENCIL, unread=tuple(range(length)))

    def wrong_number(_: Role, __: str, length: int) -> Any:
        return replace(_STENCIL, numbers=((0, Form.DECIMAL),)) if length > 2 else None

    capture = read(CAPTURES / "rtu-clean.cap.txt")
    dissector = dissector_for(capture.session)
    for stencil in (everything, wrong_number):
        spoilt: Dissector = replace(dissector, stencil=stencil)
        for settled in settled_columns(capture, capture.session):
            right = _lines(RowLines(replace(dissector, stencil=None), capture.session), settled)
            assert _lines(RowLines(spoilt, capture.session), settled) == right


_FOUND = rtu_stencil(Role.REQUEST, "read-holding-registers", 8)
assert _FOUND is not None
_STENCIL = replace(_FOUND, numbers=(), unread=())


def test_reals_and_instances_are_numbers_of_an_ack() -> None:
    stencil = mstp_stencil(Role.RESPONSE, "read-property", 29)
    assert stencil is not None
    assert stencil.numbers == ((14, Form.INSTANCE), (22, Form.REAL))
    assert registry.get("mstp").stencil is not None


@given(st.lists(st.integers(0, 1 << 62), min_size=1, max_size=20), st.integers(0, 12))
def test_digits(values: list[int], least: int) -> None:
    column = digits(np.array(values, np.int64), least)
    assert b"".join(joined([column, b"\n"], 0, len(values))) == b"".join(b"%*d\n" % (least, one) for one in values)


@given(st.lists(st.integers(0, 999_999_999), min_size=1, max_size=20))
def test_digits_with_zeros_in_front(values: list[int]) -> None:
    column = fixed_digits(np.array(values, np.int64), 9)
    assert b"".join(joined([column], 0, len(values))) == b"".join(b"%09d" % one for one in values)


@given(st.lists(st.binary(max_size=9), min_size=1, max_size=9))
def test_octets_as_hexadecimal_digits(texts: list[bytes]) -> None:
    whole = np.frombuffer(b"".join(texts), np.uint8)
    lengths = np.array([len(one) for one in texts], np.int64)
    column = hex_octets(whole, np.cumsum(lengths) - lengths, lengths)
    assert b"".join(joined([column, b" "], 0, len(texts))).decode() == "".join(f"{one.hex()} " for one in texts)


LONG = (21.537842, 1.7251986e-37, 1e8, 16_777_216.0, -0.0, 3.4028234663852886e38, 123_456.79, 1e-45)


def test_reals_have_all_their_digits(tmp_path: Path) -> None:
    """In a column as alone: what one has of another form stands in the same line."""
    session, now, path = Session("x", LineSettings(38400), "mstp"), 10**9, tmp_path / "reals.cap.txt"
    with create_of_items(path, session) as file:
        for number, real in enumerate([*LONG, *map(float, range(20))]):
            about = bytes((number, 12)) + b"\x0c\0\0\0\1\x19\x55"
            value = b"\x3e\x44" + struct.pack(">f", real) + b"\x3f"
            for octets in (
                npdu_frame(2, 1, b"\1\4\0\5" + about, expects_reply=True),
                npdu_frame(1, 2, b"\1\0\x30" + about + value, expects_reply=False),
            ):
                now += 10_000_000
                file.write(Chunk(now, octets))
    capture, dissector = read(path), dissector_for(session)
    made, told = RowLines(dissector, session), []
    for settled in settled_columns(capture, session):
        told += _lines(made, settled).splitlines()
    items = settled_rows(capture.items(), session)
    assert told == [rows.text_line(item, dissector, session, False) for item in items]
    assert [shortest(real) for real in LONG[:2]] == [21.537842, 1.7251986e-37]
    assert sum("= 21.537842" in line for line in told) == 1
