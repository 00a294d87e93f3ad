"""Octets that something on the way took for text are told as that, and damage of the line never is."""

from __future__ import annotations

from random import Random

import pytest

from dissectors.modbus.envelope import seal_rtu
from dissectors.modbus.text_changes import TextChange, TextDamage, request_length, sent_length
from tests.seeds import seeds

REQUEST = seal_rtu(bytes.fromhex("010300000006"))

CHANGES = {
    TextChange.CR_AS_LF: lambda frame: frame.replace(b"\r", b"\n"),
    TextChange.LF_AS_CR: lambda frame: frame.replace(b"\n", b"\r"),
    TextChange.CR_BEFORE_LF: lambda frame: frame.replace(b"\n", b"\r\n"),
    TextChange.CR_MISSING: lambda frame: frame.replace(b"\r", b""),
    TextChange.LF_MISSING: lambda frame: frame.replace(b"\n", b""),
    TextChange.FLOW_MISSING: lambda frame: frame.replace(b"\x11", b"").replace(b"\x13", b""),
    TextChange.FF_TWICE: lambda frame: frame.replace(b"\xff", b"\xff\xff"),
    TextChange.FF_MISSING: lambda frame: frame.replace(b"\xff", b""),
}


def answers(dice: Random, count: int = 60) -> list[bytes]:
    """Answers to REQUEST, in which the octets of text are common."""
    values = (0, 0, 1, 10, 13, 17, 19, 255)
    return [
        seal_rtu(b"\x01\x03\x0c" + bytes(dice.choice((*values, dice.randrange(256))) for _ in range(12)))
        for _ in range(count)
    ]


def damage_of(frames: list[bytes]) -> TextDamage:
    made = TextDamage()
    for frame in frames:
        made.add(frame, sent_length(REQUEST, frame))
    return made


@pytest.mark.parametrize("change", TextChange)
@pytest.mark.parametrize("seed", seeds(6))
def test_what_was_done_to_text_is_told(change, seed):
    sent = answers(Random(seed))
    read = [CHANGES[change](frame) for frame in sent]
    assert damage_of([after for before, after in zip(sent, read, strict=True) if before != after]).change is change


@pytest.mark.parametrize("seed", seeds(12))
def test_noise_is_never_taken_for_it(seed):
    dice = Random(seed)
    spoilt = []
    for frame in answers(dice):
        octets, place = bytearray(frame), dice.randrange(len(frame))
        match dice.randrange(3):
            case 0:
                octets[place] ^= 1 << dice.randrange(8)
            case 1:
                del octets[place]
            case _:
                octets.insert(place, dice.randrange(256))
        spoilt.append(bytes(octets))
    assert damage_of(spoilt).change is None


def test_one_frame_again_and_again_is_no_proof_by_itself():
    frame = seal_rtu(bytes.fromhex("01030c000d00000000000000000000")).replace(b"\r", b"")
    assert damage_of([frame] * 20).change is None


def test_other_frames_behind_it_in_one_read_change_nothing():
    read = [CHANGES[TextChange.CR_AS_LF](frame) for frame in answers(Random(3)) if b"\r" in frame]
    assert damage_of([frame + b"\x02\x03\x0a\x01" for frame in read]).change is TextChange.CR_AS_LF


@pytest.mark.parametrize(("octets", "length"), [("0103000A02C40B", 8), ("0103000000030506", None), ("0117", None)])
def test_how_long_a_request_was_is_known_of_simple_ones(octets, length):
    assert request_length(bytes.fromhex(octets)) == length
