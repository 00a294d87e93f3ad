"""Octets that no frame covers: a damaged frame of a station, or noise?"""

from __future__ import annotations

from enum import Enum, auto
from typing import NamedTuple

from dissectors.frame import Damage, LineError, Mark, Noise, Place, Reason
from dissectors.modbus.candidates import SHORT_FRAME, LengthGuess, octet_bits, readings
from dissectors.modbus.functions import BROADCAST, EXCEPTION_BIT, FUNCTIONS, MAX_UNIT
from dissectors.modbus.lengths import MAX_FRAME, MIN_FRAME, MORE
from dissectors.modbus.open_request import Expected

_COMMON = frozenset({0x01, 0x02, 0x03, 0x04, 0x05, 0x06, 0x0F, 0x10})


ODD_LENGTH = ("odd-length",)
"""Flags of a frame with a good check whose octets say another length: the sender's mistake, not the line's."""


class Side(Enum):
    """What stands beside a stretch, without proved silence between (SILENCE: with it)."""

    SILENCE = auto()  # proved, or the capture begins or ends here
    FRAME = auto()
    NOISE = auto()


class DamagedFrame(NamedTuple):
    """A damaged frame: the length it should have had (None: not known), and what is wrong with it."""

    expected: int | None
    damage: Damage


def classify_leftover(
    octets: bytes, before: Side, after: Side, heard: bool | None, called: bool, expected: Expected | None
) -> DamagedFrame | None:
    """The damaged frame that a stretch without a good one is; None when it is noise.

    It must begin where a frame may begin, with a station and a known function, and end where a frame may end. From a
    station that was never heard it must have a predicted length too: one random burst in eight begins plausibly, and
    would put stations on the bus that are not there.
    `heard`: whether good frames named the station that its first octet names; None when no good frame came yet.
    `called`: whether that station was asked before for the function that its second octet names; then two or three
    octets between silences are the begin of a frame. `expected`: the open request.
    """
    count = len(octets)
    if before is Side.NOISE or after is Side.NOISE or not 2 <= count <= MAX_FRAME:
        return None
    unit, code = octets[0], octets[1]
    awaited = expected if expected is not None and expected.unit == unit else None
    function = FUNCTIONS.get(code & ~EXCEPTION_BIT)
    if function is None:
        # the function octet itself may be hit: the length of the awaited answer tells
        if awaited is not None and code & ~EXCEPTION_BIT == awaited.function:
            return DamagedFrame(None, Damage.CHECK)
        return DamagedFrame(count, Damage.CHECK) if awaited is not None and count == awaited.length else None
    if not heard and not (1 <= unit <= MAX_UNIT or (unit == BROADCAST and function.writes)):
        return None
    lengths = [r.length for r in readings(octets, 0, count) if r.length != MORE]
    answers = awaited is not None and awaited.function == code & ~EXCEPTION_BIT
    alone = before is Side.SILENCE and after is Side.SILENCE
    if count < MIN_FRAME and not answers and not (called and alone):
        return None
    fits = count in lengths or (answers and awaited is not None and count == awaited.length)
    if not (fits or heard or (heard is None and alone and code & ~EXCEPTION_BIT in _COMMON)):
        return None
    if fits:
        return DamagedFrame(count, Damage.CHECK)
    right = awaited.length if answers and awaited is not None and not code & EXCEPTION_BIT else None
    if right is None:
        right = predicted(octets)
    if right is None or count < right:
        return DamagedFrame(right, Damage.SHORT)
    return DamagedFrame(right, Damage.LONG)


def cut_echo_of(octets: bytes, expected: Expected | None) -> int | None:
    """The length of the open request, where octets are its begin, given back and cut short, rather than that of its
    answer; else None.

    Of functions whose answer repeats the request it may be either: it is no echo here, but misses the same length.
    """
    count = len(octets)
    if expected is None or expected.length == len(expected.octets):
        return None
    if not 3 <= count < len(expected.octets) or not expected.octets.startswith(octets):
        return None
    if count == 3 and readings(octets, 0, count)[-1:] == (LengthGuess(expected.length or 0, False, True),):
        return None  # its third octet is the byte count of the answer as well
    return len(expected.octets)


def predicted(octets: bytes) -> int | None:
    """Which predicted length octets missed that are longer or shorter: the next longer one, else the longest.

    A length at which the octets would look ill formed counts only when there is no other.
    """
    count = len(octets)
    told = [r for r in readings(octets, 0, count) if r.length != MORE]
    fair = [r.length for r in told if r.length > count or octet_bits(octets, 0, r) >= SHORT_FRAME]
    lengths = fair or [r.length for r in told]
    return min((n for n in lengths if n >= count), default=max(lengths, default=None))


def zeros_at_start(octets: bytes) -> int:
    """How many zeros a stretch begins with."""
    return len(octets) - len(octets.lstrip(b"\0"))


def levels_at_start(octets: bytes | bytearray) -> int:
    """How many octets of one level of the line (FF or 00) a stretch begins with: a driver that is switched on, or
    stations that settle who answers, as some makers' searches have it."""
    return len(octets) - len(octets.lstrip(octets[:1])) if octets[:1] in (b"\xff", b"\0") else 0


def is_preamble(noise: Noise) -> bool:
    """Whether octets FF stand before a frame."""
    return noise.place is Place.BEFORE and not noise.octets.strip(b"\xff")


def noise_reason(octets: bytes, marks: tuple[Mark, ...]) -> Reason:
    """Why these octets are no frame."""
    if not octets.strip(b"\0") and any(m.error & LineError.BREAK for m in marks):
        return Reason.BREAK
    return Reason.NO_FRAME


def noise_place(before: Side, after: Side, gap_before: int, gap_after: int) -> Place:
    """Where noise lay: next to the frame that it touches, the nearer one when it touches two.

    `gap_before`, `gap_after`: nominal silences, ns.
    """
    touches_before, touches_after = before is Side.FRAME, after is Side.FRAME
    if touches_before and touches_after:
        if gap_before == gap_after:
            return Place.BETWEEN
        return Place.AFTER if gap_before < gap_after else Place.BEFORE
    if touches_before:
        return Place.AFTER
    return Place.BEFORE if touches_after else Place.BETWEEN
