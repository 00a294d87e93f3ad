"""The manifest of a protocol: everything that the application must know of it, typed.

A protocol is one folder whose `__init__` makes one `Dissector`; whoever needs to know something of a protocol asks its
manifest and nobody else. Only what every bus needs has no default; a plain protocol names eight things and is done.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING, Any

from dissectors.findings import Judge, Rule
from dissectors.frame import Frame, Header, Role
from dissectors.framer import Framer
from dissectors.line import Timing
from dissectors.pseudonyms import Renamer
from dissectors.readings import Readings, Refusal
from dissectors.token_ring import TokenRing
from dissectors.tracker import Tracker

if TYPE_CHECKING:
    # columns need numpy, which takes longer to import than a small capture to read; simulated buses are seldom wanted
    from dissectors.columns import Kernel, Pairing
    from dissectors.reading_columns import BulkReadings
    from dissectors.simulated import SimulatedBus

RARE_BITS = 8.0
"""Evidence of a good frame where its protocol does not say: one in 256 of random octets."""


@dataclass(frozen=True, slots=True)
class PacketFile:
    """How a protocol's frames lie in pcap and pcapng.

    `link_types`: those that may hold them (https://www.tcpdump.org/linktypes.html), the one written first.
    `pdu_name`: the Wireshark dissector for link type 252 (exported PDU); empty where there is none.
    `least`: octets that it needs; `longer`: whether it takes damaged frames that are longer than they should be.
    """

    link_types: tuple[int, ...]
    pdu_name: str = ""
    least: int = 4
    longer: bool = False


@dataclass(frozen=True, slots=True)
class Dissector:
    """One protocol.

    `name`: as on the command line ("modbus-rtu"); `title`: for people.
    `framer`, `tracker`: make a new one for a bus with the given timing.
    `peek(frame)`: the quick look, total, a few µs.
    `text(frame, header, role)`: one line for the frame list, without control characters, role as the tracker gave it.
    `fields(frame, role)`: Wireshark field names (ours where it has none) to int, float or str, in frame order.
    `packet(frame, role)`: the scapy packet, imported on first use; never raises, keeps what does not parse as Raw.

    The rest only where there is such a thing:

    `default_line`: what such a bus normally runs ("19200,8E1").
    `other_lines`: what else such a bus runs, where those are not the usual rates and formats; a search tries them, too.
    `field_prefixes`: how the names in `fields` begin ("modbus."), so that filters know them; the protocol's name and a
    dot where none are given.
    `noun`: what its people call a place on the bus. `family`: under which name device profiles speak of it.
    `bits(frame)`: how much a good frame speaks for this protocol: log2 of how seldom random octets hold one like it.
    `judge`: makes the rules at work on a bus; `rules`: their catalogue, by code.
    `ring`: how its token ring is watched and shown, if it passes a token.
    `readings`: what exchanges say of the things inside a station; `refusal`: the code with which one refuses.
    `reading_columns`: `readings` of many exchanges at once, as far as they are plain registers or say nothing.
    `packet_file`: how its frames lie in packet files.
    `renamer`: makes what gives stations other numbers and blanks texts, checks made right again.
    `kernel`: framer and peek for clean stretches of many frames at once (`dissectors/columns.py`).
    `pairing`: the same for the tracker.
    `makers`: whole frames from their parts, checks included, by the kind of frame; parts are keywords.
    `scenarios()`: simulated buses by name, for demonstrations and tests; the protocol's own name for the usual one.
    """

    name: str
    title: str
    framer: Callable[[Timing], Framer]
    peek: Callable[[Frame], Header]
    tracker: Callable[[Timing], Tracker]
    text: Callable[[Frame, Header, Role], str]
    fields: Callable[[Frame, Role], dict[str, int | float | str]]
    packet: Callable[[Frame, Role], Any]
    default_line: str = "9600,8N1"
    other_lines: tuple[str, ...] = ()
    field_prefixes: tuple[str, ...] = ()
    noun: str = "station"
    family: str = ""
    bits: Callable[[Frame], float] = lambda frame: RARE_BITS
    judge: Callable[[Timing], Judge] | None = None
    rules: Mapping[str, Rule] = field(default_factory=dict)
    ring: TokenRing | None = None
    readings: Readings | None = None
    reading_columns: BulkReadings | None = None
    refusal: Refusal | None = None
    packet_file: PacketFile | None = None
    renamer: Callable[[], Renamer] | None = None
    makers: Mapping[str, Callable[..., bytes]] = field(default_factory=dict)
    scenarios: Callable[[], Mapping[str, SimulatedBus]] = dict
    kernel: Kernel | None = None
    pairing: Pairing | None = None

    @property
    def prefixes(self) -> tuple[str, ...]:
        """How the names of its fields begin."""
        return self.field_prefixes or (f"{self.name}.",)

    @property
    def profile_family(self) -> str:
        """The name under which device profiles speak of it."""
        return self.family or self.name


def on_first_use(target: str) -> Callable[..., Any]:
    """The function "module:name", whose module is imported when it is first called; for `packet`, which needs scapy."""

    def call(*arguments: Any) -> Any:
        return _load(target)(*arguments)

    return call


@cache
def _load(target: str) -> Any:
    module, _, name = target.partition(":")
    return getattr(import_module(module), name)
