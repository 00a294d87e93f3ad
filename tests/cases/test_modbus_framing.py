"""Modbus RTU framing of the shared cases: what frames there are, and what is proved of the damaged ones."""

from __future__ import annotations

from dissectors.frame import Damage, Flaw, Frame, Role
from sniff.engine.engine import Row
from tests.cases.reading import case, reading


def _frames(rows: tuple[Row, ...]) -> list[Frame]:
    frames = [row.event for row in rows if isinstance(row.event, Frame)]
    assert len(frames) == len(rows), "there is noise"
    return frames


def test_an_answer_with_its_crc_octets_swapped() -> None:
    read = reading(case("modbus/d1-crc-octets-swapped.cap.txt"))
    frames = _frames(read.rows)
    assert [frame.ok for frame in frames] == [True, False] * 6
    for number, answer in enumerate(frames[1::2]):
        assert answer.repair is not None
        assert answer.repair.flaw is Flaw.CHECK_SWAPPED
        assert answer.repair.octets[3:7] == bytes((0, 11 + number, 2, 0))


def test_vendor_functions_whose_request_and_answer_came_in_one_read() -> None:
    read = reading(case("modbus/f1-vendor-function-glued.cap.txt"))
    frames = _frames(read.rows)
    assert all(frame.ok for frame in frames)
    assert [frame.octets[1] for frame in frames[::2]] == [0x41, 0x42, 0x43, 0x41, 0x03]
    roles = [row.placement.role for row in read.rows if row.placement is not None]
    assert roles == [Role.REQUEST, Role.RESPONSE] * 5


def test_an_echo_that_was_cut_off() -> None:
    frames = _frames(reading(case("modbus/h1-echo-cut.cap.txt")).rows)
    assert [frame.ok for frame in frames] == [True, False] * 3
    for request, echo in zip(frames[::2], frames[1::2], strict=True):
        assert request.octets.startswith(echo.octets)
        assert (echo.damage, echo.expected, echo.repair) == (Damage.SHORT, len(request.octets), None)
