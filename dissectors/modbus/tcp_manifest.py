"""The manifest of Modbus TCP, apart: a line has no use for it."""

from __future__ import annotations

from dissectors.manifest import Dissector
from dissectors.modbus import register_maps, tcp
from dissectors.modbus.places import place
from dissectors.modbus.tcp_framing import TCP_NAME, TcpFramer
from dissectors.modbus.tcp_tracker import TcpTracker
from dissectors.questions import Questions

TCP = Dissector(
    name=TCP_NAME,
    title="Modbus TCP",
    framer=TcpFramer,
    peek=tcp.peek_tcp,
    tracker=TcpTracker,
    text=tcp.tcp_text,
    meant=tcp.tcp_meant,
    asks=tcp.tcp_asks,
    answer_fields=tcp.tcp_answer_fields,
    place=place,
    spans=tcp.tcp_spans,
    fields=tcp.tcp_fields,
    packet=tcp.tcp_packet,
    default_line="10000000,8N1",  # none: octets of a packet come at once
    field_prefixes=("mbtcp.", "modbus."),
    bits=tcp.tcp_bits,
    renamer=tcp.TcpRenamer,
    makers={TCP_NAME: tcp.make_tcp},
    family="modbus",
    readings=tcp.tcp_readings,
    refusal=tcp.tcp_refusal,
    questions=Questions(tcp.tcp_question),
    register_maps=register_maps,
    field_types=tcp.tcp_types,
)
