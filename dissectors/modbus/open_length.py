"""Frames of functions that predict no length, several to a run of octets: what an adapter glues into one read.

Between two silences a good CRC over all of the octets is enough (candidates.whole_stretch). In a run of several frames
any stretch from a place where a frame may begin could be one, and one of 260 such places in random octets has a good
CRC somewhere behind it. So the end of such a frame counts only where something agrees: silence; a good frame of a known
function that begins there; a frame of the same station and function (a request and its answer, or its exception); or
two such frames of another station. The answer itself, behind its request, ends at the first place where its CRC is
good.
"""

from __future__ import annotations

from collections.abc import Container, Iterable, Iterator
from typing import Final

from dissectors.checksums import crc16_modbus
from dissectors.modbus.candidates import (
    ANY_END,
    CRC_BITS,
    WHOLE_STRETCH,
    Candidate,
    exception_bits,
    is_text,
    without_zeros,
)
from dissectors.modbus.functions import BROADCAST, EXCEPTION_BIT, EXCEPTION_LENGTH, FUNCTIONS, is_open_length
from dissectors.modbus.lengths import MAX_FRAME, MIN_FRAME
from dissectors.modbus.open_request import Expected
from dissectors.modbus.past import Past

_UNPREDICTED: Final = frozenset(range(256)) - {
    code | bit for code in FUNCTIONS if code not in (0x08, 0x2B) for bit in (0, EXCEPTION_BIT)
}
"""Function octets behind which a frame may begin whose length nothing predicts."""

_CHECK: Final = 2
_SETTLING: Final = 0xFF
_MOST_BEGINS: Final = 32
_INITIAL: Final = 0xFFFF


def _step(value: int) -> int:
    for _ in range(8):
        value = value >> 1 ^ (0xA001 if value & 1 else 0)
    return value


_TABLE: Final = tuple(_step(value) for value in range(256))


class _Begin:
    """A place where such a frame may begin, and how far its CRC was followed.

    Behind a good CRC where an exchange goes on or begins, nothing longer that begins here is a frame: both would have
    to be chance.
    """

    __slots__ = ("begin", "crc", "ends", "is_over", "to")

    def __init__(self, at: int) -> None:
        self.begin = at
        self.crc = _INITIAL
        self.to = at
        self.ends: list[int] = []  # where the CRC is good
        self.is_over = False

    def follow(self, known: bytes, base: int, least: int, most: int) -> list[int]:
        """Positions up to `most` with a good CRC; none before `least`."""
        crc, at, table = self.crc, self.to, _TABLE
        if self.is_over:
            return self.ends
        for octet in known[at - base : most - base]:
            crc = crc >> 8 ^ table[(crc ^ octet) & 0xFF]
            at += 1
            if not crc and at >= least:
                self.ends.append(at)
                self.is_over = _is_agreed(known, self.begin - base, at - base)
                if self.is_over:
                    break
        self.crc, self.to = crc, at
        return self.ends


class OpenLengthFinder:
    """Finds such frames in a growing window. Positions count from the first octet ever fed.

    `unfinished`: where, when last looked, a frame began behind one of its station and function and had no end yet, or
    none that anything behind it agrees with.
    """

    __slots__ = ("_begins", "unfinished")

    def __init__(self) -> None:
        self.unfinished: list[int] = []
        self._begins: dict[int, _Begin] = {}

    def look(
        self,
        known: bytes,
        base: int,
        begins: Iterable[int],
        good: Iterable[Candidate],
        silent: bool,
        expected: Expected | None,
        past: Past,
        heard: Container[int],
    ) -> list[Candidate]:
        """Candidates in the known octets of a window at `base`.

        `begins`: where a frame may begin beside the ends of `good`, the candidates of known functions. `silent`:
        whether silence follows the octets. `expected`: the open request before the window.
        `past`: what was said before. `heard`: the stations that good frames named.
        """
        for position in [p for p in self._begins if p < base]:
            del self._begins[position]
        good = list(good)
        starts = {candidate.start for candidate in good}
        last = base + len(known) - MIN_FRAME
        ends = {candidate.start + candidate.length for candidate in good}
        ahead = {p for p in ends if p <= last and known[p - base + 1] in _UNPREDICTED and _opens(known, p - base)}
        ahead.update(p for p in begins if _opens(known, p - base))
        self.unfinished = []
        if not ahead:
            return []
        found: dict[tuple[int, int], Candidate] = {}
        partner = dict.fromkeys(ahead, False)
        if base in ahead and expected is not None:
            partner[base] = expected.is_for(known, 0)
        while ahead:
            position = min(ahead)
            ahead.discard(position)
            frames = self._frames(known, base, position, partner[position], starts, silent, heard)
            if not frames and partner[position] and not silent and base + len(known) - position < MAX_FRAME:
                self.unfinished.append(position)
            for candidate in frames:
                if silent and candidate.end == base + len(known) and not known[-1]:
                    bare = without_zeros(candidate.octets, past, partner[position])
                    candidate = candidate._replace(length=len(bare), octets=bare)
                found[position, candidate.length] = candidate
                for end in {candidate.end, base + _beyond(known, candidate.end - base)}:
                    answers = _same(known, position - base, end - base)
                    if end not in partner and _opens(known, end - base):
                        ahead.add(end)
                    elif answers and not silent and end - base > len(known) - MIN_FRAME:
                        self.unfinished.append(end)  # no more than its head is there
                    partner[end] = partner.get(end, False) or answers
        return list(found.values())

    def _frames(
        self,
        known: bytes,
        base: int,
        position: int,
        partner: bool,
        starts: set[int],
        silent: bool,
        heard: Container[int],
    ) -> list[Candidate]:
        """Those that begin at a position; `partner`: the frame directly before is of the same station and function."""
        at, end = position - base, len(known)
        known_station = partner or known[at] in heard
        if _is_exception(known, at):
            stretch = known[at : at + EXCEPTION_LENGTH]
            if len(stretch) < EXCEPTION_LENGTH or crc16_modbus(stretch):
                return []
            bits = CRC_BITS + exception_bits(stretch[2])
            return [Candidate(position, EXCEPTION_LENGTH, bits, stretch[0], False, True, stretch)]
        begin = self._begins.get(position)
        if begin is None:
            if len(self._begins) >= _MOST_BEGINS:
                return []
            begin = self._begins[position] = _Begin(position)
        most = min(position + MAX_FRAME, base + end)
        frames = []
        unsure = False
        for position_after in begin.follow(known, base, position + MIN_FRAME, most):
            after = position_after - base
            last = silent and after == end
            agreed = last or position_after in starts or _is_agreed(known, at, after)
            if not agreed and not (partner and after + 2 <= end and known[after]):
                continue
            unsure = not agreed
            partner = False  # where nothing agrees but what is before, only its first end counts
            stretch = known[at:after]
            if known_station or not is_text(stretch):
                bits = WHOLE_STRETCH if last else ANY_END
                frames.append(Candidate(position, after - at, bits, stretch[0], True, True, stretch))
        if unsure and not silent and len(frames) == 1 and end - at < MAX_FRAME:
            self.unfinished.append(position)  # of a longer one, at whose end something agrees, the rest may come yet
        return frames


def settled_end(known: bytes, at: int) -> int:
    """Index behind the frame that begins at `at`, if it is one that nothing to come can change, else 0."""
    if not _opens(known, at):
        return 0
    if _is_exception(known, at):
        end = at + EXCEPTION_LENGTH
        return end if end < len(known) and not crc16_modbus(known[at:end]) else 0
    return next((end for end in _good_ends(known, at) if _is_agreed(known, at, end)), 0)


def _is_agreed(known: bytes, at: int, after: int) -> bool:
    """Whether what stands at `after` says that the frame which begins at `at` ends there."""
    if _same(known, at, after) or _begins_exchange(known, after) or _asks_on(known, at, after):
        return True
    beyond = _beyond(known, after)
    return beyond > after and _same(known, at, beyond)


def _asks_on(known: bytes, at: int, after: int) -> bool:
    """Whether another station is asked for the same there, in as many octets: a master that looks who is there."""
    end = 2 * after - at
    return (
        end <= len(known)
        and known[at + 1 : after - _CHECK] == known[after + 1 : end - _CHECK]
        and _opens(known, after)
        and not crc16_modbus(known[after:end])
    )


def _beyond(known: bytes, at: int) -> int:
    """The index behind the octets FF at `at`: so some makers' stations settle who answers."""
    while at < len(known) and known[at] == _SETTLING:
        at += 1
    return at


def _begins_exchange(known: bytes, at: int) -> bool:
    """Whether a frame with a good CRC begins there, and another of its station and function behind it."""
    return _opens(known, at) and not known[at + 1] & EXCEPTION_BIT and bool(_goes_on(known, at))


def _goes_on(known: bytes, at: int) -> int:
    """The first index with a good CRC behind which the station and the function of `at` are named again, else 0."""
    return next((end for end in _good_ends(known, at) if _same(known, at, end)), 0)


def _good_ends(known: bytes, at: int) -> Iterator[int]:
    """Every index at which the CRC of what begins at `at` is good."""
    crc, table, least = _INITIAL, _TABLE, at + MIN_FRAME
    for end, octet in enumerate(known[at : at + MAX_FRAME], at + 1):
        crc = crc >> 8 ^ table[(crc ^ octet) & 0xFF]
        if not crc and end >= least:
            yield end


def _opens(known: bytes, at: int) -> bool:
    """Whether the head of such a frame, or of an exception to one, stands there."""
    if not 0 <= at <= len(known) - MIN_FRAME or known[at] == BROADCAST:
        return False
    return is_open_length(known, at) or _is_exception(known, at)


def _is_exception(known: bytes, at: int) -> bool:
    """Whether an exception to a function that the standard does not know may begin there."""
    code = known[at + 1]
    return bool(code & EXCEPTION_BIT) and code ^ EXCEPTION_BIT not in FUNCTIONS


def _same(known: bytes, at: int, after: int) -> bool:
    """Whether the octets at `after` name the station and the function that those at `at` do."""
    if after + 2 > len(known) or known[at] != known[after]:
        return False
    return known[at + 1] == known[after + 1] & ~EXCEPTION_BIT
