"""The check of an N2 frame, and what a damaged one was if one thing at one of its ends went wrong.

    command    '>' AA C … KK CR      KK: sum of the characters after '>' up to the last before KK, modulo 256
    answer     'A' CR                no checksum
               'A' data KK CR        KK: sum of the data characters, the A not counted
    refusal    'N' EE CR             no checksum

The start character is in no sum, so a frame that lost it still has a right one: what it was is told by its form.
"""

from __future__ import annotations

import re

from dissectors.checksums import sum8
from dissectors.frame import Check, Damage, Flaw, Repair
from dissectors.n2.commands import Command, expected_length, parse_command
from dissectors.n2.forms import fits, may_answer

COMMAND, ANSWER, REFUSAL, CR = 0x3E, 0x41, 0x4E, 0x0D

NOT_TEXT = re.compile(rb"[^\x20-\x7e]")
"""An octet that no N2 frame carries."""

_HEX = frozenset(b"0123456789ABCDEFabcdef")
_HEX_PAIR = re.compile(rb"[0-9A-Fa-f]{2}")
_LEAST_COMMAND = 7  # > AA C KK CR


def judge(octets: bytes) -> tuple[Check, Damage | None]:
    """The verdict on a whole frame that ends with CR: its check, and what is wrong with it (None: nothing)."""
    body = octets[1:-1]
    if octets[0] == COMMAND:
        if len(body) < 5:
            return Check.ABSENT, Damage.SHORT
        return _judge_sum(octets, body)
    if octets[0] == REFUSAL:
        if len(body) != 2:
            return Check.ABSENT, Damage.SHORT if len(body) < 2 else Damage.LONG
        return Check.ABSENT, None if _HEX_PAIR.fullmatch(body) else Damage.FORM
    if octets[0] != ANSWER:
        return Check.BAD, Damage.FORM
    if not body:
        return Check.ABSENT, None
    if len(body) < 2:
        return Check.ABSENT, Damage.SHORT
    return _judge_sum(octets, body)


def _judge_sum(octets: bytes, body: bytes) -> tuple[Check, Damage | None]:
    data, sent = body[:-2], body[-2:]
    if sent[0] not in _HEX or sent[1] not in _HEX:
        return Check.BAD, Damage.FORM
    if int(sent, 16) == sum8(data):
        return Check.GOOD, Damage.FORM if NOT_TEXT.search(data) else None
    if NOT_TEXT.search(data):
        return Check.BAD, Damage.FORM
    expected = expected_length(octets) if octets[0] == COMMAND else None
    if expected is not None and len(octets) != expected:
        return Check.BAD, Damage.SHORT if len(octets) < expected else Damage.LONG
    return Check.BAD, Damage.CHECK


def check_off(octets: bytes) -> int | None:
    """By how much the checksum of a whole frame is too large, modulo 256, where nothing else is wrong with it."""
    if octets[:1] not in (b">", b"A") or judge(octets)[1] is not Damage.CHECK:
        return None
    return (int(octets[-3:-1], 16) - sum8(octets[1:-3])) & 0xFF


def is_good(octets: bytes) -> bool:
    """Whether a whole frame is right by a check of its own."""
    return judge(octets) == (Check.GOOD, None)


def repaired_command(octets: bytes) -> Repair | None:
    """What a damaged command was. `octets` with or without `>` and CR."""
    if octets[:1] != b">":
        for flaw, rest in ((Flaw.FIRST_MISSING, octets), (Flaw.FIRST_SPOILT, octets[1:])):
            whole = b">" + rest
            if whole.endswith(b"\r") and len(whole) >= _LEAST_COMMAND and is_good(whole) and _is_known(whole):
                return Repair(flaw, whole)
        return None
    for flaw, whole in _ends_repaired(octets, _LEAST_COMMAND):
        if is_good(whole) and (flaw is Flaw.LAST_MISSING or _is_known(whole)):
            return Repair(flaw, whole)
    return None


def _is_known(command: bytes) -> bool:
    """Whether a command is one of the known ones, as long as it should be."""
    expected = expected_length(command)
    if expected is not None:
        return expected == len(command)
    told = parse_command(command)
    return told.type.kind == "synchronise-time" or (told.type.kind == "write-attribute" and told.value is not None)


def repaired_answer(octets: bytes, asked: Command | None) -> Repair | None:
    """What a damaged answer to the open command was; None without one (then nothing tells)."""
    if asked is None:
        return None
    for flaw, whole in _answers_repaired(octets):
        check, damage = judge(whole)
        if damage is not None or not may_answer(asked, whole):
            continue
        if check is Check.ABSENT and flaw is Flaw.LAST_SPOILT and octets[-1] in _HEX:
            continue  # more of a longer answer
        if flaw is not Flaw.LAST_TWO_MISSING or fits(asked, whole):
            return Repair(flaw, whole)
    return None


def _answers_repaired(octets: bytes) -> list[tuple[Flaw, bytes]]:
    """Whole frames that this may have been, the likeliest first."""
    if octets[0] == REFUSAL:
        return [(Flaw.LAST_MISSING, octets + b"\r"), (Flaw.LAST_SPOILT, octets[:-1] + b"\r")]
    if octets[0] == ANSWER:
        return _ends_repaired(octets, 1)
    if not octets.endswith(b"\r"):
        return []
    return [
        (Flaw.FIRST_MISSING, b"A" + octets),
        (Flaw.FIRST_SPOILT, b"A" + octets[1:]),
        (Flaw.FIRST_SPOILT, b"N" + octets[1:]),
    ]


def _ends_repaired(octets: bytes, least: int) -> list[tuple[Flaw, bytes]]:
    """Whole frames that octets with a right start may have been if their end is wrong; `least`: octets, with CR."""
    if octets.endswith(b"\r"):
        if len(octets) < 4:
            return []
        swapped = octets[:-3] + octets[-2:-1] + octets[-3:-2] + b"\r"
        return [(Flaw.CHECK_SWAPPED, swapped)] if swapped != octets else []
    made = [(Flaw.LAST_MISSING, octets + b"\r")]
    if len(octets) >= max(2, least):
        made.append((Flaw.LAST_SPOILT, octets[:-1] + b"\r"))
    if len(octets) >= max(4, least - 2):
        data, digit = octets[1:-1], octets[-1:].upper()
        check = b"%02X" % sum8(data)
        if check[:1] == digit:
            made.append((Flaw.LAST_TWO_MISSING, octets[:1] + data + check + b"\r"))
    return made


def make_command(text: str) -> bytes:
    """`>`, the characters (address, command, data), their sum, CR."""
    body = text.encode("ascii")
    return b">%s%02X\r" % (body, sum8(body))


def make_answer(text: str = "") -> bytes:
    """`A`, the characters and their sum, CR; without characters the short acknowledgement."""
    body = text.encode("ascii")
    return b"A%s%02X\r" % (body, sum8(body)) if body else b"A\r"
