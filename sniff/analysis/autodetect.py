"""The search for the settings and the protocol of a bus, by what is heard while settings are changed. Pure.

1. All protocols' framers run side by side over what one candidate heard. A good frame counts bits of evidence: log2 of
   how much rarer it is among random octets (`bits_of`). Octets in no good frame and octets with line errors count
   against it.
2. Enough is enough: FOUND_BITS from at least FOUND_FRAMES frames that hold most of the octets, hardly any of them with
   line errors, and the search stops.
3. A wrong candidate is left early: when the receiver reports errors on many octets, or when long rows of 0 or 1 bits
   (00, FF, 80, FE …: what a wrong rate makes of a line) are most of what comes. Else after DWELL ns and ENOUGH octets,
   both doubled in each round through all candidates.
4. Silence says nothing about a candidate: whatever the settings, a bus that talks gives octets. So silence is waited
   for, and told apart in the end.
5. Octets that come with the wrong parity name the right one: see `Evidence.hint`.

What no listener can tell: a second stop bit from the silence after one.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from enum import Enum

from dissectors import registry
from dissectors.frame import Chunk, Frame, LineError
from dissectors.line import LineSettings, Timing
from dissectors.tracker import Verdict
from sniff.engine.engine import Engine, Output

FOUND_BITS = 60.0
FOUND_FRAMES = 3
LIKELY_BITS = 24.0
"""From here on the best candidate is worth naming when time is over."""

DWELL = 2_000_000_000
ENOUGH = 40
ROUNDS_MOST = 5  # doublings
PATIENCE = 8
"""Times DWELL after which even few octets have to do."""

REJECT_OCTETS = 24
REJECT_MARKED = 0.35
REJECT_ROWS = 0.7
MARKED_MOST = 0.15
COVERED_LEAST = 0.6

HEARD_MOST = 4096
"""Octets that are asked whether they are of a protocol that only has frames of the same form."""

_FRAME_MOST = 24.0
_NOISE_BITS = 0.25  # against, an octet
_MARK_BITS = 1.0
_ANSWERED_BITS = 6.0  # a request and its answer belong together
_ROWS = frozenset((0x00, 0x80, 0xC0, 0xE0, 0xF0, 0xF8, 0xFC, 0xFE, 0xFF, 0x7F, 0x3F, 0x01, 0x03))
"""Octets with one change of level at most (as bits on the line, nearly so)."""

BAUDS = (9600, 19200, 38400, 115200, 57600, 76800, 4800, 2400, 1200)
FORMATS = ("8N1", "8E1", "8O1", "7E1", "7O1")


def candidates(
    lines: Iterable[LineSettings] | None = None,
    first: Iterable[LineSettings] = (),
    last: Iterable[LineSettings] = (),
) -> tuple[LineSettings, ...]:
    """Settings in the order of trying: `first`, the usual ones, `last`. `lines`: these and no others."""
    if lines is not None:
        return tuple(dict.fromkeys(lines))
    # The frequent rates in both frequent formats before anything else; parity odd and seven bits last.
    ranked = sorted(
        (rate + 4 * (place >= 2) * place + place, rate, place)
        for rate in range(len(BAUDS))
        for place in range(len(FORMATS))
    )
    usual = [LineSettings.parse(f"{BAUDS[rate]},{FORMATS[place]}") for _, rate, place in ranked]
    return tuple(dict.fromkeys((*first, *usual, *last)))


def bits_of(frame: Frame) -> float:
    """How much a good frame says for its protocol (`Dissector.bits`), at most _FRAME_MOST."""
    return min(_FRAME_MOST, registry.get(frame.protocol).bits(frame))


@dataclass(slots=True)
class Tally:
    """What one protocol's reading of a candidate came to."""

    frames: int = 0
    octets: int = 0  # in good frames
    bits: float = 0.0


@dataclass(frozen=True, slots=True)
class Candidature:
    """The best protocol of one candidate. `bits`: evidence for it less what speaks against it."""

    line: LineSettings
    protocol: str
    bits: float
    frames: int
    octets: int
    covered: float
    marked: float

    @property
    def enough(self) -> bool:
        """Whether it settles the matter."""
        return (
            self.bits >= FOUND_BITS
            and self.frames >= FOUND_FRAMES
            and self.covered >= COVERED_LEAST
            and self.marked <= MARKED_MOST
        )


class CandidateEvidence:
    """One stay at one candidate: all protocols side by side."""

    def __init__(self, line: LineSettings, protocols: Sequence[str], latency: int) -> None:
        self.line = line
        self.engines = {name: Engine(registry.get(name), Timing(line, latency)) for name in protocols}
        self.tallies = {name: Tally() for name in protocols}
        self.octets = 0
        self.marked = 0
        self.rows = 0
        self.first: int | None = None
        self._heard = bytearray()
        self._even_marked = self._odd_marked = self._even = self._odd = 0
        self._high = 0

    def feed(self, chunk: Chunk) -> None:
        """Take what one read returned."""
        if chunk.octets:
            self.first = chunk.time if self.first is None else self.first
            self._count(chunk)
            self._heard += chunk.octets[: HEARD_MOST - len(self._heard)]
        for name, engine in self.engines.items():
            self._take(name, engine.feed(chunk))

    def advance(self, now: int) -> None:
        """Say that nothing came up to `now`."""
        for name, engine in self.engines.items():
            deadline = engine.deadline()
            if deadline is not None and deadline <= now:
                self._take(name, engine.advance(now))

    def best(self) -> Candidature:
        """The reading with the most evidence; none is that of a protocol whose neighbour this is."""
        ranked = sorted(self.tallies.items(), key=lambda pair: (pair[1].bits, pair[1].octets), reverse=True)
        own = ((name, tally) for name, tally in ranked if not tally.frames or not self._neighbour(name))
        name, tally = next(own, (ranked[0][0], Tally()))
        against = _NOISE_BITS * max(0, self.octets - tally.octets) + _MARK_BITS * self.marked
        return Candidature(
            self.line,
            name,
            tally.bits - against,
            tally.frames,
            self.octets,
            tally.octets / self.octets if self.octets else 0.0,
            self.marked / self.octets if self.octets else 0.0,
        )

    def _neighbour(self, name: str) -> str:
        return registry.get(name).neighbour(bytes(self._heard))

    @property
    def wrong(self) -> bool:
        """Whether this can be left at once."""
        if self.octets < REJECT_OCTETS or self.best().enough:
            return False
        if self.marked > REJECT_MARKED * self.octets:
            return True
        frames = max(tally.frames for tally in self.tallies.values())
        return not frames and self.rows > REJECT_ROWS * self.octets

    def hint(self) -> LineSettings | None:
        """Other settings that these octets speak for; None when they speak for none.

        The same number of bits in a character: the wrong parity marks every octet; seven bits and a parity read as
        eight bits have all the same parity. One bit less: a parity bit in the place of the stop bit is an error
        exactly for octets of one parity.
        """
        line, even, odd = self.line, self._even, self._odd
        if self.octets < 16:
            return None
        other = {"E": "O", "O": "E"}.get(line.parity)
        if other and self.marked >= 0.9 * self.octets:
            return LineSettings(line.baud, line.data_bits, other, line.stop_bits)
        if line.parity != "N" or line.data_bits != 8:
            return None
        if not self.marked and self._high >= 4 and min(even, odd) <= 0.02 * self.octets:
            return LineSettings(line.baud, 7, "E" if even > odd else "O", 1)
        if self._even_marked + self._odd_marked >= 4 and min(even, odd) >= 4:
            share_even, share_odd = self._even_marked / even, self._odd_marked / odd
            if share_even >= 0.9 and share_odd <= 0.1:
                return LineSettings(line.baud, 8, "E", 1)
            if share_odd >= 0.9 and share_even <= 0.1:
                return LineSettings(line.baud, 8, "O", 1)
        return None

    def _take(self, name: str, output: Output) -> None:
        tally = self.tallies[name]
        for row in output.rows:
            if isinstance(row.event, Frame) and row.event.ok and (bits := bits_of(row.event)) > 0:
                tally.frames += 1
                tally.octets += len(row.event.octets)
                tally.bits += bits
        tally.bits += _ANSWERED_BITS * sum(one.verdict is Verdict.ANSWERED for one in output.transactions)

    def _count(self, chunk: Chunk) -> None:
        marked = {mark.offset for mark in chunk.marks if mark.error & ~LineError.OVERRUN}
        self.octets += len(chunk.octets)
        self.marked += len(marked)
        for offset, octet in enumerate(chunk.octets):
            self.rows += octet in _ROWS
            self._high += octet >= 0x80
            is_marked = offset in marked
            if octet.bit_count() % 2:
                self._odd += 1
                self._odd_marked += is_marked
            else:
                self._even += 1
                self._even_marked += is_marked


class Ending(Enum):
    """How a search ended."""

    FOUND = "found"
    LIKELY = "likely"  # the best there was, not enough to be sure
    SILENT = "silent"  # not one octet
    UNKNOWN = "unknown"  # octets, but no settings under which they mean something


@dataclass(frozen=True, slots=True)
class Outcome:
    """What a search came to. `reading`: None when silent. `tried`: how many settings heard octets."""

    ending: Ending
    reading: Candidature | None
    tried: int
    octets: int
    cannot_tell: tuple[str, ...] = ()


@dataclass(slots=True)
class Detecting:
    """The search: feed it what comes while `wanted` is in force, change the settings whenever `wanted` changes.

    `latency`: ns of the adapter. `reports`: line errors it can tell, None when nobody knows.
    """

    lines: tuple[LineSettings, ...]
    protocols: tuple[str, ...]
    latency: int = 0
    reports: tuple[str, ...] | None = None
    octets: int = 0
    found: Candidature | None = None
    best: Candidature | None = None
    _index: int = 0
    _round: int = 0
    _tried: set[LineSettings] = field(default_factory=set)
    _hinted: list[LineSettings] = field(default_factory=list)
    _was_hinted: set[LineSettings] = field(default_factory=set)
    _refused: set[LineSettings] = field(default_factory=set)
    _evidence: CandidateEvidence = field(init=False)

    def __post_init__(self) -> None:
        self._evidence = CandidateEvidence(self.lines[0], self.protocols, self.latency)

    @property
    def wanted(self) -> LineSettings:
        """The settings that should be in force."""
        return self._evidence.line

    @property
    def current(self) -> CandidateEvidence:
        """What the present candidate has shown."""
        return self._evidence

    def feed(self, chunk: Chunk) -> None:
        """Take octets that were heard with `wanted`."""
        if self.found is not None:
            return
        self.octets += len(chunk.octets)
        self._evidence.feed(chunk)
        self._decide(chunk.time)

    def advance(self, now: int) -> None:
        """Say that nothing came up to `now`."""
        if self.found is None:
            self._evidence.advance(now)
            self._decide(now)

    def refuse(self) -> None:
        """Say that the port cannot do what is `wanted`."""
        self._refused.add(self.wanted)
        self._move()

    def forgive(self) -> None:
        """Say that another port stands there, or the same anew: what could not be set may be now."""
        self._refused.clear()

    @property
    def is_refused(self) -> bool:
        """Whether the port could not do what is `wanted`: it can do nothing of all."""
        return self.wanted in self._refused

    def outcome(self) -> Outcome:
        """What can be said when the search ends here."""
        reading = self.found or self.best
        if reading is None:
            ending = Ending.SILENT if not self.octets else Ending.UNKNOWN
        elif self.found is not None:
            ending = Ending.FOUND
        else:
            ending = Ending.LIKELY if reading.bits >= LIKELY_BITS and reading.frames > 1 else Ending.UNKNOWN
        tried = len(self._tried | ({self.wanted} if self._evidence.octets else set()))
        named = reading if ending in (Ending.FOUND, Ending.LIKELY) else None
        return Outcome(ending, named, tried, self.octets, self._cannot_tell(named))

    def _decide(self, now: int) -> None:
        evidence = self._evidence
        if evidence.first is None:
            return
        reading = evidence.best()
        if self.best is None or reading.bits > self.best.bits:
            self.best = reading
        if reading.enough:
            self.found = reading
            return
        hint = evidence.hint()
        if hint is not None and hint in self.lines and hint not in self._was_hinted:
            self._was_hinted.add(hint)
            self._hinted.append(hint)
            self._move()
        elif evidence.wrong or self._is_over(now):
            self._move()

    def _is_over(self, now: int) -> bool:
        evidence, factor = self._evidence, 1 << self._round
        assert evidence.first is not None
        stayed = now - evidence.first
        if stayed < DWELL * factor:
            return False
        # Frames that make sense and are only too few deserve time.
        return evidence.octets >= ENOUGH * factor or stayed >= PATIENCE * DWELL * factor

    def _move(self) -> None:
        if self._evidence.octets:
            self._tried.add(self._evidence.line)
        line = self._hinted.pop() if self._hinted else self._following()
        while line in self._refused and len(self._refused) < len(self.lines):
            line = self._following()
        self._evidence = CandidateEvidence(line, self.protocols, self.latency)

    def _following(self) -> LineSettings:
        self._index += 1
        if self._index == len(self.lines):
            self._index = 0
            self._round = min(self._round + 1, ROUNDS_MOST)
            self._was_hinted.clear()
        return self.lines[self._index]

    def _cannot_tell(self, reading: Candidature | None) -> tuple[str, ...]:
        if reading is None:
            return ()
        line = reading.line
        said = []
        if line.stop_bits == 1:
            twin = LineSettings(line.baud, line.data_bits, line.parity, 2)
            said.append(f"{twin} from {line}: a second stop bit looks like silence")
        needed = "framing" if line.parity == "N" else "parity"
        if self.reports is None or needed not in self.reports:  # then octets alone look right with any parity
            others = [f"{line.baud},{line.data_bits}{parity}1" for parity in "NEO" if parity != line.parity]
            why = "it is not known whether this adapter reports" if self.reports is None else "this adapter hides"
            said.append(f"{' or '.join(others)} from {line}: {why} {needed} errors")
        return tuple(said)


def sureness(reading: Candidature) -> str:
    """How sure it is, in words: "chance would give this once in a million times"."""
    bits = max(0.0, reading.bits)
    return "chance would not give this" if bits >= 40 else f"chance gives this once in {10 ** math.floor(bits * 0.301)}"
