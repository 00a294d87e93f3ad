"""Headers of USB packets as Linux (usbmon) and Windows (USBPcap) capture them, as far as serial adapters need it. Pure.

| link type | header |
|---|---|
| 189, 220 | usbmon: 48 or 64 octets in the byte order of the machine; event, kind of transfer, endpoint, device at 8, \
bus at 12, why there are no octets at 15, length at 32, kept at 36 |
| 249 | USBPcap: its length, id, status, function, information, bus, device, endpoint, kind of transfer, length |

What a device sends lies in the record of the end of a transfer, what it is sent in that of its begin.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

from sniff.formats.records import cut_off

USBMON, USBMON_LONG, USBPCAP = 189, 220, 249
USB = frozenset((USBMON, USBMON_LONG, USBPCAP))
"""Link types of USB."""

_BULK = 3
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
    bus, length, kept = min(
        (struct.unpack_from(f"{order}H18xII", data, 12) for order in "<>"),
        key=lambda one: abs(one[2] - (len(data) - header)),  # the order in which the lengths fit
    )
    octets = data[header : header + kept]
    return Transfer((bus, device), endpoint & 15, to_host, octets, cut_off(len(octets), length))


def _of_windows(data: bytes) -> Transfer | None:
    size, _, _, _, info, bus, device, endpoint, kind, length = _PCAP_HEADER.unpack_from(data)
    to_host = bool(endpoint & _TO_HOST)
    if kind != _BULK or to_host != bool(info & _FROM_DEVICE) or size < _PCAP_HEADER.size:
        return None
    octets = data[size : size + length]
    return Transfer((bus, device), endpoint & 15, to_host, octets, cut_off(len(octets), length))
