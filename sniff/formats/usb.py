"""Headers of USB packets as Linux (usbmon) and Windows (USBPcap) capture them, as far as serial adapters need it. Pure.

| link type | header |
|---|---|
| 189, 220 | usbmon: 48 or 64 octets in the byte order of the machine; event, kind of transfer, endpoint, device at 8, \
bus at 12, why there are no octets at 15, length at 32, kept at 36 |
| 249 | USBPcap: its length, id, status, function, information, bus, device, endpoint, kind of transfer, length |

What a device sends lies in the record of the end of a transfer, what it is sent in that of its begin. usbmon keeps
the eight octets that begin a control transfer in its header; USBPcap puts them before the octets, and says behind its
header which stage of the transfer it is.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

from sniff.formats.records import cut_off

USBMON, USBMON_LONG, USBPCAP = 189, 220, 249
USB = frozenset((USBMON, USBMON_LONG, USBPCAP))
"""Link types of USB."""

_CONTROL, _BULK = 2, 3
SETUP = 8
"""Octets that begin a control transfer."""
_HEADERS = {USBMON: 48, USBMON_LONG: 64}
_PCAP_HEADER = struct.Struct("<HQIHBHHBBI")
_SUBMITTED, _COMPLETED = ord("S"), ord("C")
_TO_HOST = 0x80
_FROM_DEVICE = 1


@dataclass(frozen=True, slots=True)
class Transfer:
    """Octets that one bulk transfer carried. `device`: of a bus and a number; `lost`: octets at its end that were not
    captured, -1 for nobody knows how many.
    """

    device: tuple[int, int]
    endpoint: int
    to_host: bool
    octets: bytes
    lost: int = 0


@dataclass(frozen=True, slots=True)
class Stage:
    """A part of a control transfer. `transfer`: which one, among those under way; `setup`: what begins it, b"" in a
    later part; `ended`: whether it went well, None before its end.
    """

    device: tuple[int, int]
    transfer: bytes
    setup: bytes
    octets: bytes
    ended: bool | None = None


def stage_of(link_type: int, data: bytes) -> Stage | None:
    """The part of a control transfer that a record is; None where it is none. Total."""
    try:
        return _stage_of_windows(data) if link_type == USBPCAP else _stage_of_linux(data, _HEADERS[link_type])
    except (struct.error, IndexError):  # cut short
        return None


def _stage_of_linux(data: bytes, header: int) -> Stage | None:
    event, kind, _, device = struct.unpack_from("4B", data, 8)
    if kind != _CONTROL or event not in (_SUBMITTED, _COMPLETED) or len(data) < header:
        return None
    bus, length = _bus_and_lengths(data, header)[:2]
    octets = data[header:] if len(data) - header >= length or event == _COMPLETED else b""
    if event == _COMPLETED:
        return Stage((bus, device), data[:8], b"", octets, data[28:32] == bytes(4))
    return Stage((bus, device), data[:8], data[40 : 40 + SETUP] if not data[14] else b"", octets)


def _stage_of_windows(data: bytes) -> Stage | None:
    size, transfer, status, _, info, bus, device, _, kind, _ = _PCAP_HEADER.unpack_from(data)
    if kind != _CONTROL or size < _PCAP_HEADER.size:
        return None
    octets, stage = data[size:], data[_PCAP_HEADER.size] if size > _PCAP_HEADER.size else -1
    name = transfer.to_bytes(8, "little")
    if info & _FROM_DEVICE:
        return Stage((bus, device), name, b"", octets, status == 0) if stage != 1 else None
    if stage == 0:
        return Stage((bus, device), name, octets[:SETUP], octets[SETUP:])
    return Stage((bus, device), name, b"", octets) if stage == 1 else None


def transfer_of(link_type: int, data: bytes) -> Transfer | None:
    """The octets that a record carries in a bulk transfer; None where there are none. Total."""
    try:
        found = _of_windows(data) if link_type == USBPCAP else _of_linux(data, _HEADERS[link_type])
    except (struct.error, IndexError):  # cut short
        return None
    return found if found is not None and (found.octets or found.lost) else None


def _of_linux(data: bytes, header: int) -> Transfer | None:
    event, kind, endpoint, device = struct.unpack_from("4B", data, 8)
    to_host = bool(endpoint & _TO_HOST)
    if kind != _BULK or event != (_COMPLETED if to_host else _SUBMITTED) or data[15]:  # 15: why there are no octets
        return None
    bus, length, kept = _bus_and_lengths(data, header)
    octets = data[header : header + kept]
    return Transfer((bus, device), endpoint & 15, to_host, octets, cut_off(len(octets), length))


def _bus_and_lengths(data: bytes, header: int) -> tuple[int, int, int]:
    """Number of the bus, octets of the transfer and those of them that were kept."""
    bus, length, kept = min(
        (struct.unpack_from(f"{order}H18xII", data, 12) for order in "<>"),
        key=lambda one: abs(one[2] - (len(data) - header)),  # the order in which the lengths fit
    )
    return bus, length, kept


def _of_windows(data: bytes) -> Transfer | None:
    size, _, _, _, info, bus, device, endpoint, kind, length = _PCAP_HEADER.unpack_from(data)
    to_host = bool(endpoint & _TO_HOST)
    if kind != _BULK or to_host != bool(info & _FROM_DEVICE) or size < _PCAP_HEADER.size:
        return None
    octets = data[size : size + length]
    return Transfer((bus, device), endpoint & 15, to_host, octets, cut_off(len(octets), length))
