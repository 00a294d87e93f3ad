"""The simulated server and master: against the standard, against pymodbus, and against each other."""

from __future__ import annotations

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymodbus.pdu import DecodePDU
from pymodbus.pdu.bit_message import ReadCoilsRequest, WriteMultipleCoilsRequest, WriteSingleCoilRequest
from pymodbus.pdu.register_message import (
    MaskWriteRegisterRequest,
    ReadHoldingRegistersRequest,
    ReadInputRegistersRequest,
    ReadWriteMultipleRegistersRequest,
    WriteMultipleRegistersRequest,
    WriteSingleRegisterRequest,
)

from dissectors.line import LineSettings
from dissectors.modbus.envelope import seal_ascii, seal_rtu, unseal
from dissectors.modbus.simulated import Cells, ModbusServer
from dissectors.modbus.simulated_e510 import EXTERNAL_FAULT, FAULT_RESET, RUN, SimulatedE510
from dissectors.modbus.simulated_master import PollingMaster, read_holding, write_register, write_registers
from dissectors.modbus.tracker import ModbusTracker

MS = 1_000_000
LINE = LineSettings.parse("19200,8E1")


@pytest.fixture
def server():
    return ModbusServer(
        1,
        holding=Cells({address: address for address in range(100)}),
        input=Cells({0: lambda: 42}),
        coils=Cells({address: address % 3 == 0 for address in range(32)}),
        discrete=Cells({0: 1, 1: 0}),
    )


def ask(server, pdu: bytes, unit: int = 1) -> bytes | None:
    answer = server.respond(bytes((unit,)) + pdu)
    return None if answer is None else answer[1:]


@pytest.mark.parametrize(
    ("pdu", "answer"),
    [
        ("0100000010", "01024992"),
        ("0200000002", "020101"),
        ("0300050002", "030400050006"),
        ("0400000001", "0402002a"),
        ("050001ff00", "050001ff00"),
        ("0600020007", "0600020007"),
        ("07", "0700"),
        ("080000a537", "080000a537"),
        ("0f0000000a02cd01", "0f0000000a"),
        ("1000010002040001 0002", "1000010002"),
        ("11", "110473696dff"),
        ("16000400f20025", "16000400f20025"),
        ("170000000200060001020007", "170400000001"),
        ("2b0e0401", "2b0e048100000101 0973696d756c61746564"),
        ("0300630002", "8302"),  # 0x64 is not there
        ("0300000000", "8303"),
        ("030000007e", "8303"),
        ("0500001234", "8503"),
        ("0600", "8603"),
        ("0400010001", "8402"),
        ("41", "c101"),
        ("080015 0000", "8803"),
    ],
)
def test_answers(server, pdu, answer):
    assert ask(server, bytes.fromhex(pdu)) == bytes.fromhex(answer)


def test_what_was_written_is_read_back(server):
    ask(server, bytes.fromhex("0f0000000a02cd01"))
    assert ask(server, bytes.fromhex("010000000a")) == bytes.fromhex("0102cd01")
    ask(server, bytes.fromhex("100001000204aaaabbbb"))
    assert ask(server, bytes.fromhex("0300010002")) == bytes.fromhex("0304aaaabbbb")
    ask(server, bytes.fromhex("16000100f20025"))
    assert ask(server, bytes.fromhex("0300010001")) == struct.pack(">BBH", 3, 2, (0xAAAA & 0xF2) | (0x25 & ~0xF2))


def test_a_broadcast_is_obeyed_and_not_answered(server):
    assert ask(server, bytes.fromhex("0600020007"), unit=0) is None
    assert server.holding.read(2) == 7
    assert ask(server, bytes.fromhex("0300020001"), unit=0) is None


def test_another_unit_and_a_damaged_frame_are_not_answered(server):
    assert ask(server, bytes.fromhex("0300020001"), unit=2) is None
    assert server.answer(b"\x01\x03\x00\x02\x00\x01\xff\xff") is None
    assert ask(server, bytes.fromhex("08000c0000")) == bytes.fromhex("08000c0001"), "it counts damaged frames"


def test_listen_only_mode(server):
    assert ask(server, bytes.fromhex("0800040000")) is None
    assert ask(server, bytes.fromhex("0300020001")) is None
    assert ask(server, bytes.fromhex("0800010000")) is None, "the restart that ends it is not answered"
    assert ask(server, bytes.fromhex("0300020001")) is not None


def test_vendor_exception_codes():
    server = ModbusServer(1, codes={(3, 2): 0x52})
    assert ask(server, bytes.fromhex("0300000001")) == b"\x83\x52"


@given(octets=st.binary(max_size=40), is_ascii=st.booleans(), sealed=st.booleans())
def test_any_octets(octets, is_ascii, sealed):
    server = ModbusServer(1, is_ascii=is_ascii)
    if sealed:
        octets = (seal_ascii if is_ascii else seal_rtu)(b"\x01" + octets)
    for send in server.hear(0, octets, True):
        assert send.at == server.delay
        assert unseal(send.octets, is_ascii) is not None


# ---- pymodbus asks, and understands the answers

REGISTER = st.integers(0, 0xFFFF)
REQUESTS = st.one_of(
    st.builds(ReadCoilsRequest, address=st.integers(0, 20), count=st.integers(1, 12)),
    st.builds(ReadHoldingRegistersRequest, address=st.integers(0, 60), count=st.integers(1, 40)),
    st.builds(ReadInputRegistersRequest, address=st.just(0), count=st.just(1)),
    st.builds(
        WriteSingleRegisterRequest, address=st.integers(0, 99), registers=st.lists(REGISTER, min_size=1, max_size=1)
    ),
    st.builds(WriteSingleCoilRequest, address=st.integers(0, 31), bits=st.lists(st.booleans(), min_size=1, max_size=1)),
    st.builds(
        WriteMultipleCoilsRequest, address=st.integers(0, 10), bits=st.lists(st.booleans(), min_size=1, max_size=20)
    ),
    st.builds(
        WriteMultipleRegistersRequest, address=st.integers(0, 50), registers=st.lists(REGISTER, min_size=1, max_size=20)
    ),
    st.builds(MaskWriteRegisterRequest, address=st.integers(0, 99), and_mask=REGISTER, or_mask=REGISTER),
    st.builds(
        ReadWriteMultipleRegistersRequest,
        read_address=st.integers(0, 60),
        read_count=st.integers(1, 20),
        write_address=st.integers(0, 60),
        write_registers=st.lists(REGISTER, min_size=1, max_size=20),
    ),
)


@given(request=REQUESTS)
def test_pymodbus_reads_what_it_asked_for(request, frame_of, peek_any):
    server = ModbusServer(
        1,
        holding=Cells({address: address for address in range(100)}),
        input=Cells({0: 42}),
        coils=Cells({address: address & 1 for address in range(32)}),
    )
    pdu = bytes((request.function_code,)) + request.encode()
    answer = ask(server, pdu)
    decoded = DecodePDU(False).decode(answer)
    assert decoded is not None
    assert not decoded.isError()
    if type(request) is ReadHoldingRegistersRequest:
        assert decoded.registers == list(range(request.address, request.address + request.count))
    if isinstance(request, ReadCoilsRequest):
        assert decoded.bits[: request.count] == [
            bool(a & 1) for a in range(request.address, request.address + request.count)
        ]
    header = peek_any(frame_of(seal_rtu(b"\x01" + pdu)))
    address = getattr(request, "read_address", None) or request.address
    assert (header.role.value, header.function) in ((r, request.function_code) for r in ("request", "either"))
    if header.role.value == "request":
        assert header.address == address
    assert peek_any(frame_of(seal_rtu(b"\x01" + answer))).role.value in ("response", "either")


# ---- a master and servers on one bus


def play(master, servers, until, deaf=()):
    """A bus with its clock: every burst ends, is heard by all others, and its answers follow. Gives (start, octets)."""
    said, waiting = [], []  # waiting: (when, what, who)
    while True:
        wake = master.next_wake()
        if waiting and min(waiting, key=lambda item: item[0])[0] <= wake:
            now, octets, speaker = min(waiting, key=lambda item: item[0])
            waiting.remove((now, octets, speaker))
            said.append((now, octets))
            end = now + len(octets) * LINE.char
            for station in (master, *servers):
                if station is not speaker and len(said) not in deaf:
                    waiting += [(send.at, send.octets, station) for send in station.hear(end, octets, True)]
        else:
            now = wake
            waiting += [(send.at, send.octets, master) for send in master.wake(now)]
        if now > until:
            return said


@pytest.mark.parametrize("is_ascii", [False, True])
def test_a_master_polls_its_servers_and_the_tracker_reads_it(is_ascii, frame_of, peek_any, server):
    server.is_ascii = is_ascii
    drive = SimulatedE510(2, is_ascii=is_ascii)
    requests = [
        read_holding(1, 0, 4),
        write_register(2, 0x2502, 6000),
        read_holding(2, 0x2520, 8),
        read_holding(9, 0, 1),
    ]
    master = PollingMaster(requests, LINE, is_ascii=is_ascii, timeout=200 * MS, retries=1)
    said = play(master, [server, drive], until=3_500 * MS)
    tracker, closed = ModbusTracker(_timing()), []
    for no, (start, octets) in enumerate(said, 1):
        frame = frame_of(octets, start=start, end=start + len(octets) * LINE.char)
        closed += tracker.track(no, frame, peek_any(frame)).closed
    verdicts = [transaction.verdict.value for transaction in closed]
    assert verdicts[:10] == ["answered"] * 3 + ["no-response"] * 2 + ["answered"] * 3 + ["no-response"] * 2
    assert master.answered == 12
    assert master.failed == 4
    assert master.repeated == 4
    assert tracker.timeout == pytest.approx(200 * MS, abs=MS)


def _timing():
    from dissectors.line import Timing

    return Timing(LINE)


def test_a_lost_request_is_repeated_and_the_repeat_answered(server):
    master = PollingMaster([read_holding(1, 0, 1)], LINE, timeout=100 * MS, retries=2)
    said = play(master, [server], until=900 * MS, deaf={1})
    assert [octets for _, octets in said][:2] == [seal_rtu(read_holding(1, 0, 1))] * 2
    assert (master.repeated, master.answered, master.failed) == (1, 1, 0)
    wait = said[1][0] - said[0][0] - 8 * LINE.char
    assert wait == 100 * MS


def test_rounds_begin_at_their_interval(server):
    master = PollingMaster([read_holding(1, 0, 1), read_holding(1, 1, 1)], LINE, interval=300 * MS)
    starts = [start for start, octets in play(master, [server], until=1_000 * MS) if len(octets) == 8]
    assert starts[0::2] == [0, 300 * MS, 600 * MS, 900 * MS]


def test_after_a_broadcast_the_master_waits_for_nobody(server):
    master = PollingMaster([write_register(0, 1, 5), read_holding(1, 1, 1)], LINE, turnaround=120 * MS)
    said = play(master, [server], until=600 * MS)
    assert said[1][0] == 8 * LINE.char + 120 * MS
    assert unseal(said[2][1], False) == bytes.fromhex("0103020005")
    assert master.failed == 0


def test_requests_may_change_with_time(server):
    master = PollingMaster([lambda now: write_register(1, 1, now // MS)], LINE, interval=100 * MS)
    said = play(master, [server], until=250 * MS)
    assert [int.from_bytes(octets[4:6], "big") for _, octets in said[0::2]] == [0, 100, 200]


# ---- the drive


def drive_at(drive, now, pdu):
    (send,) = drive.hear(now, seal_rtu(b"\x01" + bytes.fromhex(pdu)), True)
    assert send.at == now + drive.delay
    return unseal(send.octets, False)[1:]


def test_the_drive_runs_up_to_its_command_and_down_again():
    drive = SimulatedE510(1, ramp=1_000)  # 10 Hz a second
    drive.hear(0, seal_rtu(write_registers(1, 0x2501, [RUN, 6000])), True)
    half = struct.unpack(">BB8H", drive_at(drive, 3_000 * MS, "0325200008"))[2:]
    assert half[0] & 0b101 == 0b101, "runs, is ready"
    assert (half[3], half[4]) == (6000, 3000)
    assert not half[0] & 0x80, "not at its frequency yet"
    full = struct.unpack(">BB8H", drive_at(drive, 7_000 * MS, "0325200008"))[2:]
    assert full[4] == 6000
    assert full[0] & 0x80
    assert half[7] > full[7] > 0, "accelerating takes more current"
    assert abs(full[6] - 3250) < 150
    drive.hear(7_000 * MS, seal_rtu(write_register(1, 0x2501, 0)), True)
    stopped = struct.unpack(">BB8H", drive_at(drive, 20_000 * MS, "0325200008"))[2:]
    assert (stopped[4], stopped[7]) == (0, 0)
    assert stopped[0] & 0x20, "zero speed"


def test_an_external_fault_stops_the_drive_until_it_is_reset():
    drive = SimulatedE510(1)
    drive.hear(0, seal_rtu(write_registers(1, 0x2501, [RUN | EXTERNAL_FAULT, 6000])), True)
    status, fault = struct.unpack(">BBHH", drive_at(drive, 5_000 * MS, "0325200002"))[2:]
    assert (status & 0b1101, fault) == (0b1000, 17)
    drive.hear(5_000 * MS, seal_rtu(write_register(1, 0x2501, FAULT_RESET)), True)
    status, fault = struct.unpack(">BBHH", drive_at(drive, 5_100 * MS, "0325200002"))[2:]
    assert (status & 0b1100, fault) == (0b0100, 0)


@pytest.mark.parametrize(
    ("pdu", "table", "examples"),
    [
        ("0401230001", "8401", "8401"),  # function 4 is not there
        ("0301230001", "8302", "8352"),  # 0123h is no register of this map
        ("032520007d", "8303", "8352"),  # an answer of over 80 octets
        ("06250 2ffff", "8604", "8652"),
        ("0625240001", "8605", "8652"),
        ("08000100", "8803", "8820"),
    ],
)
def test_exceptions_as_the_table_and_as_the_examples_of_the_manual_have_them(pdu, table, examples):
    for flag, answer in ((False, table), (True, examples)):
        assert drive_at(SimulatedE510(1, examples=flag), 0, pdu.replace(" ", "")).hex() == answer


def test_the_worked_loop_back_of_the_manual():
    drive = SimulatedE510(1)
    (send,) = drive.hear(0, bytes.fromhex("01080000a537da8d"), True)
    assert send.octets == bytes.fromhex("01080000a537da8d")


def test_parameters_are_stored():
    drive = SimulatedE510(1)
    assert drive_at(drive, 0, "0600050063").hex() == "0600050063"
    assert drive_at(drive, 0, "0300050001").hex() == "03020063"
    assert drive_at(drive, 0, "0300150001").hex() == "8302", "0-21 does not exist"
