"""The protocol of a capture whose file does not say it, told from its first octets, and how sure that is. Pure.

Every protocol that is known reads them with the settings that it normally has; a good frame counts bits of evidence as
in a search on a port (`autodetect.py`). Sure is what that search would be sure of, where no other protocol makes good
frames of octets that the first does not explain. One that does is named: two protocols on one bus.

Line settings: a logic analyser's times of single octets give the length of a character, and with it rate and number of
bits; reads that hold more octets than the usual rate can bring give a faster one. Otherwise nothing tells them, and
those of the protocol stand in.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum

from dissectors import registry
from dissectors.findings import counted
from dissectors.frame import Chunk, Frame
from dissectors.line import NS_PER_S, LineSettings, Timing
from dissectors.manifest import Dissector
from dissectors.words import percent
from sniff.analysis.autodetect import (
    BAUDS,
    COVERED_LEAST,
    FOUND_BITS,
    FOUND_FRAMES,
    HEARD_MOST,
    CandidateEvidence,
    Candidature,
    sureness,
)
from sniff.analysis.rest_evidence import second_in
from sniff.engine.engine import Engine
from sniff.engine.session import ASSUMED, LINE_NOTE, PROTOCOL_NOTE, SECOND_NOTE, Session

LEAST_BITS = 8.0
"""Evidence of the only frame there is, from which on its protocol is worth a guess."""

_ALL_RATES = tuple(sorted({*BAUDS, 14400, 28800, 230400, 460800, 500000, 921600}))
_TOLERANCE = 0.03  # of a character's length: a sender's clock and the analyser's samples
_LEAST_INTERVALS = 4


class Sureness(Enum):
    """How sure a protocol is."""

    SURE = "sure"
    LIKELY = "likely"
    GUESS = "a guess"
    NO = "cannot tell"


@dataclass(frozen=True, slots=True)
class Told:
    """What octets say. `reading`: the best protocol, None where none makes a good frame; `second`: another protocol
    that explains what it does not, and how many good frames that has; `neighbour`: what they are instead.
    """

    sureness: Sureness
    reading: Candidature | None = None
    second: tuple[str, int] | None = None
    neighbour: str = ""

    @property
    def words(self) -> str:
        """For people: the protocol, how sure, and why."""
        reading = self.reading
        if self.neighbour:
            return f"its octets are of {self.neighbour}, which is not known here"
        if reading is None:
            return "no protocol makes good frames of its octets"
        frames = "1 good frame holds" if reading.frames == 1 else f"{reading.frames} good frames hold"
        if self.sureness is Sureness.NO:
            frames = f"{counted(reading.frames, 'good frame')} of {registry.get(reading.protocol).title}"
            return f"{frames} in {reading.octets} octets, too few to tell"
        said = f"{self.sureness.value}: {frames} {percent(reading.covered, 0)} of {reading.octets} octets"
        if self.sureness is Sureness.SURE:
            said += f", {sureness(reading)}"
        elif reading.frames < FOUND_FRAMES:
            said += ", too few to be sure"
        if self.second is not None:
            title = registry.get(self.second[0]).title
            said += f"; with foreign frames that read as {title} ({self.second[1]})"
        return said


def detected(session: Session) -> Session:
    """The session with the protocol and the line that its first octets say, as far as nobody else says them."""
    if session.unknown or not session.protocol_is_assumed:
        return _with_line(session)
    told = told_by(session)
    words = told.words
    if told.reading is None or told.sureness is Sureness.NO:
        return replace(session, notes={**session.notes, PROTOCOL_NOTE: f"assumed: {words}"})
    name = told.reading.protocol
    line = LineSettings.parse(registry.get(name).default_line) if session.line_is_assumed else session.line
    notes = {**session.notes, PROTOCOL_NOTE: words} | ({SECOND_NOTE: told.second[0]} if told.second is not None else {})
    return _with_line(replace(session, protocol=name, line=line, notes=notes))


def told_by(session: Session, only: str | None = None) -> Told:
    """What the sample of a session says of its protocol; `only`: the one that it is asked for."""
    sample = session.sample
    if not sample:
        return Told(Sureness.NO)
    readings = _readings(session, registry.usable() if only is None else [registry.get(only)])
    covered = max((one.covered for one in readings if one.frames), default=0.0)
    if only is None and covered < COVERED_LEAST:
        # a log of a gateway, then, if that explains more: a request with its CRC may look like the head of such a frame
        readings += [one for one in _readings(session, registry.relatives()) if one.covered > covered]
    readings.sort(key=lambda one: (one.bits, one.octets * one.covered), reverse=True)
    best = next((one for one in readings if one.frames), None)
    told = Told(Sureness.NO)
    if best is not None:
        second = _second(session, best, [one.protocol for one in readings if one is not best and one.frames])
        told = Told(_how_sure(best, readings, second), best, second)
    return replace(told, neighbour=_neighbour(session)) if told.sureness is Sureness.NO else told


def _neighbour(session: Session) -> str:
    """What octets of no protocol are of, where one of them has frames of the same form."""
    octets = b"".join(chunk.octets for chunk in session.sample)[:HEARD_MOST]
    return next(registry.neighbours(octets), "")


def _readings(session: Session, protocols: Sequence[Dissector]) -> list[Candidature]:
    """What each protocol makes of the sample."""
    readings = []
    for dissector in protocols:
        line = LineSettings.parse(dissector.default_line) if session.line_is_assumed else session.line
        evidence = CandidateEvidence(line, (dissector.name,), session.adapter.latency)
        for chunk in session.sample:
            evidence.feed(chunk)
        evidence.advance(session.sample[-1].time + 10 * NS_PER_S)
        readings.append(evidence.best())
    return readings


def _how_sure(best: Candidature, readings: Sequence[Candidature], second: tuple[str, int] | None) -> Sureness:
    others = max((one.bits for one in readings if one is not best), default=0.0)
    apart = others < best.bits / 2 or second is not None
    if best.enough and apart:
        return Sureness.SURE
    if best.bits >= FOUND_BITS / 2 and best.frames > 1 and others < best.bits:
        return Sureness.LIKELY
    if best.bits >= LEAST_BITS and best.covered >= COVERED_LEAST:
        return Sureness.GUESS
    # noise takes evidence away: what is left of a bus that is disturbed
    if best.frames >= FOUND_FRAMES and others <= best.bits:
        return Sureness.GUESS
    return Sureness.NO


def _second(session: Session, best: Candidature, others: Sequence[str]) -> tuple[str, int] | None:
    """Another protocol of lines that makes good frames of what the best one, of lines too, calls noise."""
    others = [name for name in others if registry.is_of_lines(name)]  # a relative on networks shares no line
    if best.covered >= 1.0 or not others or not registry.is_of_lines(best.protocol):
        return None
    rest = noise_of(session, best.protocol, best.line)
    return second_in(rest, replace(session, line=best.line), others)


def noise_of(session: Session, protocol: str, line: LineSettings) -> list[list[Chunk]]:
    """What of the sample is in no good frame of a protocol: stretches between good frames, each piece at its end."""
    engine = Engine(registry.get(protocol), Timing(line, session.adapter.latency))
    outputs = [engine.feed(chunk) for chunk in session.sample]
    outputs.append(engine.advance(session.sample[-1].time + 10 * NS_PER_S))
    events = [row.event for output in outputs for row in output.rows]
    return [
        [Chunk(event.end, event.octets) for event in stretch]
        for is_good, stretch in itertools.groupby(events, lambda event: isinstance(event, Frame) and event.ok)
        if not is_good
    ]


# -- line settings ---------------------------------------------------------------------------------------------


def _with_line(session: Session) -> Session:
    """The session with what the times of its octets say of the line, where nobody says it."""
    if not session.line_is_assumed or "line" in session.unknown:
        return session
    line = _of_characters(session) or _fast_enough(session)
    if line is None or line == session.line:
        return session
    return replace(session, line=line, notes={**session.notes, LINE_NOTE: ASSUMED}).with_latency_of_reads()


def _of_characters(session: Session) -> LineSettings | None:
    """Rate and bits of a character by the times of single octets, of a source whose times are exact."""
    if session.adapter.latency:
        return None
    singles = [chunk for chunk in session.sample if len(chunk.octets) == 1]
    steps = sorted(after.time - before.time for before, after in itertools.pairwise(singles))
    steps = [step for step in steps if step > 0]
    if len(steps) < _LEAST_INTERVALS:
        return None
    char = steps[len(steps) // 4]
    if sum(abs(step - char) <= _TOLERANCE * char for step in steps) < len(steps) / 4:
        return None
    fits = [(abs(bits * NS_PER_S / rate - char) / char, bits, rate) for rate in _ALL_RATES for bits in (10, 11)]
    off, bits, rate = min(fits)
    if off > _TOLERANCE:
        return None
    usual = LineSettings.parse(registry.get(session.protocol).default_line)
    parity = "N" if bits == 10 else usual.parity if usual.parity != "N" else "E"
    return LineSettings(rate, 8, parity, 1)


def _fast_enough(session: Session) -> LineSettings | None:
    """The usual line, or the next faster one that brings as many octets as were read; None when the usual one does."""
    sample, line = session.sample, session.line
    if len(sample) < 2 or not session.has_times:
        return None
    span = sample[-1].time - sample[0].time + session.adapter.latency
    octets = sum(len(chunk.octets) for chunk in sample[1:])
    if span <= 0 or octets < 200:
        return None
    for rate in (line.baud, *(one for one in _ALL_RATES if one > line.baud)):
        faster = replace(line, baud=rate)
        if octets * faster.char <= 1.05 * span:
            return faster
    return None
