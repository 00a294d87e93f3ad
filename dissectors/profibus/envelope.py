"""The check and the form of a telegram, and what a damaged one was if one thing went wrong with it.

Good is what has its start, twice the same length where it has one, a right sum, its end, and a frame control octet
that the standard knows: other buses use the same envelope (M-Bus, IEC 60870-5-101), with other octets behind it.
"""

from __future__ import annotations

from collections.abc import Container
from dataclasses import dataclass

from dissectors.checksums import sum8
from dissectors.frame import Check, Damage, Flaw, Repair
from dissectors.profibus.control import Control
from dissectors.profibus.telegram import BROADCAST, ED, FIXED, LEAST_LE, MOST_LE, SD1, SD2, SD3, SD4, body_of


def length_of(octets: bytes | bytearray, at: int = 0) -> int | None:
    """Octets of the checked telegram that begins at `at`: 0 where none can, None where too little of it is there."""
    start = octets[at]
    if start in (SD1, SD3):
        if len(octets) > at + 3 and not Control(octets[at + 3]).is_known:
            return 0
        return FIXED[start]
    if start != SD2:
        return 0
    head = octets[at + 1 : at + 4]
    if len(head) > 1 and head[0] != head[1]:
        return 0
    if head and not LEAST_LE <= head[0] <= MOST_LE:
        return 0
    if len(head) < 3:
        return None
    return head[0] + 6 if head[2] == SD2 else 0


def is_sound(octets: bytes) -> bool:
    """Whether a stretch is one good checked telegram."""
    if len(octets) < 6 or octets[-1] != ED or length_of(octets) != len(octets):
        return False
    body = body_of(octets)
    if len(body) < 3 or octets[-2] != sum8(body) or not Control(body[2]).is_known:
        return False
    return body[1] & 0x7F != BROADCAST and _has_extensions(body)


def _has_extensions(body: bytes) -> bool:
    """Whether the extensions that the addresses announce are there."""
    return len(body) - 3 >= (body[0] >> 7) + (body[1] >> 7)


@dataclass(frozen=True, slots=True)
class Damaged:
    """What a stretch that is no good telegram is taken for. `count`: octets of it, from its begin."""

    count: int
    check: Check
    damage: Damage
    expected: int | None
    repair: Repair | None = None


def damaged(octets: bytes) -> Damaged | None:
    """What begins the stretch, where its form still tells that it was a telegram; None where it may be anything.

    The stretch holds all up to the next good telegram, or to a silence.
    """
    expected = length_of(octets)
    if expected and len(octets) >= expected:
        return _of_right_length(octets[:expected])
    if octets[0] == SD2 and expected:  # a good header and too few octets
        return Damaged(len(octets), Check.ABSENT, Damage.SHORT, expected, _ended(octets, expected))
    if octets[0] == SD4 and len(octets) >= FIXED[SD4] and max(octets[1:3]) < BROADCAST:
        return Damaged(FIXED[SD4], Check.ABSENT, Damage.FORM, FIXED[SD4])  # none that this ring would pass
    whole = _begun(octets)
    if whole is not None:
        flaw, count, repaired = whole
        return Damaged(count, Check.BAD, Damage.FORM, len(repaired), Repair(flaw, repaired))
    count = _spoilt_head(octets)
    if count:
        return Damaged(count, Check.BAD, Damage.FORM, count)
    if expected and len(octets) >= 4:
        repair = _ended(octets, expected)
        if repair is not None:
            return Damaged(len(octets), Check.ABSENT, Damage.SHORT, expected, repair)
    return None


def head_inside(octets: bytes) -> int:
    """Where a telegram with a length begins behind other octets, by its whole head; 0: nowhere."""
    at = octets.find(SD2, 1)
    while 0 < at <= len(octets) - 4:
        if length_of(octets, at):
            return at
        at = octets.find(SD2, at + 1)
    return 0


def damaged_token(octets: bytes, holder: int | None, masters: Container[int]) -> Damaged | None:
    """The token of `holder` to another master, one octet of it spoilt or missing; None where it may be anything."""
    if not 2 <= len(octets) <= FIXED[SD4]:
        return None
    is_whole = len(octets) == FIXED[SD4]
    if octets[-1] == holder and octets[-2] in masters and (not is_whole or (octets[0] ^ SD4).bit_count() == 1):
        repaired = bytes((SD4,)) + octets[-2:]
        return Damaged(
            len(octets),
            Check.ABSENT,
            Damage.FORM,
            FIXED[SD4],
            Repair(Flaw.FIRST_SPOILT if is_whole else Flaw.FIRST_MISSING, repaired),
        )
    if octets[0] == SD4 and (octets[1] in masters or octets[-1] == holder):
        return Damaged(len(octets), Check.ABSENT, Damage.FORM if is_whole else Damage.SHORT, FIXED[SD4])
    return None


def _of_right_length(octets: bytes) -> Damaged | None:
    right_sum, right_end = octets[-2] == sum8(body_of(octets)), octets[-1] == ED
    if right_sum and not right_end:
        whole = octets[:-1] + bytes((ED,))
        repair = Repair(Flaw.LAST_SPOILT, whole) if is_sound(whole) else None
        return Damaged(len(octets), Check.GOOD, Damage.FORM, len(octets), repair)
    if octets[0] != SD2 and not right_end:
        return None
    damage = Damage.CHECK if right_end and not right_sum else Damage.FORM
    return Damaged(len(octets), Check.GOOD if right_sum else Check.BAD, damage, len(octets))


def _spoilt_head(octets: bytes) -> int:
    """Octets of a telegram with a length of which one octet of the head is spoilt, and another one elsewhere; 0 where
    it may be anything."""
    for length in dict.fromkeys(octets[1:3]):
        head = bytes((SD2, length, length, SD2))
        is_long = LEAST_LE <= length <= MOST_LE and len(octets) >= length + 6
        has_head = sum(a == b for a, b in zip(head, octets, strict=False)) == 3
        if is_long and has_head and octets[length + 5] == ED and Control(octets[6]).is_known:
            return length + 6
    return 0


def _ended(octets: bytes, expected: int) -> Repair | None:
    """A telegram whose end is missing."""
    whole = octets + bytes((ED,))
    return Repair(Flaw.LAST_MISSING, whole) if len(whole) == expected and is_sound(whole) else None


def _begun(octets: bytes) -> tuple[Flaw, int, bytes] | None:
    """A telegram whose begin is missing or spoilt: the flaw, the octets that are left of it, the whole."""
    for start in (SD1, SD3):
        size = FIXED[start]
        for flaw, rest in ((Flaw.FIRST_SPOILT, octets[1:size]), (Flaw.FIRST_MISSING, octets[: size - 1])):
            whole = bytes((start,)) + rest
            if len(whole) == size and is_sound(whole):
                return flaw, size - (flaw is Flaw.FIRST_MISSING), whole
    return _long_begun(octets)


def _long_begun(octets: bytes) -> tuple[Flaw, int, bytes] | None:
    """The same of one with a length: of its four first octets three are right, or all but the first are there."""
    if len(octets) < 8:
        return None
    for length in dict.fromkeys(octets[1:3]):
        head = bytes((SD2, length, length, SD2))
        whole = head + octets[4 : length + 6]
        if sum(a == b for a, b in zip(head, octets[:4], strict=True)) == 3 and is_sound(whole):
            return Flaw.ONE_SPOILT if octets[0] == SD2 else Flaw.FIRST_SPOILT, length + 6, whole
    whole = bytes((SD2,)) + octets[: octets[0] + 5]
    return (Flaw.FIRST_MISSING, len(whole) - 1, whole) if is_sound(whole) else None
