"""CRCs of stretches by look-ups are those that are worked out octet by octet."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from dissectors.checksums import crc16_modbus, ends_with_crc16
from dissectors.modbus.lengths import MAX_FRAME, MIN_FRAME
from dissectors.modbus.stretch_crc import StretchCrc, holds_a_good_frame


@given(st.binary(max_size=3 * MAX_FRAME), st.data())
def test_the_register_over_a_stretch(octets: bytes, data: st.DataObject) -> None:
    start = data.draw(st.integers(0, len(octets)))
    length = data.draw(st.integers(0, min(MAX_FRAME, len(octets) - start)))
    crc = StretchCrc(np.frombuffer(octets, np.uint8))
    found = int(crc.registers(np.array([start]), np.array([length]))[0])
    assert found == crc16_modbus(octets[start : start + length])


@st.composite
def with_a_check(draw: st.DrawFn) -> bytes:
    """Octets with the CRC of some of them behind those, as long as the shortest frame or a little shorter."""
    checked = draw(st.binary(min_size=MIN_FRAME - 3, max_size=20))
    check = crc16_modbus(checked).to_bytes(2, "little")
    return draw(st.binary(max_size=9)) + checked + check + draw(st.binary(max_size=9))


@given(st.one_of(st.binary(max_size=MAX_FRAME), with_a_check(), with_a_check()))
def test_a_good_frame_is_found_wherever_it_is(octets: bytes) -> None:
    ends = range(MIN_FRAME, len(octets) + 1)
    holds = any(ends_with_crc16(octets[begin:end]) for end in ends for begin in range(end - MIN_FRAME + 1))
    assert holds_a_good_frame(octets) == holds
