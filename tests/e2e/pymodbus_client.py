"""Everything that a Modbus client made by others can ask, as data: name, function code, and the call.

Of pymodbus 3.16: its RTU client does not understand the answer to "read FIFO queue", though the server sends it right;
its ASCII server takes the delimiter of "change ASCII delimiter" at once, and wrongly; its server answers for units that
it does not have. A frame that its server cannot decode is answered with function code 80 hex, which is no exception of
anything; none of the questions leads there.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from pymodbus import FramerType
from pymodbus.client import ModbusSerialClient
from pymodbus.pdu.file_message import FileRecord


class Question(NamedTuple):
    """`function`: the code on the wire. `verdict`: of the transaction. `only`: the framing it works in, "" for both."""

    function: int
    ask: Callable[[ModbusSerialClient], Any]
    verdict: str = "answered"
    only: str = ""


RECORD_TO_READ = FileRecord(file_number=1, record_number=2, record_length=8)
RECORD_TO_WRITE = FileRecord(file_number=1, record_number=2, record_data=b"abcd")

QUESTIONS = {
    "read coils": Question(1, lambda c: c.read_coils(0, count=19)),
    "read coils, one octet": Question(1, lambda c: c.read_coils(3, count=8)),
    "read discrete inputs": Question(2, lambda c: c.read_discrete_inputs(0, count=24)),
    "read holding registers": Question(3, lambda c: c.read_holding_registers(0, count=2)),
    "read many holding registers": Question(3, lambda c: c.read_holding_registers(0, count=60)),
    "read input registers": Question(4, lambda c: c.read_input_registers(5, count=1)),
    "write coil": Question(5, lambda c: c.write_coil(7, True)),
    "write register": Question(6, lambda c: c.write_register(9, 0x1234)),
    "read exception status": Question(7, lambda c: c.read_exception_status()),
    "return query data": Question(8, lambda c: c.diag_query_data(b"\xa5\x5a")),
    "restart communications": Question(8, lambda c: c.diag_restart_communication(True)),
    "read diagnostic register": Question(8, lambda c: c.diag_read_diagnostic_register()),
    "change ASCII delimiter": Question(8, lambda c: c.diag_change_ascii_input_delimeter(delimiter=0x0A), only="rtu"),
    "clear counters": Question(8, lambda c: c.diag_clear_counters()),
    "bus message count": Question(8, lambda c: c.diag_read_bus_message_count()),
    "bus error count": Question(8, lambda c: c.diag_read_bus_comm_error_count()),
    "bus exception count": Question(8, lambda c: c.diag_read_bus_exception_error_count()),
    "device message count": Question(8, lambda c: c.diag_read_device_message_count()),
    "device no response count": Question(8, lambda c: c.diag_read_device_no_response_count()),
    "device NAK count": Question(8, lambda c: c.diag_read_device_nak_count()),
    "device busy count": Question(8, lambda c: c.diag_read_device_busy_count()),
    "overrun count": Question(8, lambda c: c.diag_read_bus_char_overrun_count()),
    "clear overrun count": Question(8, lambda c: c.diag_clear_overrun_counter()),
    "comm event counter": Question(11, lambda c: c.diag_get_comm_event_counter()),
    "comm event log": Question(12, lambda c: c.diag_get_comm_event_log()),
    "write coils": Question(15, lambda c: c.write_coils(2, [True, False] * 5)),
    "write registers": Question(16, lambda c: c.write_registers(4, [1, 2, 3])),
    "report server id": Question(17, lambda c: c.report_device_id()),
    "read file record": Question(20, lambda c: c.read_file_record([RECORD_TO_READ])),
    "write file record": Question(21, lambda c: c.write_file_record([RECORD_TO_WRITE])),
    "mask write register": Question(22, lambda c: c.mask_write_register(address=4, and_mask=0xF2, or_mask=0x25)),
    "read and write registers": Question(
        23, lambda c: c.readwrite_registers(read_address=3, read_count=6, write_address=14, values=[255, 254, 253])
    ),
    "read FIFO queue": Question(24, lambda c: c.read_fifo_queue(address=4)),
    "read device identification": Question(43, lambda c: c.read_device_information(read_code=1)),
    "read one device identification object": Question(
        43, lambda c: c.read_device_information(read_code=4, object_id=0)
    ),
    "illegal address": Question(3, lambda c: c.read_holding_registers(6000, count=2), "exception"),
    "illegal address to write": Question(16, lambda c: c.write_registers(6000, [1]), "exception"),
    "unit of another server": Question(3, lambda c: c.read_holding_registers(0, count=2, device_id=9), "exception"),
    "broadcast": Question(6, lambda c: c.write_register(1, 7, device_id=0, no_response_expected=True), "broadcast"),
}


def connect(port: str, framing: str, baud: int, timeout: float) -> ModbusSerialClient:
    """A client on a port; `timeout` in seconds for each answer, no retries."""
    client = ModbusSerialClient(
        port,
        framer=FramerType(framing),
        baudrate=baud,
        timeout=timeout,
        retries=0,
    )
    assert client.connect()
    return client
