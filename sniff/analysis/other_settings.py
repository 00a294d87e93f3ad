"""Other settings that fit octets which make no frames with those of the capture. Pure, bounded.

Asked is, of a sample: another parity; another protocol (every one that the registry knows); seven bits read as eight;
frames of a network; fewer data bits than the bus has; line ends that a terminal changed; every bit inverted; a bus that
is slower or faster. What fits is named with its evidence; where nothing does, nothing is named.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

from dissectors import registry
from dissectors.frame import Chunk
from dissectors.line import LineSettings
from dissectors.words import percent
from sniff.analysis.autodetect import COVERED_LEAST, FOUND_FRAMES, LIKELY_BITS, CandidateEvidence, Candidature
from sniff.analysis.line_ends import as_sent
from sniff.analysis.slower_bus import slower_by

SAMPLE_OCTETS = 3000
"""Octets of a capture that are asked."""

LEAST_OCTETS = 24
BURSTS = 16
"""Stretches between two silences that are asked whether the bus is slower."""

SHORT_SILENCE, LONG_SILENCE = 4, 20
"""Characters after which a stretch ends; on a bus that is much slower there is silence within characters."""

DAMAGED_LEAST, DAMAGED_OFTEN = 3, 10
"""So many rows that are no good frame, and one in so many, where octets lack bits and some frames are good."""

DIFFERENT_LEAST = 10
"""So many different frames, each with two octets of check: chance leaves bit 7 out of all once in a million."""

TOP_SET = 5
"""Of so many octets of checks one at least has the highest bit that is left; half of them should."""

_TEXT = frozenset(b"\r\n\t") | frozenset(range(0x20, 0x7F))


@dataclass(frozen=True, slots=True)
class Fit:
    """Settings that fit: what was seen, what it is consistent with, what to do. `lacks_bits`: octets had more bits;
    `is_parity`: they are as they should be, but for line errors that another parity of the port would not make;
    `of_network`: frames that belong on no line."""

    seen: str
    means: str
    next: str
    lacks_bits: bool = False
    is_parity: bool = False
    of_network: bool = False


def what_fits(
    sample: Sequence[Chunk], line: LineSettings, latency: int, protocol: str, has_rate: bool = True
) -> Fit | None:
    """What these octets are; None where nothing can be said. `protocol`: the one that they are not. `has_rate`: whether
    they were received at the baud rate of `line`, and not at one that nobody said."""
    if sum(len(chunk.octets) for chunk in sample) < LEAST_OCTETS:
        return None
    return next(_fits(sample, line, latency, protocol, has_rate), None)


def other_protocol(sample: Sequence[Chunk], line: LineSettings, latency: int, protocol: str) -> Fit | None:
    """The protocol, other than `protocol`, that these octets are with the same settings; None where none is sure."""
    if sum(len(chunk.octets) for chunk in sample) < LEAST_OCTETS:
        return None
    found = _convincing(_evidence(sample, line, latency))
    if found is None:
        return _of_network(sample, line, latency) or next(_by_neighbour(sample, "somebody speaks"), None)
    if found.protocol == protocol:
        return None
    return _as_protocol(found, "these octets read", f"somebody speaks {found.protocol}", f"-p {found.protocol}")


def _fits(sample: Sequence[Chunk], line: LineSettings, latency: int, protocol: str, has_rate: bool) -> Iterator[Fit]:
    """The surest first: what reads with good checks, then what the octets themselves exclude."""
    evidence = _evidence(sample, line, latency)
    hint = evidence.hint()
    if hint is not None and hint.data_bits == line.data_bits:
        yield from _by_parity(sample, hint, line, latency)
    if hint is not None and hint.data_bits == 7 and line.data_bits == 8:
        masked = _changed(sample, 0x7F, 0)
        if (found := _convincing(_evidence(masked, hint, latency))) is not None:
            how = f"with 7 data bits and {'even' if hint.parity == 'E' else 'odd'} parity these octets read"
            yield _as_protocol(found, how, f"the bus has {hint}", f"read it with -s {hint} -p {found.protocol}")
    if (found := _convincing(evidence)) is not None and found.protocol != protocol:
        yield _as_protocol(
            found, "these octets read", f"the bus runs {found.protocol}", f"read it with -p {found.protocol}"
        )
    if (of_network := _of_network(sample, line, latency)) is not None:
        yield of_network
    yield from _by_neighbour(sample, "the bus runs")
    yield from _by_line_ends(sample, line, latency)
    inverted = _changed(sample, 0xFF, 0xFF)
    if (found := _convincing(_evidence(inverted, line, latency))) is not None:
        yield _as_protocol(
            found,
            "inverted, these octets read",
            "A and B are swapped, or a converter inverts",
            "change A and B at the tap",
        )
    yield from _by_values(sample, line)
    yield from _by_rate(sample, line, has_rate)


def _by_parity(sample: Sequence[Chunk], bus: LineSettings, line: LineSettings, latency: int) -> Iterator[Fit]:
    """Octets that are right, though a port with another parity than the bus marks them."""
    plain = [replace(chunk, marks=()) for chunk in sample]
    if (found := _convincing(_evidence(plain, bus, latency))) is not None:
        yield replace(
            _as_protocol(
                found,
                "but for their line errors these octets read",
                f"the bus has {bus}, and the port {line}",
                f"read it with -s {bus} -p {found.protocol}",
            ),
            is_parity=True,
        )


def _by_neighbour(sample: Sequence[Chunk], who: str) -> Iterator[Fit]:
    """Another protocol, which nobody here reads, with frames of the form of one that is known."""
    octets = b"".join(chunk.octets for chunk in sample)
    for said in registry.neighbours(octets):
        yield Fit(f"these octets are of {said}", f"{who} {said}", "a program that reads it; this one does not")


def _by_line_ends(sample: Sequence[Chunk], line: LineSettings, latency: int) -> Iterator[Fit]:
    """Protocols of text whose CR a terminal took: the reading that leaves least over."""
    found = [(one, _convincing(_evidence(one.chunks, line, latency))) for one in as_sent(sample)]
    fitting = [(one, reading) for one, reading in found if reading is not None]
    if fitting:
        ends, reading = max(fitting, key=lambda one: one[1].covered)
        settle = "record again with the port set raw (`stty raw`), or with `sniff485 record`"
        yield _as_protocol(reading, f"{ends.how} these octets read", ends.why, settle)


def _as_protocol(found: Candidature, how: str, means: str, settle: str) -> Fit:
    return Fit(f"{how} as {found.protocol} with good checks ({_held(found)})", means, settle)


def _held(found: Candidature) -> str:
    return f"{found.frames} frames hold {percent(found.covered, 0)} of {found.octets} octets"


def _of_network(sample: Sequence[Chunk], line: LineSettings, latency: int) -> Fit | None:
    """Frames as networks carry them, which came onto the line as they are."""
    found = _convincing(_evidence(sample, line, latency, tuple(registry.RELATIVES)))
    if found is None:
        return None
    title = registry.get(found.protocol).title
    return Fit(
        f"these octets are frames of {title}, header and all ({_held(found)})",
        "frames of a network on a serial line: a converter hands them on as they are, and whoever expects those of "
        "this line passes them by",
        "the converter: as a gateway it translates them; or whoever sends through it: the frames of this line",
        of_network=True,
    )


def _evidence(
    sample: Sequence[Chunk], line: LineSettings, latency: int, protocols: Sequence[str] | None = None
) -> CandidateEvidence:
    """All protocols over the sample, or those named."""
    evidence = CandidateEvidence(line, registry.names() if protocols is None else protocols, latency)
    for chunk in sample:
        evidence.feed(chunk)
    if sample:
        evidence.advance(sample[-1].time + 10_000_000_000)
    return evidence


def _convincing(evidence: CandidateEvidence) -> Candidature | None:
    reading = evidence.best()
    enough = reading.frames >= FOUND_FRAMES and reading.covered >= COVERED_LEAST and reading.bits >= LIKELY_BITS
    return reading if enough else None


def _changed(sample: Sequence[Chunk], keep: int, flip: int) -> list[Chunk]:
    table = bytes((value ^ flip) & keep for value in range(256))
    return [replace(chunk, octets=chunk.octets.translate(table)) for chunk in sample]


def lacking_bits(
    sample: Sequence[Chunk], line: LineSettings, values: Iterable[int], damaged: int, rows: int
) -> Fit | None:
    """That octets lack their upper bits, which spoils most frames and leaves others good by chance; else None.

    `values`: that octets had; `damaged`: how many of so many `rows` are no good frame. `sample`: the first rows.
    """
    if damaged < DAMAGED_LEAST or DAMAGED_OFTEN * damaged < rows or any(value > 0x7F for value in values):
        return None
    different = {chunk.octets for chunk in sample if len(chunk.octets) > 3}
    return next(_by_values(sample, line), None) if len(different) >= DIFFERENT_LEAST else None


def _by_values(sample: Sequence[Chunk], line: LineSettings) -> Iterator[Fit]:
    """Octets that never have their upper bits."""
    values: Counter[int] = Counter()
    for chunk in sample:
        values.update(chunk.octets)
    total, top = values.total(), max(values, default=0)
    if total < 2 * LEAST_OCTETS or len(values) < 8 or top > 0x7F:
        return
    bits = 5 if top <= 0x1F else 6 if top <= 0x3F else 7
    ends = b"".join(octets[-2:] for octets in {chunk.octets for chunk in sample if len(chunk.octets) > 3})
    if TOP_SET * sum(octet >> (bits - 1) for octet in ends) < len(ends):
        return  # there stands no check, and small numbers are all there is
    text = sum(count for value, count in values.items() if value in _TEXT)
    if text >= 0.95 * total:
        return  # a protocol of text that nobody here knows
    seen = f"no octet of {total} is above {(1 << bits) - 1:02X}"
    port = f"the port is set to {line}" if line.data_bits < 8 else "the octets went through something that has no more"
    yield Fit(
        f"{seen}: they were received with {bits} data bits",
        f"{bits} data bits where the bus has 8, so that no check can agree; {port}",
        f"set 8 data bits (-s {LineSettings(line.baud, 8, line.parity, line.stop_bits)}) and record again",
        lacks_bits=True,
    )


def _by_rate(sample: Sequence[Chunk], line: LineSettings, has_rate: bool) -> Iterator[Fit]:
    """A bus that is slower, or faster, than the port listens."""
    factor = slower_by(_bursts(sample, line, LONG_SILENCE)[:BURSTS], line)
    bursts = _bursts(sample, line, SHORT_SILENCE)
    if factor and not has_rate:
        yield Fit(
            f"wrong baud rate: every level lasts a multiple of {factor} bits, so the bus is that much slower",
            "the bus is slower than the port that received it, whose baud rate nobody said",
            f"listen at 1/{factor} of that rate, or `detect`",
        )
    elif factor:
        about = f"{factor} times slower, about {line.baud // factor} Bd" if factor < 12 else "over 10 times slower"
        yield Fit(
            f"wrong baud rate: every level lasts a multiple of {factor} bits, so the bus is {about}",
            f"the bus is slower than the {line.baud} Bd of the port",
            f"listen with -s {line.baud // factor}" if factor < 12 else "`detect`, or -s with the rate of the bus",
        )
    elif _too_short(bursts):
        often = ", ".join(burst.hex(" ").upper() for burst, _ in Counter(bursts).most_common(2))
        port = f"the {line.baud} Bd of the port" if has_rate else "the port"
        rate = f"{line.baud} Bd" if has_rate else port
        yield Fit(
            f"wrong baud rate: the bus is faster than {rate}; the same few octets come again and again "
            f"({often}), too few for a frame",
            f"the bus is faster than {port}, which takes some levels of a frame for octets",
            "listen with the next higher rates (-s), or `detect`",
        )


def _too_short(bursts: Sequence[bytes]) -> bool:
    """Whether the same bursts come again and again, and nearly all are too short for a frame.

    Noise does not repeat itself, and an octet that is always the same may be the ringing of a driver: so some bursts
    must be of two octets or more, and there must be two kinds of bursts. Where answers differ each time, requests do
    not: then a good part of the bursts, but not nearly all, come again and again, and none is a single octet.
    """
    often = {burst: count for burst, count in Counter(bursts).items() if count >= 3}
    mixed = sum(count for burst, count in often.items() if len(set(burst)) >= 2)
    short = sum(len(burst) < 4 for burst in bursts)
    if len(bursts) < 8 or not mixed or short < 0.7 * len(bursts):
        return False
    if len(often) >= 2 and sum(often.values()) >= 0.7 * len(bursts):
        return True
    answers_differ = len(set(bursts)) >= 4 and min(map(len, bursts)) >= 2
    return answers_differ and 0.4 * len(bursts) <= mixed <= 0.6 * len(bursts)


def _bursts(sample: Sequence[Chunk], line: LineSettings, silence: int) -> list[bytes]:
    """The octets between two silences of so many characters."""
    bursts: list[bytes] = []
    end: int | None = None
    for chunk in sample:
        start = chunk.time - len(chunk.octets) * line.char
        if end is None or start - end > silence * line.char:
            bursts.append(b"")
        bursts[-1] += chunk.octets
        end = chunk.time
    return bursts
