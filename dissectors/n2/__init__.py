"""Metasys N2 (N2 Open): the field bus of Johnson Controls, `>` … CR and `A`/`N` … CR. README.md draws the frames."""

from __future__ import annotations

from dissectors.n2.fields import fields
from dissectors.n2.findings import N2Findings
from dissectors.n2.framing import N2Framer
from dissectors.n2.header import peek
from dissectors.n2.interpretation import Interpretation, interpret
from dissectors.n2.readings import readings, refusal
from dissectors.n2.rules import RULES
from dissectors.n2.text import text
from dissectors.n2.tracker import N2Tracker
from dissectors.registry import Dissector, on_first_use

__all__ = [
    "N2",
    "Interpretation",
    "N2Findings",
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

N2 = Dissector(
    name="n2",
    title="Metasys N2",
    framer=N2Framer,
    peek=peek,
    tracker=N2Tracker,
    text=text,
    fields=fields,
    packet=packet,
    default_line="9600,8N1",
    extras={"findings": N2Findings, "rules": RULES, "interpret": interpret, "readings": readings, "refusal": refusal},
)
