"""PROFIBUS DP: FDL telegrams, the DP services on them, the token ring of its masters. README.md draws the telegrams."""

from __future__ import annotations

from dissectors.frame import Frame
from dissectors.manifest import Dissector, PacketFile, on_first_use
from dissectors.profibus import ring_words
from dissectors.profibus.fields import fields
from dissectors.profibus.framing import STARTS, ProfibusFramer
from dissectors.profibus.header import peek
from dissectors.profibus.readings import readings
from dissectors.profibus.rules import RULES
from dissectors.profibus.telegram import telegram, token
from dissectors.profibus.text import line_meant, text
from dissectors.profibus.tracker import ProfibusTracker
from dissectors.token_ring import StationTable, TokenRing

__all__ = ["PROFIBUS", "ProfibusFramer", "ProfibusTracker", "fields", "peek", "text"]

packet = on_first_use("dissectors.profibus.packets:packet")
kernel = on_first_use("dissectors.profibus.kernel:kernel")
judge = on_first_use("dissectors.profibus.judging_columns:BulkProfibusFindings")
watch = on_first_use("dissectors.profibus.bulk_watch:BulkBusWatch")
pairing = on_first_use("dissectors.profibus.block_pairing:pairing")
neighbour = on_first_use("dissectors.profibus.neighbours:neighbour")

_EVIDENCE = {1: 2.0, 3: 8.0, 6: 22.0}
"""Bits of evidence by length: short acknowledgement and token have no check, and are believed only in their place."""


def bits(frame: Frame) -> float:
    """Evidence of a good telegram: start, sum, end and frame control; the second start and length where there are."""
    return _EVIDENCE.get(len(frame.octets), 24.0)


def sieve(octets: bytes) -> bool:
    """Whether there is the begin of a telegram."""
    return STARTS.search(octets) is not None


RING = TokenRing(
    observer=watch,
    order=lambda ring: ring.order,
    headings=ring_words.HEADINGS,
    rows=ring_words.rows,
    sentences=ring_words.sentences,
    stations=StationTable(ring_words.SLAVE_HEADINGS, ring_words.slave_rows),
)

PROFIBUS = Dissector(
    name="profibus",
    title="PROFIBUS DP",
    framer=ProfibusFramer,
    peek=peek,
    tracker=ProfibusTracker,
    text=text,
    meant=line_meant,
    fields=fields,
    packet=packet,
    default_line="1500000,8E1",
    other_lines=("187500,8E1", "500000,8E1", "93750,8E1", "45450,8E1"),
    field_prefixes=("pb.",),
    field_types=on_first_use("dissectors.profibus.field_types:types"),
    bits=bits,
    neighbour=neighbour,
    sieve=sieve,
    judge=judge,
    rules=RULES,
    ring=RING,
    readings=readings,
    packet_file=PacketFile((147, 257), least=1),
    renamer=on_first_use("dissectors.profibus.renamer:ProfibusRenamer"),
    scenarios=on_first_use("dissectors.profibus.scenario:scenarios"),
    kernel=kernel,
    pairing=pairing,
    makers={"profibus": telegram, "profibus-token": token},
)
