"""NMEA 0183 as a dissector of sniff485.

'$' talker(2) sentence(3) (',' field)… '*' check(2) CR LF      at most 82 octets; check: exclusive or, in hex
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import reduce
from operator import xor
from typing import Any

from dissectors.frame import Check, Damage, Frame, Header, Role
from dissectors.line import NS_PER_S, LineSettings, Timing
from dissectors.manifest import Dissector
from dissectors.plain_framers import Delimited, DelimitedFramer
from dissectors.simulated import Party, Send, SimulatedBus
from dissectors.simulated_faults import BitFlips
from dissectors.tracker import Announcements

SENTENCE = re.compile(rb"\$([A-Z]{2}[A-Z]{3})((?:,[ -)+-~]*)*)\*([0-9A-F]{2})\r\n")


def check_of(body: bytes) -> int:
    """The check over what stands between `$` and `*`."""
    return reduce(xor, body, 0)


def judge(octets: bytes) -> tuple[Check, Damage | None]:
    """Whether a sentence is well formed and its check is right."""
    match = SENTENCE.fullmatch(octets)
    if match is None:
        return Check.ABSENT, Damage.FORM
    good = int(match[3], 16) == check_of(match[1] + match[2])
    return (Check.GOOD, None) if good else (Check.BAD, Damage.CHECK)


def framer(timing: Timing) -> DelimitedFramer:
    """`$` begins a sentence, always; LF ends it, and so do 82 octets, or 1 s of silence. All else is noise."""
    return DelimitedFramer(timing, Delimited("nmea", b"$", b"\n", longest=82, judge=judge))


def peek(frame: Frame) -> Header:
    """The quick look: talker and sentence."""
    kind = frame.octets[1:6].decode("ascii", "replace").lower()
    error = None if frame.damage is None else frame.damage.value
    return Header("nmea", None, None, Role.DATA, kind if kind.isalpha() else "unknown", ok=frame.ok, error=error)


def text(frame: Frame, header: Header, role: Role) -> str:
    """One line for the frame list."""
    said = frame.octets.decode("ascii", "replace").strip()
    return "".join(c if c.isprintable() else "." for c in said)


def fields(frame: Frame, role: Role) -> dict[str, int | float | str]:
    """The sentence."""
    return {"nmea.sentence": peek(frame).kind}


def packet(frame: Frame, role: Role) -> Any:
    """No layout: the octets as they are."""
    from scapy.packet import Raw

    return Raw(frame.octets)


def bits(frame: Frame) -> float:
    """How much a good sentence says: each character comes from a small alphabet."""
    return 2.0 * len(frame.octets)


def make(body: bytes) -> bytes:
    """A sentence with its check; `body` is what stands between `$` and `*`."""
    return b"$%s*%02X\r\n" % (body, check_of(body))


class Sounder:
    """A depth sounder: speaks ten times a second, hears nobody."""

    def __init__(self) -> None:
        self._next = 0

    def hear(self, now: int, octets: bytes, quiet: bool) -> tuple[Send, ...]:
        """Nothing anybody says matters to it."""
        return ()

    def wake(self, now: int) -> tuple[Send, ...]:
        """Say the depth when it is time."""
        if now < self._next:
            return ()
        self._next = now + NS_PER_S // 10
        return (Send(now, make(b"SDDBT,12.0")),)

    def next_wake(self) -> int:
        """When it speaks next."""
        return self._next


def parties(line: LineSettings, faults: bool) -> list[Party]:
    """Who is on the simulated bus."""
    return [Party("sounder", Sounder(), answers=False)]


def scenarios() -> Mapping[str, SimulatedBus]:
    """A boat at anchor."""
    return {"nmea": SimulatedBus(parties, "a depth sounder", faults=(BitFlips(1e-4),))}


NMEA = Dissector(
    "nmea", "NMEA 0183", framer, peek, Announcements, text, fields, packet, default_line="4800,8N1",
    bits=bits, makers={"nmea": make}, scenarios=scenarios,
)  # fmt: skip
