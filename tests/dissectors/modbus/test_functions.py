"""The table of function codes: predicted lengths hold for every printed and every generated frame."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dissectors.modbus.functions import (
    FUNCTIONS,
    answer_length,
    ascii_length,
    is_open_length,
    request_length,
    response_length,
)
from dissectors.modbus.lengths import MAX_FRAME, MORE, NEVER
from tests.property.modbus_adus import ascii_frame, bodies, exceptions, requests, responses, rtu

PROTOCOLS = Path(__file__).parents[3] / "../shared/protocols"

in_requests = requests.map(lambda message: rtu(b"\x01" + message))
in_responses = st.one_of(responses, exceptions).map(lambda message: rtu(b"\x01" + message))


@given(in_requests)
def test_every_request_has_its_predicted_length(frame: bytes) -> None:
    assert request_length(frame) == len(frame)


@given(in_responses)
def test_every_response_has_its_predicted_length(frame: bytes) -> None:
    assert response_length(frame) == len(frame)


@given(st.one_of(in_requests, in_responses), st.booleans())
def test_the_first_octets_tell_the_length_or_that_more_are_needed(frame: bytes, asks: bool) -> None:
    predict = request_length if asks else response_length
    whole = predict(frame)
    for end in range(len(frame)):
        assert predict(frame, 0, end) in (MORE, whole)
        assert predict(b"\xff" + frame + b"\xff", 1, 1 + end) == predict(frame, 0, end)


@given(st.binary(max_size=300), st.integers(0, 300))
def test_any_octets_have_a_length_that_a_frame_can_have_or_none(octets: bytes, start: int) -> None:
    for length in (request_length(octets, start), response_length(octets, start)):
        assert length in (MORE, NEVER) or 4 <= length <= MAX_FRAME
    answer_length(octets)


@given(bodies)
def test_an_ascii_frame_is_as_long_as_said(body: bytes) -> None:
    assert ascii_length(len(rtu(body))) == len(ascii_frame(body))


def test_every_shape_holds_for_every_printed_frame() -> None:
    if not PROTOCOLS.is_dir():
        pytest.skip("shared protocol notes are not here")
    text = (PROTOCOLS / "modbus.md").read_text()
    for line in re.findall(r"^RTU +(\S[^;\n]*)", text, re.MULTILINE):
        frame = bytes.fromhex(line)
        function = FUNCTIONS[frame[1] & 0x7F]
        lengths = (request_length(frame), response_length(frame))
        assert len(frame) in lengths, line
        if frame[1] < 0x80:
            forms = [f for f, n in zip((function.request, function.response), lengths, strict=True) if n == len(frame)]
            assert max(form.shape(frame, 0, len(frame)) for form in forms) >= 0, line


@pytest.mark.parametrize(
    ("request_hex", "length"),
    [
        ("0101 0013 0013", 8),
        ("0103 0000 007D", 255),
        ("0106 0001 0002", 8),
        ("0107", 5),
        ("010B", 8),
        ("0110 0001 0001 02 0003", 8),
        ("0111", None),
        ("0116 0004 00F2 0025", 10),
        ("0117 0003 0006 000E 0001 02 00FF", 17),
        ("0164 01", None),
    ],
)
def test_the_length_of_the_answer(request_hex: str, length: int | None) -> None:
    assert answer_length(rtu(bytes.fromhex(request_hex))) == length


def test_lengths_that_only_silence_tells() -> None:
    assert is_open_length(rtu(b"\x01\x64\x01"))
    assert is_open_length(rtu(b"\x01\x08\0\0\x01\x02\x03\x04"))
    assert is_open_length(rtu(b"\x01\x2b\x0d\x01"))
    assert not is_open_length(rtu(b"\x01\x2b\x0e\x01\0"))
    assert not is_open_length(rtu(b"\x01\x08\0\x02\0\0"))
    assert not is_open_length(rtu(b"\x01\x83\x02"))
