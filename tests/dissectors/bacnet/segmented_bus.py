"""Exchanges in segments on a ring of two masters, step by step: tests lose, repeat and damage any of them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from dissectors.bacnet import apdu as apdus
from dissectors.bacnet import codec, npdu, services
from dissectors.bacnet.apdu import MORE_FOLLOWS, NEGATIVE_ACK, SEGMENTED, SEGMENTED_ACCEPTED, SERVER
from dissectors.bacnet.envelope import frame
from dissectors.bacnet.frame_types import FrameType
from dissectors.bacnet.limits import MAX_DATA
from dissectors.frame import Chunk
from dissectors.line import LineSettings
from sniff.bus.capture_writer import create
from sniff.engine.engine import Engine, Output, Row
from sniff.engine.follow_settings import dissector_for
from sniff.engine.session import Session

LINE = LineSettings(38400)
SESSION = Session("bus", LINE, "mstp", 1_772_359_200 * 10**9)
READ, READ_MULTIPLE, WRITE_MULTIPLE = 12, 14, 16
MS = 1_000_000


@dataclass(frozen=True, slots=True)
class Step:
    """One frame: what it is ("request 0", "ack 3", "segment 2", "token"), ms of silence before it, its octets."""

    name: str
    silence: float
    octets: bytes


@dataclass(frozen=True, slots=True)
class Party:
    """A station: its MAC, and where it is behind a router its network and address there."""

    mac: int
    net: int | None = None
    address: bytes = b""


@dataclass(slots=True)
class SegmentedBus:
    """Makes the steps. `client` asks `server`; both are masters or stand behind one."""

    client: Party = Party(1)
    server: Party = Party(5)
    steps: list[Step] = field(default_factory=list)

    def say(self, name: str, octets: bytes, silence: float = 2.0) -> None:
        self.steps.append(Step(name, silence, octets))

    def turn(self, holder: int | None = None) -> None:
        """Pass the token from one master to the other; to `holder` when only it may send."""
        here = self.client.mac if holder != self.client.mac else self.server.mac
        there = self.server.mac if here == self.client.mac else self.client.mac
        self.say("token", frame(FrameType.TOKEN, there, here))

    def send(self, name: str, sender: Party, body: bytes, kind: int, bit: bool, silence: float = 3.0) -> None:
        receiver = self.server if sender is self.client else self.client
        routed: dict[str, object] = {}
        if receiver.net is not None:
            routed |= {"dnet": receiver.net, "dadr": receiver.address}
        if sender.net is not None:
            routed |= {"snet": sender.net, "sadr": sender.address}
        octets = npdu.encode(body, expects_reply=bit, **routed)  # type: ignore[arg-type]
        if len(octets) > MAX_DATA:
            kind = FrameType(kind).value + 27  # the extended type that means the same
        self.say(name, frame(kind, receiver.mac, sender.mac, octets), silence)

    def acknowledge(self, sender: Party, invoke: int, sequence: int, window: int, negative: bool = False) -> None:
        flags = (SERVER if sender is self.server else 0) | (NEGATIVE_ACK if negative else 0)
        body = apdus.encode(4, invoke_id=invoke, sequence=sequence & 0xFF, window=window, flags=flags)
        self.send(f"{'nak' if negative else 'ack'} {sequence}", sender, body, FrameType.DATA_NOT_EXPECTING_REPLY, False)

    def ask(self, invoke: int, service: int, body: bytes) -> None:
        """A request in one piece."""
        octets = apdus.encode(0, body, invoke_id=invoke, service=service, flags=SEGMENTED_ACCEPTED, max_segments=7)
        self.send("request", self.client, octets, FrameType.DATA_EXPECTING_REPLY, True)

    def answer_in_segments(self, invoke: int, service: int, body: bytes, size: int, window: int) -> None:
        """The answer to `ask`: the first segment at once, then windows when each has the token."""
        pieces = [body[at : at + size] for at in range(0, len(body), size)]
        last = len(pieces) - 1
        at, width = 0, 1
        while at <= last:
            for number in range(at, min(at + width, last + 1)):
                flags = SEGMENTED | (MORE_FOLLOWS if number < last else 0)
                octets = apdus.encode(
                    3, pieces[number], invoke_id=invoke, service=service, flags=flags, sequence=number & 0xFF,
                    window=window,
                )  # fmt: skip
                self.send(f"segment {number}", self.server, octets, FrameType.DATA_NOT_EXPECTING_REPLY, True)
            at, width = min(at + width, last + 1), window
            if self.steps[-1].name != "segment 0":
                self.turn(self.client.mac)
            self.acknowledge(self.client, invoke, at - 1, window)
            self.turn(self.server.mac)
        self.turn(self.client.mac)

    def ask_in_segments(self, invoke: int, service: int, body: bytes, size: int, window: int) -> None:
        """A request in segments; the server acknowledges each window at once."""
        pieces = [body[at : at + size] for at in range(0, len(body), size)]
        last = len(pieces) - 1
        at, width = 0, 1
        while at <= last:
            end = min(at + width, last + 1)
            for number in range(at, end):
                flags = SEGMENTED | SEGMENTED_ACCEPTED | (MORE_FOLLOWS if number < last else 0)
                octets = apdus.encode(
                    0, pieces[number], invoke_id=invoke, service=service, flags=flags, sequence=number & 0xFF,
                    window=window, max_segments=7,
                )  # fmt: skip
                kind = FrameType.DATA_EXPECTING_REPLY if number == end - 1 else FrameType.DATA_NOT_EXPECTING_REPLY
                self.send(f"request {number}", self.client, octets, kind, True)
            at, width = end, window
            self.acknowledge(self.server, invoke, at - 1, window)

    def reply(self, invoke: int, service: int, body: bytes | None = None, at_once: bool = False) -> None:
        """The server's answer in one piece: at once, or when it has the token."""
        if not at_once:
            self.turn(self.server.mac)
        kind = 2 if body is None else 3
        octets = apdus.encode(kind, body or b"", invoke_id=invoke, service=service)
        self.send("answer", self.server, octets, FrameType.DATA_NOT_EXPECTING_REPLY, False)
        if not at_once:
            self.turn(self.client.mac)

    def rounds(self, count: int = 3) -> None:
        """Nothing but tokens, as at the begin and end of a capture."""
        for _ in range(count):
            self.turn(self.server.mac)
            self.turn(self.client.mac)


def without(steps: Iterable[Step], *names: str) -> list[Step]:
    """The steps but those."""
    return [step for step in steps if step.name not in names]


def doubled(steps: Iterable[Step], name: str, silence: float) -> list[Step]:
    """Every frame of that name sent again."""
    made: list[Step] = []
    for step in steps:
        made += [step, replace(step, silence=silence)] if step.name == name else [step]
    return made


def spoilt(steps: Iterable[Step], name: str) -> list[Step]:
    """A bit of that frame's data turned over."""
    return [
        replace(step, octets=step.octets[:-4] + bytes((step.octets[-4] ^ 1,)) + step.octets[-3:])
        if step.name == name
        else step
        for step in steps
    ]


def chunks(steps: Iterable[Step], start: int = SESSION.started) -> list[Chunk]:
    """One read a frame."""
    now, made = start, []
    for step in steps:
        now += int(step.silence * MS) + len(step.octets) * LINE.char
        made.append(Chunk(now, step.octets))
    return made


def run(steps: Iterable[Step]) -> Output:
    """All rows and transactions of a capture of these steps."""
    engine = Engine(dissector_for(SESSION), SESSION.timing)
    rows: list[Row] = []
    closed = []
    feeds: list[Callable[[], Output]] = [lambda chunk=chunk: engine.feed(chunk) for chunk in chunks(steps)]  # type: ignore[misc]
    for output in (feed() for feed in (*feeds, engine.close)):
        rows += output.rows
        closed += output.transactions
    return Output(tuple(rows), tuple(closed))


def save(path: Path, steps: Sequence[Step]) -> None:
    """The steps as a capture file; its suffix says which."""
    with create(path, SESSION) as writer:
        for chunk in chunks(steps):
            writer.write(chunk)


def values(count: int, first: float = 0.5) -> dict[str, object]:
    """Present values of so many analog values, as ReadPropertyMultiple answers."""
    return {
        "list-of-read-access-results": [
            {
                "object-identifier": f"analog-value,{number}",
                "list-of-results": [
                    {"property-identifier": 85, "read-result": {"property-value": first + number}}
                ],
            }
            for number in range(count)
        ]
    }  # fmt: skip


def writes(count: int) -> bytes:
    """WritePropertyMultiple of so many setpoints."""
    specs = [
        {
            "object-identifier": f"analog-value,{number}",
            "list-of-properties": [{"property-identifier": 85, "value": float(number), "priority": 8}],
        }
        for number in range(count)
    ]
    return codec.encode(services.CONFIRMED[WRITE_MULTIPLE], {"list-of-write-access-specs": specs})


def reads(count: int) -> bytes:
    """ReadPropertyMultiple of so many present values."""
    specs = [
        {"object-identifier": f"analog-value,{number}", "list-of-property-references": [{"property-identifier": 85}]}
        for number in range(count)
    ]
    return codec.encode(services.CONFIRMED[READ_MULTIPLE], {"list-of-read-access-specs": specs})


def results(count: int, first: float = 0.5) -> bytes:
    """The answer to `reads`."""
    return codec.encode(services.ACK[READ_MULTIPLE], values(count, first))
