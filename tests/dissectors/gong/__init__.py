"""Gong, a protocol made up to see what it takes to add one. Nobody speaks it.

'!' station(2) what(1) place(2) [value(4)] check(2) CR         digits are hex; check: sum of what is before it, mod 256

what    r  read it: its value comes back      R  the value that was read
        w  write a value to it                W  written
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from dissectors.checksums import sum8
from dissectors.frame import Check, Damage, Frame, Header, Role
from dissectors.line import MS, LineSettings, Timing
from dissectors.manifest import Dissector
from dissectors.plain_framers import Delimited, DelimitedFramer
from dissectors.plain_tracker import Polling
from dissectors.pseudonyms import Pseudonyms
from dissectors.readings import Origin, Reading
from dissectors.simulated import Party, Send, SimulatedBus
from dissectors.simulated_faults import BitFlips, LostResponse

FORM = re.compile(rb"!([0-9A-F]{2})([rRwW])([0-9A-F]{2})([0-9A-F]{4})?([0-9A-F]{2})\r")
KINDS = {"r": "read", "R": "read", "w": "write", "W": "write"}
EVERYBODY = 0


def seal(body: bytes) -> bytes:
    """A frame of what stands between `!` and the check."""
    return b"!%s%02X\r" % (body, sum8(body))


def judge(octets: bytes) -> tuple[Check, Damage | None]:
    """Whether a frame is well formed and its check is right."""
    match = FORM.fullmatch(octets)
    if match is None or (match[4] is None) != (match[2] in b"rW"):
        return Check.ABSENT, Damage.FORM
    return (Check.GOOD, None) if int(match[5], 16) == sum8(octets[1:-3]) else (Check.BAD, Damage.CHECK)


def framer(timing: Timing) -> DelimitedFramer:
    """`!` begins a frame, CR ends it."""
    return DelimitedFramer(timing, Delimited("gong", b"!", b"\r", longest=13, judge=judge))


def peek(frame: Frame) -> Header:
    """Who is asked or answers, and for what."""
    match = FORM.match(frame.octets)
    error = None if frame.damage is None else frame.damage.value
    if match is None:
        return Header("gong", None, None, Role.UNKNOWN, "unknown", ok=False, error=error)
    station, what, place = int(match[1], 16), match[2].decode(), int(match[3], 16)
    if what.isupper():
        return Header("gong", station, None, Role.RESPONSE, KINDS[what], ord(what), place, 1, frame.ok, error)
    whom = None if station == EVERYBODY else station
    return Header("gong", None, whom, Role.REQUEST, KINDS[what], ord(what), place, 1, frame.ok, error)


def text(frame: Frame, header: Header, role: Role) -> str:
    """One line for the frame list."""
    match = FORM.match(frame.octets)
    if match is None or header.address is None:
        return "no Gong frame"
    value = "" if match[4] is None else f" {int(match[4], 16)}"
    return f"{header.kind} place {header.address}{value}"


def fields(frame: Frame, role: Role) -> dict[str, int | float | str]:
    """The parts by name."""
    header, match = peek(frame), FORM.match(frame.octets)
    if match is None or header.address is None:
        return {}
    found: dict[str, int | float | str] = {"gong.station": int(match[1], 16), "gong.place": header.address}
    return found if match[4] is None else {**found, "gong.value": int(match[4], 16)}


def packet(frame: Frame, role: Role) -> Any:
    """No layout: the octets as they are."""
    from scapy.packet import Raw

    return Raw(frame.octets)


def readings(request: Frame | None, response: Frame | None) -> tuple[Reading, ...]:
    """The value read, or written once that is confirmed."""
    asked = FORM.match(request.octets) if request is not None else None
    told = FORM.match(response.octets) if response is not None else None
    if asked is None or told is None:
        return ()
    is_write = asked[2] == b"w"
    held = asked[4] if is_write else told[4]
    if held is None:
        return ()
    value = int(held, 16)
    return (Reading("place", int(asked[3], 16), value, value, Origin.WRITE if is_write else Origin.READ),)


class GongRenamer:
    """Gives stations other numbers."""

    def __init__(self) -> None:
        self.stations = Pseudonyms(range(1, 256), kept=(EVERYBODY,))

    def __call__(self, frame: Frame) -> bytes:
        """The frame under another name."""
        match = FORM.fullmatch(frame.octets)
        if match is None or not frame.ok:
            return frame.octets
        return seal(b"%02X" % self.stations.of(int(match[1], 16)) + frame.octets[3:-3])


class Master:
    """Reads place 7 of station 5, five times a second."""

    def __init__(self) -> None:
        self._next = 0

    def hear(self, now: int, octets: bytes, quiet: bool) -> tuple[Send, ...]:
        """Whatever comes, it goes on."""
        return ()

    def wake(self, now: int) -> tuple[Send, ...]:
        """Ask when it is time."""
        if now < self._next:
            return ()
        self._next = now + 200 * MS
        return (Send(now, seal(b"05r07")),)

    def next_wake(self) -> int:
        """When it asks next."""
        return self._next


class Bell:
    """Station 5: says 300 of every place."""

    def hear(self, now: int, octets: bytes, quiet: bool) -> tuple[Send, ...]:
        """Answer what is for it."""
        if judge(octets)[0] is not Check.GOOD or octets[1:4] != b"05r":
            return ()
        return (Send(now + 8 * MS, seal(b"05R" + octets[4:6] + b"012C")),)

    def wake(self, now: int) -> tuple[Send, ...]:
        """Nothing by itself."""
        return ()

    def next_wake(self) -> None:
        """Never."""
        return


def parties(line: LineSettings, faults: bool) -> list[Party]:
    """Who is on the simulated bus."""
    return [Party("master", Master(), answers=False), Party("bell", Bell())]


def scenarios() -> Mapping[str, SimulatedBus]:
    """A master and a bell."""
    return {"gong": SimulatedBus(parties, "a bell", faults=(BitFlips(1e-4), LostResponse(0.05)))}


GONG = Dissector(
    "gong", "Gong", framer, peek, Polling, text, fields, packet, default_line="9600,7E1",
    noun="bell", bits=lambda frame: 4.0 * len(frame.octets), readings=readings, renamer=GongRenamer,
    makers={"gong": seal}, scenarios=scenarios,
)  # fmt: skip
