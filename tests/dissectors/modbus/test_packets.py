"""Packets against peek: the same unit, function, address, count and check; and the octets come back."""

from __future__ import annotations

import struct
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dissectors.checksums import crc16_modbus, lrc
from dissectors.frame import Check, Damage, Frame, Role
from dissectors.modbus.envelope import seal_ascii, seal_rtu
from dissectors.modbus.packets import ASCII, RTU, dissect
from dissectors.modbus.pdus import (
    RESPONSES,
    Cut,
    ExceptionResponse,
    FileRecordRequest,
    FileRecordWrite,
    GetCommEventLogResponse,
    IdentificationObject,
    ReadDeviceIdentificationResponse,
    ReadFileRecordRequest,
    ReadHoldingRegistersRequest,
    ReadHoldingRegistersResponse,
    ReportServerIdResponse,
    WriteFileRecordRequest,
    WriteMultipleRegistersRequest,
    WriteSingleCoilRequest,
)

REGISTER = st.integers(0, 0xFFFF)
ADDRESS_FIELDS = ("startAddr", "outputAddr", "registerAddr", "refAddr", "readStartingAddr", "FIFOPointerAddr")
COUNT_FIELDS = ("quantity", "quantityOutput", "quantityRegisters", "readQuantityRegisters", "FIFOCount")


def rebuilt(packet) -> bytes:
    """The octets from the fields, not from what scapy keeps of the dissection."""
    layer = packet
    while layer:
        layer.clear_cache()
        layer = layer.payload
    return bytes(packet)


def agree(frame: Frame, header) -> None:
    """Peek and packet say the same; in both roles the octets come back."""
    for role in (Role.REQUEST, Role.RESPONSE):
        assert rebuilt(dissect(frame, role)) == frame.octets
    packet = dissect(frame, Role.EITHER)
    assert packet.unit == (header.source if header.role is Role.RESPONSE else header.destination)
    check = packet.get_field("lrc" if frame.protocol == "modbus-ascii" else "crc")
    assert ("wrong" in check.i2repr(packet, packet.getfieldval(check.name))) == (not header.ok)
    if header.role is Role.UNKNOWN:
        return
    pdu = packet.payload
    assert pdu.funcCode & 0x7F == header.function
    assert isinstance(pdu, ExceptionResponse) == bool(frame.ok and pdu.funcCode & 0x80)
    if header.role is Role.RESPONSE and not isinstance(pdu, ExceptionResponse) and header.function in RESPONSES:
        assert type(pdu).__name__.endswith("Response")
    told = header.role is not Role.EITHER or header.address is not None  # else the direction decides what they are
    for field in pdu.fields_desc if told else ():
        if field.name in ADDRESS_FIELDS:
            assert pdu.getfieldval(field.name) == header.address
        elif field.name in COUNT_FIELDS:
            assert pdu.getfieldval(field.name) == header.count
        elif field.name == "registerVal":
            assert len(pdu.registerVal) == header.count
    odd = header.error is not None and header.error.startswith("an exception of")
    assert odd or not packet.haslayer("Raw"), "a good frame of a known kind has no octets left over"


def registers(least, most):
    return st.lists(REGISTER, min_size=least, max_size=most).map(
        lambda values: struct.pack(f">{len(values)}H", *values)
    )


def counted(code, data):
    return data.map(lambda octets: bytes((code, len(octets))) + octets)


def fixed(code, *formats):
    return st.tuples(*(st.integers(0, 256 ** struct.calcsize(f) - 1) for f in formats)).map(
        lambda values: struct.pack(">B" + "".join(formats), code, *values)
    )


def written(code, data, per_octet):
    return st.tuples(REGISTER, data).map(
        lambda pair: struct.pack(">BHHB", code, pair[0], int(len(pair[1]) * per_octet), len(pair[1])) + pair[1]
    )


def file_groups(code, group):
    return counted(code, st.lists(group, min_size=1, max_size=4).map(b"".join))


OBJECT = st.tuples(st.integers(0, 255), st.binary(max_size=20)).map(
    lambda pair: bytes((pair[0], len(pair[1]))) + pair[1]
)

PDUS = {
    "bits request": fixed(1, "H", "H") | fixed(2, "H", "H"),
    "bits response": counted(1, st.binary(min_size=1, max_size=250)) | counted(2, st.binary(min_size=1, max_size=250)),
    "registers request": fixed(3, "H", "H") | fixed(4, "H", "H"),
    "registers response": counted(3, registers(1, 125)) | counted(4, registers(1, 125)),
    "coil": st.tuples(REGISTER, st.booleans()).map(lambda p: struct.pack(">BHH", 5, p[0], 0xFF00 * p[1])),
    "register": fixed(6, "H", "H"),
    "status": st.just(b"\x07") | fixed(7, "B"),
    "diagnostics": st.tuples(st.sampled_from((0, 1, 2, 3, 4, 10, 11, 18, 20)), REGISTER).map(
        lambda p: struct.pack(">BHH", 8, *p)
    ),
    "event counter": st.just(b"\x0b") | fixed(11, "H", "H"),
    "event log": st.just(b"\x0c") | counted(12, st.binary(min_size=6, max_size=70)),
    "write coils": written(15, st.binary(min_size=1, max_size=246), 8),
    "write coils response": fixed(15, "H", "H"),
    "write registers": written(16, registers(1, 123), 0.5),
    "write registers response": fixed(16, "H", "H"),
    "server id": st.just(b"\x11") | counted(17, st.binary(min_size=1, max_size=60)),
    "read file": file_groups(20, fixed(6, "H", "H", "H")),
    "read file response": file_groups(20, registers(1, 20).map(lambda data: bytes((len(data) + 1, 6)) + data)),
    "write file": file_groups(
        21,
        st.tuples(REGISTER, REGISTER, registers(1, 10)).map(
            lambda p: struct.pack(">BHHH", 6, p[0], p[1], len(p[2]) // 2) + p[2]
        ),
    ),
    "mask": fixed(22, "H", "H", "H"),
    "read write": st.tuples(REGISTER, st.integers(1, 125), REGISTER, registers(1, 121)).map(
        lambda p: struct.pack(">BHHHHB", 23, p[0], p[1], p[2], len(p[3]) // 2, len(p[3])) + p[3]
    ),
    "read write response": counted(23, registers(1, 125)),
    "fifo": fixed(24, "H"),
    "fifo response": registers(0, 31).map(lambda d: struct.pack(">BHH", 24, len(d) + 2, len(d) // 2) + d),
    "identification": fixed(43, "B", "B", "B").map(lambda pdu: b"\x2b\x0e\x01" + pdu[3:]),
    "identification response": st.tuples(st.binary(min_size=4, max_size=4), st.lists(OBJECT, max_size=5)).map(
        lambda p: b"\x2b\x0e" + b"\x01" + p[0][1:] + bytes((len(p[1]),)) + b"".join(p[1])
    ),
    "another interface": st.binary(max_size=10).map(lambda data: b"\x2b\x0d" + data),
    "exception": st.tuples(st.integers(0x81, 0xFF), st.integers(0, 255)).map(bytes),
    "vendor": st.tuples(st.integers(65, 72), st.binary(max_size=20)).map(lambda p: bytes((p[0],)) + p[1]),
}


@pytest.mark.parametrize("name", PDUS)
@settings(max_examples=25, deadline=None)
@given(data=st.data(), unit=st.integers(0, 255))
def test_every_function_in_both_envelopes(name, data, unit, frame_of, peek_any):
    adu = bytes((unit,)) + data.draw(PDUS[name])
    for octets in (seal_rtu(adu), seal_ascii(adu)):
        frame = frame_of(octets)
        agree(frame, peek_any(frame))


CAPTURES = (
    "modbus-ascii-misc",
    "modbus-rtu-daly-ble-responses",
    "modbus-rtu-daly-ess",
    "modbus-rtu-delta-dtb4824",
    "modbus-rtu-omega-cn7500",
    "sigrok-brainchild-io16do",
    "sigrok-flowmeter-target_20liter_per_min",
    "vectors-minimalmodbus-rtu",
    "vectors-modbus-suites",
)


@pytest.mark.parametrize("name", CAPTURES)
def test_every_captured_frame(name, shared, frame_of, peek_any):
    seen = 0
    for octets in {line.octets for line in shared(name)}:
        frame = frame_of(octets)
        if frame.ok:
            seen += 1
            header = peek_any(frame)
            if header.role is not Role.UNKNOWN:
                agree(frame, header)
    assert seen


@given(
    octets=st.binary(max_size=30),
    as_text=st.booleans(),
    role=st.sampled_from((Role.REQUEST, Role.RESPONSE, Role.EITHER, Role.UNKNOWN, Role.BROADCAST)),
    damage=st.sampled_from([None, *Damage]),
    check=st.sampled_from(Check),
    left=st.integers(0, 60),
)
def test_any_octets_come_back(octets, as_text, role, damage, check, left, frame_of):
    """Total: nothing raises, nothing is lost, and what can be shown can be shown."""
    raw = (b":" + octets.hex().encode() + b"\r\n")[:left] if as_text else octets
    protocol = "modbus-ascii" if as_text else "modbus-rtu"
    frame = replace(frame_of(b"\0\0\0\0"), octets=raw, protocol=protocol, damage=damage, check=check, expected=9)
    packet = dissect(frame, role)
    assert rebuilt(packet) == raw
    assert packet.show(dump=True)


def test_a_frame_cut_short_shows_what_is_there_and_says_so(frame_of):
    whole = frame_of(seal_rtu(bytes.fromhex("010325200002")))
    frame = replace(whole, octets=whole.octets[:3], check=Check.ABSENT, damage=Damage.SHORT, expected=8)
    packet = dissect(frame, Role.REQUEST)
    assert packet.name == "Modbus RTU [short: 3 octets, 8 expected]"
    assert [field.name for field in packet.payload.fields_desc] == ["funcCode"]
    assert packet[Cut].load == b"\x25"


def test_a_wrong_check_is_shown_with_the_right_one(frame_of):
    shown = dissect(frame_of("0103021770af82"), Role.RESPONSE).show(dump=True)
    assert "crc       = 0xAF82 [wrong, should be 0xB650]" in shown


CRAFTED = [
    (ReadHoldingRegistersRequest(startAddr=0x2520, quantity=2), "0325200002"),
    (ReadHoldingRegistersResponse(registerVal=[0x2520, 0x2521]), "030425202521"),
    (WriteSingleCoilRequest(outputAddr=16, outputValue=0xFF00), "050010ff00"),
    (WriteMultipleRegistersRequest(startAddr=0x101, outputsValue=[1, 6000]), "10010100020400011770"),
    (GetCommEventLogResponse(eventCount=264, messageCount=289, event=[0x20, 0]), "0c080000010801212000"),
    (ReportServerIdResponse(serverId=b"Pymodbus\xff"), "110950796d6f64627573ff"),
    (
        ReadFileRecordRequest()
        / FileRecordRequest(fileNumber=4, recordNumber=1, recordLength=2)
        / FileRecordRequest(fileNumber=3, recordNumber=9, recordLength=2),
        "140e0600040001000206000300090002",
    ),
    (
        WriteFileRecordRequest() / FileRecordWrite(fileNumber=4, recordNumber=7, recordData=[0x6AF, 0x4BE, 0x100D]),
        "150d0600040007000306af04be100d",
    ),
    (
        ReadDeviceIdentificationResponse(readCode=1, conformityLevel=1, objCount=1)
        / IdentificationObject(id=0, value=b"TECO"),
        "2b0e010100000100045445434f",
    ),
    (ExceptionResponse(funcCode=0x83, exceptCode=0x52), "8352"),
]


@pytest.mark.parametrize(("pdu", "octets"), CRAFTED, ids=lambda value: type(value).__name__)
def test_crafting(pdu, octets):
    adu = b"\x01" + bytes.fromhex(octets)
    crc = crc16_modbus(adu).to_bytes(2, "little")
    assert bytes(RTU(unit=1) / pdu) == adu + crc
    assert bytes(ASCII(unit=1) / pdu) == b":" + (adu + bytes((lrc(adu),))).hex().upper().encode() + b"\r\n"


def test_a_forged_check_stays_and_another_end_too():
    request = ReadHoldingRegistersRequest(startAddr=0, quantity=1)
    assert bytes(RTU(unit=1, crc=0xDEAD) / request).endswith(b"\xde\xad")
    assert bytes(ASCII(unit=1, lrc=0, end=b"\r;") / request) == b":01030000000100\r;"


def test_a_changed_field_changes_the_octets(frame_of):
    """What was dissected can be edited: the check follows when it is let go."""
    packet = dissect(frame_of("010325200002cecd"), Role.REQUEST)
    packet.payload.quantity = 3
    packet.crc = None
    assert bytes(packet) == seal_rtu(bytes.fromhex("010325200003"))


def test_lower_case_survives(frame_of):
    frame = frame_of(b":010325200002b5\r\n")
    assert rebuilt(dissect(frame, Role.REQUEST)) == frame.octets
