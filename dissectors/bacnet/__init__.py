"""BACnet MS/TP: token passing on RS-485, with the network and application layers. README.md draws the frames."""

from __future__ import annotations

from dissectors.bacnet import ring_table
from dissectors.bacnet.envelope import frame
from dissectors.bacnet.fields import fields
from dissectors.bacnet.frame_types import PREAMBLE
from dissectors.bacnet.framing import MstpFramer
from dissectors.bacnet.header import peek
from dissectors.bacnet.readings import asks, readings
from dissectors.bacnet.rules import RULES
from dissectors.bacnet.text import meant, text
from dissectors.bacnet.tracker import MstpTracker
from dissectors.frame import Frame
from dissectors.manifest import Dissector, PacketFile, on_first_use
from dissectors.questions import Questions
from dissectors.token_ring import TokenRing

__all__ = [
    "MSTP",
    "MstpFramer",
    "MstpTracker",
    "fields",
    "packet",
    "peek",
    "text",
]


packet = on_first_use("dissectors.bacnet.packets:packet")
judge = on_first_use("dissectors.bacnet.findings:MstpFindings")
watch = on_first_use("dissectors.bacnet.bulk_ring_observer:BulkRingObserver")
renamer = on_first_use("dissectors.bacnet.renamer:MstpRenamer")
stencil = on_first_use("dissectors.bacnet.stencils:mstp_stencil")
kernel = on_first_use("dissectors.bacnet.kernel:kernel")
field_types = on_first_use("dissectors.bacnet.field_types:types")
reading_columns = on_first_use("dissectors.bacnet.reading_columns:reading_columns")
questions = Questions(
    on_first_use("dissectors.bacnet.questions:question"), on_first_use("dissectors.bacnet.questions:stems")
)
pairing = on_first_use("dissectors.bacnet.block_pairing:pairing")


def bits(frame: Frame) -> float:
    """Evidence of a good frame: preamble and header check, 24 bits."""
    return 24.0


def sieve(octets: bytes) -> bool:
    """Whether there is a preamble."""
    return PREAMBLE in octets


RING = TokenRing(
    observer=watch,
    order=lambda ring: ring.order,
    headings=ring_table.HEADINGS,
    rows=ring_table.rows,
    sentences=ring_table.sentences,
    identities=lambda ring: {mac: node.devices for mac, node in ring.nodes.items() if node.devices},
    shares=lambda ring: {mac: node.held / ring.span for mac, node in ring.nodes.items() if node.held and ring.span},
)

MSTP = Dissector(
    name="mstp",
    title="BACnet MS/TP",
    framer=MstpFramer,
    peek=peek,
    tracker=MstpTracker,
    text=text,
    meant=meant,
    asks=asks,
    fields=fields,
    packet=packet,
    default_line="38400,8N1",
    field_prefixes=("mstp.", "bacnet.", "bacapp."),
    noun="MAC",
    family="bacnet",
    bits=bits,
    sieve=sieve,
    judge=judge,
    rules=RULES,
    ring=RING,
    readings=readings,
    reading_columns=reading_columns,
    questions=questions,
    packet_file=PacketFile(
        (165, 252),
        "mstp",
        least=8,
        longer=True,
        snap=b"\x00\x10\x90\x00\x01",  # Cimetrics U+4: two octets of time and one more before the frame
        snap_header=3,
        snap_before=b"\x55\xff",
        ports=((47808, "BACnet/IP"),),
    ),
    renamer=renamer,
    makers={"mstp": frame},
    kernel=kernel,
    pairing=pairing,
    stencil=stencil,
    field_types=field_types,
    scenarios=on_first_use("dissectors.bacnet.scenario:scenarios"),
)
