"""What datagrams of BACnet/IP say to each other without an NPDU: results, registrations, tables (annex J.2)."""

from __future__ import annotations

from collections.abc import Iterator
from ipaddress import IPv4Address

from dissectors.field_types import FieldType, FieldTypes, Kind

FUNCTIONS = {
    0x00: "result",
    0x01: "write broadcast distribution table",
    0x02: "read broadcast distribution table",
    0x03: "broadcast distribution table",
    0x04: "forwarded NPDU",
    0x05: "register foreign device",
    0x06: "read foreign device table",
    0x07: "foreign device table",
    0x08: "delete foreign device",
    0x09: "distribute broadcast to network",
    0x0A: "original unicast NPDU",
    0x0B: "original broadcast NPDU",
    0x0C: "secure BVLL",
}
"""Annex J.2."""

RESULTS = {
    0x0000: "done",
    0x0010: "write broadcast distribution table refused",
    0x0020: "read broadcast distribution table refused",
    0x0030: "register foreign device refused",
    0x0040: "read foreign device table refused",
    0x0050: "delete foreign device refused",
    0x0060: "distribute broadcast to network refused",
}
"""Annex J.2.1."""

_RESULT, _WRITE_BDT, _BDT, _FORWARDED, _REGISTER, _FDT, _DELETE = 0x00, 0x01, 0x03, 0x04, 0x05, 0x07, 0x08
_END = 6  # octets of an address and its port
_ENTRY = 10

Fields = dict[str, int | float | str]


def function_fields(function: int, content: bytes) -> Fields:
    """Fields of what stands behind the length, under Wireshark's names. Total."""
    if function == _RESULT and len(content) >= 2:
        return {"bvlc.result": int.from_bytes(content[:2], "big")}
    if function == _REGISTER and len(content) >= 2:
        return {"bvlc.reg_ttl": int.from_bytes(content[:2], "big")}
    if function == _FORWARDED and len(content) >= _END:
        return {"bvlc.fwd_ip": str(IPv4Address(content[:4])), "bvlc.fwd_port": int.from_bytes(content[4:6], "big")}
    return {}


def function_types() -> FieldTypes:
    """Their types."""
    return {
        "bvlc.result": FieldType(Kind.NUMBER, "what became of a request", {name: no for no, name in RESULTS.items()}),
        "bvlc.reg_ttl": FieldType(Kind.NUMBER, "seconds that a foreign device is to be known for", most=0xFFFF),
        "bvlc.fwd_ip": FieldType(Kind.TEXT, "address of the device whose broadcast is passed on"),
        "bvlc.fwd_port": FieldType(Kind.NUMBER, "and its port", most=0xFFFF),
    }


def function_text(function: int, content: bytes) -> str:
    """What a datagram without NPDU says, behind the name of its function; empty for those that say no more. Total."""
    if function == _RESULT and len(content) >= 2:
        code = int.from_bytes(content[:2], "big")
        return f": {RESULTS.get(code, f'code {code:04X}h')}"
    if function == _REGISTER and len(content) >= 2:
        return f" for {int.from_bytes(content[:2], 'big')} s"
    if function == _DELETE and len(content) >= _END:
        return f" {_end(content)}"
    if function in (_WRITE_BDT, _BDT, _FDT):
        return f": {'; '.join(_entries(function, content)) or 'empty'}"
    return ""


def _entries(function: int, content: bytes) -> Iterator[str]:
    for at in range(0, len(content) - _ENTRY + 1, _ENTRY):
        entry = content[at : at + _ENTRY]
        if function == _FDT:
            time, left = int.from_bytes(entry[6:8], "big"), int.from_bytes(entry[8:], "big")
            yield f"{_end(entry)} for {time} s, {left} s left"
        else:
            yield f"{_end(entry)} mask {IPv4Address(entry[6:])}"


def _end(octets: bytes) -> str:
    return f"{IPv4Address(octets[:4])}:{int.from_bytes(octets[4:6], 'big')}"
