"""Metasys N2 (N2 Open): the field bus of Johnson Controls, `>` … CR and `A`/`N` … CR. README.md draws the frames."""

from __future__ import annotations

from dissectors.frame import Frame
from dissectors.manifest import Dissector, on_first_use
from dissectors.n2.envelope import make_answer, make_command
from dissectors.n2.fields import answer_fields, fields
from dissectors.n2.framing import N2Framer
from dissectors.n2.header import peek
from dissectors.n2.interpretation import Interpretation, interpret
from dissectors.n2.readings import asks, readings, refusal, spans
from dissectors.n2.rules import RULES
from dissectors.n2.text import meant, text
from dissectors.n2.tracker import N2Tracker
from dissectors.questions import Questions

__all__ = [
    "N2",
    "Interpretation",
    "N2Framer",
    "N2Tracker",
    "fields",
    "interpret",
    "packet",
    "peek",
    "readings",
    "text",
]


packet = on_first_use("dissectors.n2.packets:packet")
judge = on_first_use("dissectors.n2.judging_columns:BulkN2Findings")
kernel = on_first_use("dissectors.n2.kernel:kernel")
questions = Questions(on_first_use("dissectors.n2.questions:question"))
pairing = on_first_use("dissectors.n2.block_pairing:pairing")
field_types = on_first_use("dissectors.n2.field_types:types")


def bits(frame: Frame) -> float:
    """Evidence of a good frame: each character comes from a small alphabet, 3 bits."""
    return 3.0 * len(frame.octets)


def sieve(octets: bytes) -> bool:
    """Whether there is the begin and the end of a frame."""
    return b"\r" in octets and (b">" in octets or b"A" in octets or b"N" in octets)


N2 = Dissector(
    name="n2",
    title="Metasys N2",
    framer=N2Framer,
    kernel=kernel,
    pairing=pairing,
    peek=peek,
    tracker=N2Tracker,
    text=text,
    meant=meant,
    asks=asks,
    answer_fields=answer_fields,
    fields=fields,
    packet=packet,
    default_line="9600,8N1",
    bits=bits,
    sieve=sieve,
    judge=judge,
    rules=RULES,
    readings=readings,
    spans=spans,
    refusal=refusal,
    questions=questions,
    renamer=on_first_use("dissectors.n2.renamer:N2Renamer"),
    makers={"n2": make_command, "n2-answer": make_answer},
    scenarios=on_first_use("dissectors.n2.scenario:scenarios"),
    field_types=field_types,
)
