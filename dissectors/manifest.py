"""The manifest of a protocol: everything that the application must know of it, typed.

A protocol is one folder whose `__init__` makes one `Dissector`; whoever needs to know something of a protocol asks its
manifest and nobody else. Only what every bus needs has no default; a plain protocol names eight things and is done.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import KW_ONLY, dataclass, field
from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING, Any

from dissectors.readings import plain_place

if TYPE_CHECKING:
    # a protocol imports what it has of all this; columns need numpy, which takes longer than to read a small capture
    from dissectors.columns import Kernel, Pairing
    from dissectors.field_types import FieldTypes
    from dissectors.findings import Judge, Rule
    from dissectors.frame import Frame, Header, Role
    from dissectors.framer import Framer
    from dissectors.line import Timing
    from dissectors.meaning import Meaning, Spans
    from dissectors.pseudonyms import Renamer
    from dissectors.questions import Questions
    from dissectors.reading_columns import BulkReadings
    from dissectors.readings import Asks, PlaceName, Readings, Refusal
    from dissectors.register_maps import MapReader
    from dissectors.simulated import SimulatedBus
    from dissectors.stencil import Stencils
    from dissectors.token_ring import TokenRing
    from dissectors.tracker import Tracker

RARE_BITS = 8.0
"""Evidence of a good frame where its protocol does not say: one in 256 of random octets."""


@dataclass(frozen=True, slots=True)
class PacketFile:
    """How a protocol's frames lie in pcap and pcapng.

    `link_types`: those that may hold them (https://www.tcpdump.org/linktypes.html), the one written first.
    `pdu_name`: the Wireshark dissector for link type 252 (exported PDU); empty where there is none.
    `least`: octets that it needs; `longer`: whether it takes damaged frames that are longer than they should be.
    `datagrams`: how UDP datagrams begin that hold one frame each; all of a network are one bus, each behind its ends
    (address and port of IPv4, of who sends and of who is spoken to).
    `snap`: organisation and protocol (5 octets) of Ethernet SNAP frames that hold one each, behind `snap_header`
    octets; `snap_before`: what is left out there of its begin. `ports`: of TCP and UDP that its relatives on networks
    use, with what those are called.
    """

    link_types: tuple[int, ...]
    pdu_name: str = ""
    least: int = 4
    longer: bool = False
    snap: bytes = b""
    snap_header: int = 0
    snap_before: bytes = b""
    ports: tuple[tuple[int, str], ...] = ()
    datagrams: bytes = b""


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

    `meant(frame, header, role, meaning)`: the same line with what the frame means to its device before the raw numbers;
    ask `line`, which does without where there is none. `place`: the place of a reading in words. `spans`: the octets of
    readings in their frame. `asks`: the places that a request reads.
    `answer_fields(request, answer)`: fields of an answer that only its request tells.

    `default_line`: what such a bus normally runs ("19200,8E1"); the fastest where packets of a network hold frames.
    `other_lines`: what else such a bus runs, where those are not the usual rates and formats; a search tries them, too.
    `field_prefixes`: how the names in `fields` begin ("modbus."), so that filters know them; the protocol's name and a
    dot where none are given.
    `noun`: what its people call a place on the bus. `family`: under which name device profiles speak of it.
    `bits(frame)`: how much a good frame speaks for this protocol: log2 of how seldom random octets hold one like it.
    `neighbour(octets)`: another protocol with frames of the same form, where octets together tell that they are of it;
    "" where they may be of this one.
    `sieve(octets)`: False where octets that stand alone hold no good frame, whatever their times; told in a few µs.
    `judge`: makes the rules at work on a bus; `rules`: their catalogue, by code.
    `ring`: how its token ring is watched and shown, if it passes a token.
    `readings`: what exchanges say of the things inside a station; `refusal`: the code with which one refuses.
    `reading_columns`: `readings` of many exchanges at once, as far as they are numbers or say nothing.
    `questions`: what its requests ask, without the values that they carry.
    `register_maps`: reads maps of registers that others wrote.
    `packet_file`: how its frames lie in packet files.
    `renamer`: makes what gives stations other numbers and blanks texts, checks made right again.
    `kernel`: framer and peek for clean stretches of many frames at once (`dissectors/columns.py`).
    `pairing`: the same for the tracker.
    `stencil`: what `text` reads of frames, for many lines at once (`dissectors/stencil.py`).
    `field_types()`: the types of all that `fields` may give, by name; "kind" and "func" too. Where it is not given any
    name with one of the prefixes may be a field, of any type.
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
    _: KW_ONLY  # many, mostly of one type: by place one would pass for another
    meant: Callable[[Frame, Header, Role, Meaning], str] | None = None
    place: PlaceName = plain_place
    spans: Spans | None = None
    asks: Asks | None = None
    answer_fields: Callable[[Frame, Frame], dict[str, int | float | str]] | None = None
    default_line: str = "9600,8N1"
    other_lines: tuple[str, ...] = ()
    field_prefixes: tuple[str, ...] = ()
    noun: str = "station"
    family: str = ""
    bits: Callable[[Frame], float] = lambda frame: RARE_BITS
    neighbour: Callable[[bytes], str] = lambda octets: ""
    sieve: Callable[[bytes], bool] = lambda octets: True
    judge: Callable[[Timing], Judge] | None = None
    rules: Mapping[str, Rule] = field(default_factory=dict)
    ring: TokenRing | None = None
    readings: Readings | None = None
    reading_columns: BulkReadings | None = None
    refusal: Refusal | None = None
    questions: Questions | None = None
    register_maps: MapReader | None = None
    packet_file: PacketFile | None = None
    renamer: Callable[[], Renamer] | None = None
    makers: Mapping[str, Callable[..., bytes]] = field(default_factory=dict)
    scenarios: Callable[[], Mapping[str, SimulatedBus]] = dict
    kernel: Kernel | None = None
    pairing: Pairing | None = None
    stencil: Stencils | None = None
    field_types: Callable[[], FieldTypes] | None = None

    def line(self, frame: Frame, header: Header, role: Role, meaning: Meaning | None = None) -> str:
        """One line for the frame list: what the frame means to its device, then what it is; the latter alone where
        nothing is known."""
        if meaning is None or (meaning.request is None and not meaning.words):
            return self.text(frame, header, role)
        if self.meant is not None:
            return self.meant(frame, header, role, meaning)
        said, text = meaning.about, self.text(frame, header, role)
        way = "" if header.source is None else f"{header.source} → {header.destination} "
        rest = text.removeprefix(way)
        return f"{way if rest != text else ''}{said} — {rest}" if said else text

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
