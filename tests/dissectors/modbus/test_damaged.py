"""Octets that are no frame: why, and beside which frame they lay."""

from __future__ import annotations

import pytest

from dissectors.frame import LineError, Mark, Place, Reason
from dissectors.modbus.damaged import Side, noise_place, noise_reason, zeros_at_start

LOW, WRONG = LineError.BREAK | LineError.FRAMING, LineError.FRAMING


@pytest.mark.parametrize(
    ("octets", "errors", "reason"),
    [
        (b"\0", (LOW,), Reason.BREAK),
        (b"\0\0", (WRONG, LOW), Reason.BREAK),
        (b"\0\0", (WRONG, WRONG), Reason.NO_FRAME),
        (b"\0\0", (), Reason.NO_FRAME),
        (b"\0\x01", (LOW,), Reason.NO_FRAME),  # something else was sent besides
    ],
)
def test_zeros_are_a_break_where_the_adapter_says_so(
    octets: bytes, errors: tuple[LineError, ...], reason: Reason
) -> None:
    assert noise_reason(octets, tuple(Mark(at, error) for at, error in enumerate(errors))) is reason


@pytest.mark.parametrize(
    ("before", "after", "gaps", "place"),
    [
        (Side.FRAME, Side.FRAME, (1, 2), Place.AFTER),
        (Side.FRAME, Side.FRAME, (2, 1), Place.BEFORE),
        (Side.FRAME, Side.FRAME, (1, 1), Place.BETWEEN),
        (Side.FRAME, Side.NOISE, (2, 1), Place.AFTER),
        (Side.NOISE, Side.FRAME, (1, 2), Place.BEFORE),
        (Side.NOISE, Side.NOISE, (1, 2), Place.BETWEEN),
    ],
)
def test_noise_lies_beside_the_frame_that_it_touches_the_nearer_of_two(
    before: Side, after: Side, gaps: tuple[int, int], place: Place
) -> None:
    assert noise_place(before, after, *gaps) is place


def test_zeros_at_the_begin() -> None:
    assert [zeros_at_start(octets) for octets in (b"", b"\1\0", b"\0\0\1\0", b"\0\0")] == [0, 0, 2, 2]
