"""The manifest of BACnet/IP, apart: a line has no use for it."""

from __future__ import annotations

from dissectors.bacnet import ip
from dissectors.bacnet.ip_framing import IP_NAME, IpFramer
from dissectors.manifest import Dissector, PacketFile

BACNET_IP = Dissector(
    name=IP_NAME,
    title="BACnet/IP",
    framer=IpFramer,
    peek=ip.peek_ip,
    tracker=ip.IpTracker,
    text=ip.ip_text,
    meant=ip.ip_meant,
    asks=ip.ip_asks,
    fields=ip.ip_fields,
    packet=ip.ip_packet,
    default_line="10000000,8N1",  # none: octets of a packet come at once
    field_prefixes=("bvlc.", "ip.", "bacnet.", "bacapp."),
    noun="host",
    family="bacnet",
    bits=ip.ip_bits,
    readings=ip.ip_readings,
    packet_file=PacketFile((147,), datagrams=b"\x81", ports=((47808, "BACnet/IP"),)),
    makers={IP_NAME: ip.make_ip},
    field_types=ip.ip_types,
)
