"""What peek says, and that it says the same in both envelopes and about damaged frames."""

from __future__ import annotations

import string
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dissectors.frame import Check, Damage, Frame, Role
from dissectors.modbus.envelope import seal_ascii, seal_rtu
from dissectors.modbus.functions import FUNCTIONS
from dissectors.modbus.header import peek_ascii, peek_rtu
from dissectors.modbus.text import text

ADU = st.one_of(
    st.binary(min_size=2, max_size=30),
    st.builds(
        lambda unit, code, rest: bytes((unit, code)) + rest,
        st.integers(0, 255),
        st.sampled_from(sorted(FUNCTIONS)),
        st.binary(max_size=20),
    ),
    st.builds(
        lambda code, start, count: bytes((7, code)) + start + count.to_bytes(2, "big"),
        st.integers(1, 6),
        st.binary(min_size=2, max_size=2),
        st.integers(0, 3000),
    ),
)


@pytest.mark.parametrize(
    ("adu", "source", "destination", "address", "count"),
    [
        ("010325200002", None, 1, 0x2520, 2),
        ("01030425202521", 1, None, None, 2),
        ("010100000014", None, 1, 0, 20),
        ("010102ffff", 1, None, None, None),
        ("010625010001", None, 1, 0x2501, 1),
        ("000625010001", None, 0, 0x2501, 1),
        ("010f0013000a02cd01", None, 1, 0x13, 10),
        ("011001010002", 1, None, 0x0101, 2),
        ("0116000400f20025", None, 1, 4, 1),
        ("011700030006000e00030600ff00ff00ff", None, 1, 3, 6),
        ("011804de", None, 1, 0x04DE, None),
        ("01180006000201b81284", 1, None, None, 2),
        ("012b0e0401", None, 1, 1, None),
        ("018302", 1, None, None, None),
    ],
)
def test_stations_address_and_count(adu, source, destination, address, count, frame_of, peek_any):
    header = peek_any(frame_of(seal_rtu(bytes.fromhex(adu))))
    assert (header.source, header.destination, header.address, header.count) == (source, destination, address, count)


@pytest.mark.parametrize(
    ("adu", "kind", "function"),
    [
        ("018302", "read-holding-registers", 3),
        ("01ab01", "encapsulated-interface", 43),
        ("012b0d0102", "canopen-general-reference", 43),
        ("012b0e0100", "read-device-identification", 43),
        ("01410102", "function-0x41", 0x41),
        ("01c101", "function-0x41", 0x41),
    ],
)
def test_kinds(adu, kind, function, frame_of, peek_any):
    header = peek_any(frame_of(seal_rtu(bytes.fromhex(adu))))
    assert (header.kind, header.function) == (kind, function)


def test_a_good_check_with_a_length_that_fits_nothing_says_so(frame_of, peek_any):
    header = peek_any(frame_of(seal_rtu(bytes.fromhex("01020201"))))
    assert (header.ok, header.role) == (True, Role.UNKNOWN)
    assert header.error == "6 octets fit neither request nor response"


def test_a_good_check_with_a_length_that_its_own_count_contradicts_says_so(frame_of):
    """The framer gives such a frame with the length that its first octets predict."""
    header = peek_rtu(replace(frame_of(seal_rtu(bytes.fromhex("01020201"))), expected=7))
    assert (header.ok, header.role) == (True, Role.RESPONSE)
    assert header.error == "6 octets where its own count makes it 7"


def test_the_same_in_ascii(frame_of):
    frame = frame_of(seal_ascii(bytes.fromhex("01020201")))
    header = peek_ascii(replace(frame, expected=len(frame.octets) + 2))
    assert (header.role, header.error) == (Role.RESPONSE, "6 octets where its own count makes it 7")


@pytest.mark.parametrize("ending", [b"\r\n", b"\r", b"\r;"])
def test_other_ends_of_ascii_frames_change_nothing(ending, frame_of):
    octets = seal_ascii(bytes.fromhex("01030425202521"))[:-2] + ending
    frame = replace(frame_of(octets), check=Check.GOOD, damage=None, expected=len(octets))
    header = peek_ascii(frame)
    assert (header.role, header.count, header.error) == (Role.RESPONSE, 2, None)


@given(adu=ADU)
def test_both_envelopes_say_the_same(frame_of, adu):
    rtu, ascii_ = peek_rtu(frame_of(seal_rtu(adu))), peek_ascii(frame_of(seal_ascii(adu)))
    assert replace(rtu, protocol="") == replace(ascii_, protocol="")


@given(adu=ADU, response=st.booleans())
def test_text_never_holds_what_a_terminal_or_markup_minds(frame_of, adu, response):
    frame = frame_of(seal_rtu(adu))
    for role in Role:
        line = text(frame, peek_rtu(frame), role)
        assert line
        assert all(c.isprintable() for c in line)
        assert not any(word in line for word in ("{", "}", "None"))


def test_hostile_text_of_a_device_is_escaped(frame_of, peek_any):
    adu = b"\x01\x11\x0c" + b'\x1b[2J"{x}\\\xff\n\xff'
    frame = frame_of(seal_rtu(adu))
    line = text(frame, peek_any(frame), Role.RESPONSE)
    assert line == '1 → server id "\\x1B[2J\\x22\\x7Bx\\x7D\\x5C\\xFF\\x0A", running'


@given(
    octets=st.binary(max_size=60),
    damage=st.sampled_from([None, *Damage]),
    check=st.sampled_from(Check),
    expected=st.one_of(st.none(), st.integers(0, 600)),
    characters=st.text(string.hexdigits + ":\r\n ", max_size=60),
)
def test_any_frame(frame_of, octets, damage, check, expected, characters):
    for raw, peek in ((octets, peek_rtu), (characters.encode(), peek_ascii), (octets, peek_ascii)):
        protocol = "modbus-rtu" if peek is peek_rtu else "modbus-ascii"
        frame = replace(
            frame_of(b"\0\0\0\0"), octets=raw, protocol=protocol, damage=damage, check=check, expected=expected
        )
        header = peek(frame)
        assert header.ok == frame.ok
        assert header.ok or header.error
        assert text(frame, header, header.role).isprintable()


def short(frame: Frame, left: int) -> Frame:
    return replace(
        frame, octets=frame.octets[:left], check=Check.ABSENT, damage=Damage.SHORT, expected=len(frame.octets)
    )


@pytest.mark.parametrize(
    ("adu", "left", "role", "line"),
    [
        ("01030425202521", 7, Role.RESPONSE, "1 → 2 registers: 9504 9505 [short: 7 octets, 9 expected]"),
        ("01030425202521", 5, Role.RESPONSE, "1 → 2 registers: 9504 [short: 5 octets, 9 expected]"),
        ("010325200002", 4, Role.REQUEST, "1 ← read holding: 25 20 [short: 4 octets, 8 expected]"),
        ("010325200002", 1, Role.UNKNOWN, "01 [short: 1 octet, 8 expected]"),
    ],
)
def test_a_short_frame_says_what_is_there(adu, left, role, line, frame_of):
    frame = short(frame_of(seal_rtu(bytes.fromhex(adu))), left)
    header = peek_rtu(frame)
    assert (header.ok, header.role) == (False, role)
    assert text(frame, header, header.role) == line


def test_a_long_frame_is_read_at_its_own_length(frame_of):
    frame = frame_of(seal_rtu(bytes.fromhex("010325200002")) + b"\x55\x55")
    frame = replace(frame, damage=Damage.LONG, expected=8)
    header = peek_rtu(frame)
    assert (header.role, header.address, header.count) == (Role.REQUEST, 0x2520, 2)
    assert header.error == "long: 10 octets, 8 expected"


def test_lower_case_and_parity_bits_of_ascii(frame_of):
    good = b":010325200002b5\r\n"
    with_parity = bytes(c | 0x80 if c in b"13" else c for c in good)
    for octets in (good, with_parity):
        header = peek_ascii(frame_of(octets))
        assert (header.ok, header.address, header.count) == (True, 0x2520, 2)


def test_a_wrong_lrc_says_so(frame_of, peek_any):
    header = peek_any(frame_of(b":010300000004B8\r\n"))
    assert (header.ok, header.error) == (False, "LRC error")
    assert header.kind == "read-holding-registers"


RTU_CAPTURES = (
    "modbus-rtu-daly-ble-responses",
    "modbus-rtu-daly-ess",
    "modbus-rtu-delta-dtb4824",
    "modbus-rtu-omega-cn7500",
    "sigrok-brainchild-io16do",
    "sigrok-flowmeter-graph_tool",
    "sigrok-flowmeter-target_20liter_per_min",
    "vectors-minimalmodbus-rtu",
)


@pytest.mark.parametrize("name", RTU_CAPTURES)
def test_real_traffic_is_read_with_the_direction_that_its_source_gives(name, shared, frame_of, peek_any):
    told = {
        " req ": Role.REQUEST,
        " rsp ": Role.RESPONSE,
        ">>>": Role.REQUEST,
        "<<<": Role.RESPONSE,
        "line=tx": Role.REQUEST,
        "line=rx": Role.RESPONSE,
    }
    seen = 0
    for line in shared(name):
        frame = frame_of(line.octets)
        header = peek_any(frame)
        assert header.ok == ("crc=ok" in line.note), line
        if not frame.ok or "WRONG" in line.note:
            continue
        seen += 1
        for word, role in told.items():
            if word in f" {line.note} ":
                assert header.role in (role, Role.EITHER), line
        assert header.error is None or line.octets[1] & 0x80 or "vectors" in name, line
    assert seen
