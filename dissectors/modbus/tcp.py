"""Modbus TCP: the PDUs of a serial line behind a header with a transaction number. Each frame has a twin on a line, RTU
with a check that is right; what is in it is what is in its twin.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Any

from dissectors.field_types import FieldType, FieldTypes, Kind
from dissectors.frame import Check, Damage, Frame, Header, Role
from dissectors.meaning import Meaning, Span
from dissectors.modbus.envelope import RTU_NAME, seal_rtu
from dissectors.modbus.fields import answer_fields, fields
from dissectors.modbus.header import peek_rtu
from dissectors.modbus.places import spans
from dissectors.modbus.readings import asks, refusal
from dissectors.modbus.readings import readings as serial_readings
from dissectors.modbus.tcp_framing import HEADER, TCP_NAME
from dissectors.modbus.text import meant, text
from dissectors.questions import Question
from dissectors.readings import Reading

Fields = dict[str, int | float | str]


@lru_cache(maxsize=4096)
def twin(frame: Frame) -> Frame:
    """The RTU frame with the same unit and PDU. Total."""
    body = frame.octets[HEADER:]
    if frame.damage is None:
        return replace(frame, protocol=RTU_NAME, octets=seal_rtu(body), check=Check.GOOD, expected=None)
    missing = None if frame.expected is None else max(0, frame.expected - HEADER) + 2
    return replace(frame, protocol=RTU_NAME, octets=body, damage=Damage.SHORT, expected=missing)


def transaction(frame: Frame) -> int:
    """Its number; what there is of it in a frame that ends before."""
    return int.from_bytes(frame.octets[:2], "big")


def peek_tcp(frame: Frame) -> Header:
    """The header of a frame. Total."""
    return replace(peek_rtu(twin(frame)), protocol=TCP_NAME)


def tcp_text(frame: Frame, header: Header, role: Role) -> str:
    """One line about a frame, its transaction number at the end. Total."""
    return f"{text(twin(frame), header, role)}  #{transaction(frame)}"


def tcp_meant(frame: Frame, header: Header, role: Role, meaning: Meaning) -> str:
    """The same, what it means to its device first. Total."""
    return f"{meant(twin(frame), header, role, meaning)}  #{transaction(frame)}"


def tcp_fields(frame: Frame, role: Role) -> Fields:
    """Its fields in frame order, under Wireshark's names. Total."""
    octets = frame.octets
    found: Fields = {}
    for name, begin, end in (("trans_id", 0, 2), ("prot_id", 2, 4), ("len", 4, 6), ("unit_id", 6, 7)):
        if len(octets) >= end:
            found[f"mbtcp.{name}"] = int.from_bytes(octets[begin:end], "big")
    told = fields(twin(frame), role)
    return found | {name: value for name, value in told.items() if not name.startswith("mbrtu.")}


def tcp_answer_fields(request: Frame, answer: Frame) -> Fields:
    """The numbers of what an answer holds, which only its request tells."""
    return answer_fields(twin(request), twin(answer))


def tcp_readings(request: Frame | None, response: Frame | None) -> tuple[Reading, ...]:
    """See `dissectors.readings.Readings`."""
    return serial_readings(None if request is None else twin(request), None if response is None else twin(response))


def tcp_asks(frame: Frame) -> tuple[Reading, ...]:
    """See `dissectors.readings.Asks`."""
    return asks(twin(frame))


def tcp_refusal(frame: Frame) -> tuple[str, int] | None:
    """See `dissectors.readings.Refusal`."""
    return refusal(twin(frame))


def tcp_question(frame: Frame) -> Question:
    """See `dissectors.questions.Questions`."""
    from dissectors.modbus.questions import question  # needs numpy

    return question(twin(frame))


def tcp_spans(frame: Frame, readings: Sequence[Reading]) -> list[Span | None]:
    """The octets of each reading."""
    found = spans(twin(frame), readings)
    return [None if span is None else (span[0] + HEADER, span[1] + HEADER) for span in found]


def tcp_bits(frame: Frame) -> float:
    """Evidence of a whole frame: two octets of protocol, the upper one of a length, and that it ends where it says.
    Behind octets that are none it is no evidence: other protocols have zeros as well, and here nothing is checked."""
    return 24.0 if frame.ok and not frame.skipped else 0.0


def tcp_types() -> FieldTypes:
    """The types of its fields, by name."""
    from dissectors.modbus.field_types import rtu_types

    common = {name: kind for name, kind in rtu_types().items() if name.startswith("modbus.")}
    common["modbus.func_code"] = replace(common["modbus.func_code"], octet=HEADER + 1)
    return {
        "mbtcp.trans_id": FieldType(Kind.NUMBER, "number of the exchange"),
        "mbtcp.prot_id": FieldType(Kind.NUMBER, "0 for Modbus"),
        "mbtcp.len": FieldType(Kind.NUMBER, "octets that follow"),
        "mbtcp.unit_id": FieldType(Kind.STATION, "station spoken to, or that answers", octet=HEADER),
        **common,
    }


def make_tcp(transaction: int, unit: int, pdu: bytes) -> bytes:
    """The frame of a transaction, a unit and a PDU."""
    return transaction.to_bytes(2, "big") + b"\0\0" + (1 + len(pdu)).to_bytes(2, "big") + bytes([unit]) + pdu


class TcpRenamer:
    """Renames frames as their twins are renamed."""

    def __init__(self) -> None:
        from dissectors.modbus.renamer import RtuRenamer

        self.rtu = RtuRenamer()
        self.stations = self.rtu.stations

    def __call__(self, frame: Frame) -> bytes:
        """The frame under another name."""
        octets = frame.octets
        if not frame.ok or len(octets) < HEADER + 2:
            return octets[:HEADER] + self.rtu.damaged_pdu(octets[HEADER:])
        return octets[:HEADER] + self.rtu.pdu(octets[HEADER:])


def tcp_packet(frame: Frame, role: Role) -> Any:
    """The scapy packet: the header, then the PDU as on a line. Never raises."""
    from dissectors.modbus.tcp_packets import dissect

    return dissect(frame, role, peek_tcp(frame))
