"""A session: what a capture says about itself, the adapter and its limits, and what happened to the line.

Frozen values without I/O; every source makes them, every format keeps as much of them as it can.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import Enum
from typing import Final

from dissectors import registry
from dissectors.frame import Chunk
from dissectors.line import MS, NS_PER_S, LineSettings, Timing
from dissectors.words import brief, milliseconds
from sniff.engine.read_times import ReadTimes, held_back

DEVICES_NOTE = "devices"
"""Note of a session: which station is which device, as on the command line: "1=teco-e510,*=teco-f510"."""


@dataclass(frozen=True, slots=True)
class Adapter:
    """A serial adapter and what it allows to be known.

    `latency`: ns that adapter and host may hold an octet back; `latency_from`: where that number is from, in words.
    `reports`: line errors it can report ("parity", "framing", "break", "overrun"); None when nobody knows.
    `packets`: whether one report stands for all octets of a packet, so that the error is somewhere among them; None
    when nobody knows. `detail`: what limits these reports, in words.
    """

    name: str = "unknown"
    driver: str = ""
    latency: int = 0
    latency_from: str = "assumed"
    reports: tuple[str, ...] | None = None
    detail: str = ""
    serial_number: str = ""
    packets: bool | None = None

    @property
    def delay_words(self) -> str:
        """How exact its times are, in words, and where that is from."""
        if not self.latency:
            return f"times are taken as exact ({self.latency_from})"
        return f"holds octets back up to {milliseconds(self.latency)} ({self.latency_from})"

    @property
    def is_unknown(self) -> bool:
        """Whether nobody says what it may hold back: `latency` is an assumption."""
        return self.latency_from in UNNAMED

    @property
    def is_inferred(self) -> bool:
        """Whether its reads say it."""
        return self.latency_from.startswith(INFERRED)

    @property
    def has_times(self) -> bool:
        """Whether anything says when octets came."""
        return self.latency_from not in (NO_TIMES, NO_TIMES_OF_PACKETS)

    @property
    def lineless(self) -> bool:
        """Whether octets come through no line of this machine, so that all line settings hear the same."""
        return self.driver in LINELESS or self.name in LINELESS


MOST_LATENCY = 3600 * NS_PER_S
"""ns that a file may say an adapter holds octets back: more means no more, and is reckoned with in 64 bits."""

LINELESS = frozenset(("pty", "TCP gateway"))
"""Drivers and adapters that set no line."""

LINE_NOTE = "line"
ASSUMED = "assumed: the file does not say"
"""Note of a session whose format keeps no line settings: `line` is what such a bus normally runs. Another text says
where `line` is from.
"""

PROTOCOL_NOTE = "protocol"
"""Note of a session whose file does not say its protocol: ASSUMED, or how it was told from the octets."""

SECOND_NOTE = "second protocol"
"""Note of a session whose octets told its protocol: the name of another that makes good frames of what is left."""

INFERRED = "inferred from the reads"
"""Where a latency is from that nobody said."""

COARSE = f"{INFERRED}, whose times are whole seconds"
"""The same of a file whose times count seconds."""

NO_TIMES = "assumed; the log has no times"
NO_TIMES_OF_PACKETS = "assumed; its packets have no times"
"""Where the latency of a capture is from that says of nothing when it came."""

UNNAMED = ("assumed", "unknown", "")
"""What `latency_from` is when nobody knows the adapter."""

UNKNOWABLE = ("line", "protocol")
"""What of a session may be searched for."""

AUTO: Final = "auto"
"""What a user says of it for that."""

OPTIONS = {"line": "-s", "protocol": "-p"}
"""How it is named on the command line."""


@dataclass(frozen=True, slots=True)
class Session:
    """One capture of one bus with one setting.

    `port`: as the user named it. `protocol`: a registry name. `started`: ns since the Unix epoch at the anchor; all
    chunk times are on the monotonic clock from there. `bus`: a short name for topics ("boiler-room").
    `unknown`: which of UNKNOWABLE nobody knows (yet): `line` is then only where the search for it began, `protocol`
    a stand-in. `given`: somebody named them after a search in vain, so that octets count wherever the search heard
    them with `line`. `profiles`: device profiles in force, name → TOML document, as far as the format keeps them.
    `reads`: when the first reads came, of a saved capture; `said`: the adapter as the file says it, where `adapter`
    differs from it by what the reads say (`with_latency_of_reads`). `sample`: the first reads of a saved capture.
    """

    port: str
    line: LineSettings
    protocol: str
    started: int = 0
    bus: str = "bus"
    adapter: Adapter = field(default_factory=Adapter)
    program: str = "sniff485"
    notes: Mapping[str, str] = field(default_factory=dict)
    unknown: tuple[str, ...] = ()
    given: bool = False
    profiles: Mapping[str, str] = field(default_factory=dict)
    reads: ReadTimes | None = field(default=None, compare=False, repr=False)
    said: Adapter | None = field(default=None, compare=False, repr=False)
    sample: tuple[Chunk, ...] = field(default=(), compare=False, repr=False)

    def with_latency_of_reads(self) -> Session:
        """The session with the latency that its reads speak for: times that cannot be exact are not taken as exact.

        An adapter that nobody named is as slow as its reads say. One whose latency is known is contradicted only by
        several reads that hold more octets than can have come: a single one is a computer that was busy.
        """
        said = self.said or self.adapter
        if self.reads is not None and said.is_unknown and self._is_coarse:
            return replace(self, adapter=replace(said, latency=self.reads.unit, latency_from=COARSE), said=said)
        if self.reads is None or not self.has_times or "line" in self.unknown or self.line_is_assumed:
            return self
        told = held_back(self.reads, self.line, said.latency)
        is_named = said.latency or not said.is_unknown
        if is_named and (told.impossible < 3 or 500 * told.impossible < len(self.reads.octets)):
            return replace(self, adapter=said, said=None)
        if told.latency <= said.latency:
            return replace(self, adapter=said, said=None)
        why = (
            INFERRED
            if told.period or told.proved
            else f"{INFERRED}, whose times are multiples of {told.latency / MS:g} ms"
        )
        if is_named:
            why += f", which hold more octets than {brief(said.latency / MS, 3)} ms ({said.latency_from}) allow"
        return replace(self, adapter=replace(said, latency=told.latency, latency_from=why), said=said)

    @property
    def _is_coarse(self) -> bool:
        """Whether the times of the file count seconds."""
        return self.reads is not None and self.reads.unit == NS_PER_S

    @property
    def line_is_assumed(self) -> bool:
        """Whether neither the file nor the user says the line settings."""
        return self.notes.get(LINE_NOTE) == ASSUMED

    @property
    def protocol_is_assumed(self) -> bool:
        """Whether neither the file, its octets nor the user say the protocol."""
        return self.notes.get(PROTOCOL_NOTE) == ASSUMED

    @property
    def timing(self) -> Timing:
        """The line with what the adapter allows."""
        is_told = not self.adapter.is_unknown and not self.adapter.is_inferred
        return Timing(self.line, self.adapter.latency, is_told, not self.line_is_assumed, self.has_times)

    @property
    def has_times(self) -> bool:
        """Whether the capture says when anything came; where not, its octets are laid one behind the other."""
        return self.adapter.has_times

    def found(self, line: LineSettings | None, protocol: str | None) -> Session:
        """The session once its search has ended with these settings."""
        return replace(self, line=line or self.line, protocol=protocol or self.protocol, unknown=())

    @property
    def line_words(self) -> str:
        """The line settings, "unknown" when nobody knows them, "no serial line" of packets of a network."""
        known = "no serial line" if self.protocol in registry.RELATIVES else str(self.line)
        return "unknown" if "line" in self.unknown else known

    @property
    def protocol_words(self) -> str:
        """The protocol's name, "unknown" when nobody knows it."""
        return "unknown" if "protocol" in self.unknown else self.protocol

    def to_metadata(self) -> dict[str, str]:
        """Flat text record of everything but the profiles' documents, for files."""
        reports = self.adapter.reports
        return {
            "port": self.port,
            "line": str(self.line),
            "protocol": self.protocol,
            "started_ns": str(self.started),
            "bus": self.bus,
            "program": self.program,
            "adapter": self.adapter.name,
            "adapter_driver": self.adapter.driver,
            "adapter_latency_ns": str(self.adapter.latency),
            "adapter_latency_from": self.adapter.latency_from,
            "adapter_reports": "unknown" if reports is None else ",".join(reports),
            "adapter_detail": self.adapter.detail,
            "adapter_serial_number": self.adapter.serial_number,
            **({} if self.adapter.packets is None else {"adapter_packets": "yes" if self.adapter.packets else "no"}),
            **({"unknown": ",".join(self.unknown)} if self.unknown else {}),
            **({"given": "after the search"} if self.given else {}),
            **{f"note_{key}": value for key, value in self.notes.items()},
        }

    @classmethod
    def from_metadata(cls, record: Mapping[str, str]) -> Session:
        """Read what `to_metadata` wrote; total: what is missing or unreadable gets the default."""
        record = {encodable(key): encodable(value) for key, value in record.items()}
        reports = record.get("adapter_reports", "unknown")
        try:
            line = LineSettings.parse(record.get("line", ""))
        except ValueError:
            line = LineSettings()
        return cls(
            port=record.get("port", ""),
            line=line,
            protocol=record.get("protocol", registry.DEFAULT),
            started=_integer(record.get("started_ns"), -LATEST, LATEST),
            bus=record.get("bus", "bus"),
            adapter=Adapter(
                name=record.get("adapter", "unknown"),
                driver=record.get("adapter_driver", ""),
                latency=_integer(record.get("adapter_latency_ns"), 0, MOST_LATENCY),
                latency_from=record.get("adapter_latency_from", "assumed"),
                reports=None if reports == "unknown" else tuple(name for name in reports.split(",") if name),
                detail=record.get("adapter_detail", ""),
                serial_number=record.get("adapter_serial_number", ""),
                packets={"yes": True, "no": False}.get(record.get("adapter_packets", "")),
            ),
            program=record.get("program", ""),
            notes={key[5:]: value for key, value in record.items() if key.startswith("note_")},
            unknown=tuple(name for name in UNKNOWABLE if name in record.get("unknown", "").split(",")),
            given=bool(record.get("given")),
        )


LATEST = (1 << 63) - 1
"""ns since the epoch; what files of all kinds can say."""


def _integer(text: str | None, least: int, most: int) -> int:
    try:
        return min(max(int(text or 0), least), most)
    except ValueError:
        return 0


def encodable(text: str) -> str:
    """A text that can be written into any file: half characters, as JSON may hold, become \\ud800."""
    return text.encode("utf-8", "backslashreplace").decode()


class LineEventKind(Enum):
    """What can happen to a line besides octets. Errors on single octets are marks of their chunk, not events."""

    UNPLUGGED = "unplugged"
    REPLUGGED = "replugged"
    DROPPED = "dropped"  # octets that this host lost; `count` says how many, -1 unknown
    CLOCK = "clock"  # wall clock stepped against the monotonic clock; `count` = new offset, ns
    SETTINGS = "settings"  # line settings or protocol changed from here on; `text` as in `SettingsChange`
    COMMENT = "comment"  # what a person wrote into a text capture; says nothing of the line
    ERRORS = "errors"  # errors that the driver counted without saying where; `count` of them, `text` = kind
    NOTE = "note"
    TRIGGER = "trigger"  # what a trigger fired on; `text` says it
    OMITTED = "omitted"  # octets that were heard and not kept, since nothing was triggered; `count` of them
    MARK = "mark"  # what a person wrote about a moment, which lies `count` ns before `time`
    UNMARK = "unmark"  # the mark of that moment is taken away
    REFUSED = "refused"  # line settings that were asked for and not taken; `text` as `refusal` makes it

    @property
    def is_hole(self) -> bool:
        """Whether octets may be missing there, so that silence says nothing."""
        return self in _HOLES


_HOLES = frozenset((LineEventKind.DROPPED, LineEventKind.UNPLUGGED, LineEventKind.REPLUGGED, LineEventKind.OMITTED))


@dataclass(frozen=True, slots=True)
class LineEvent:
    """Something that happened at a time (ns) on the capture's clock."""

    time: int
    kind: LineEventKind
    text: str = ""
    count: int = 0

    @property
    def is_mark(self) -> bool:
        """Whether a person said it of what was heard; it says nothing of the line."""
        return self.kind in (LineEventKind.MARK, LineEventKind.UNMARK)

    @property
    def moment(self) -> int:
        """When that was which it is about, ns: of a mark, some time before it."""
        return self.time - self.count if self.is_mark else self.time

    @property
    def number(self) -> int:
        """How many there were, as `count` where that is one."""
        return 0 if self.is_mark else self.count


Item = Chunk | LineEvent
"""What a capture is made of, in order of time."""


@dataclass(frozen=True, slots=True)
class Completeness:
    """Whether a capture file is whole; `text` says in words where it ends and what is missing."""

    whole: bool
    text: str = "complete"


def with_settings(session: Session, protocol: str | None = None, line: LineSettings | None = None) -> Session:
    """The session with what the user says instead of what the file says.

    A line that is only assumed becomes that of the protocol said. Raises registry.UnknownProtocol where it must know.
    """
    if line is not None:
        notes = {name: text for name, text in session.notes.items() if name != LINE_NOTE}
        session = replace(session, notes=notes)
    elif protocol is not None and session.line_is_assumed:
        session = replace(session, line=LineSettings.parse(registry.get(protocol).default_line))
    if protocol is not None:
        told = (PROTOCOL_NOTE, SECOND_NOTE)
        session = replace(session, notes={name: said for name, said in session.notes.items() if name not in told})
    said = [name for name, value in (("line", line), ("protocol", protocol)) if value is not None]
    unknown = tuple(name for name in session.unknown if name not in said)
    return replace(
        session,
        protocol=protocol or session.protocol,
        line=line or session.line,
        unknown=unknown,
        given=session.given or (bool(session.unknown) and not unknown),
    ).with_latency_of_reads()
