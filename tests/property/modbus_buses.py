"""Modbus lines on which everything happens now and then, made from a number: good exchanges first of all, and every
kind of trouble that the rules tell apart."""

from __future__ import annotations

import random
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from dissectors.columns import Reads
from dissectors.line import LineSettings, Timing
from dissectors.modbus.envelope import seal_ascii, seal_rtu
from sniff.engine.session import Adapter, Session

_MS = 1_000_000
TROUBLES = (
    "silent",  # an absent station is asked
    "repeat",  # the first try gets nothing
    "damage",
    "noise",
    "refusal",
    "broadcast",
    "echo",
    "twice",  # two answers
    "late",  # after the next request
    "unasked",
    "elsewhere",  # another unit answers
    "slow",
    "hurry",  # the next request follows too soon
    "pause",  # inside a frame
    "cut",  # a request comes back in part
    "nobody",  # a read of address 0
    "reserved",  # address above 247
    "malformed",
    "master",  # a second one breaks in
    "bare",  # ASCII: no LF
)


@dataclass(slots=True)
class _Line:
    timing: Timing
    is_ascii: bool
    now: int = 1_000 * _MS
    times: list[int] = field(default_factory=list)
    chunks: list[bytes] = field(default_factory=list)

    def say(self, octets: bytes, gap: int, split: int = 0) -> None:
        """`gap`: silence before, ns. `split`: silence in the middle of it."""
        char = self.timing.char
        parts = [octets[: len(octets) // 2], octets[len(octets) // 2 :]] if split else [octets]
        for number, part in enumerate(parts):
            self.now += (split if number else gap) + len(part) * char
            if part:
                self.times.append(self.now)
                self.chunks.append(part)

    def seal(self, adu: bytes) -> bytes:
        return seal_ascii(adu) if self.is_ascii else seal_rtu(adu)


def bus(
    seed: int, is_ascii: bool = False, exchanges: int = 1500, troubles: Sequence[str] | None = None
) -> tuple[Session, Reads]:
    """One of them; `troubles`: which, else as the number says."""
    dice = random.Random(seed)
    line = LineSettings.parse("19200,7E1" if is_ascii else dice.choice(("9600,8E1", "19200,8E1", "115200,8N1")))
    latency = 0 if dice.random() < 0.7 else dice.choice((1, 16)) * _MS
    talk = _Line(Timing(line, latency), is_ascii)
    kinds = dice.sample(TROUBLES, dice.randint(0, 5))
    kinds = kinds if troubles is None else list(troubles)
    often = dice.choice((0.003, 0.02, 0.1, 0.3))
    units = dice.sample(range(1, 248), dice.randint(1, 9))
    pace = {unit: dice.randint(2, 40) * _MS for unit in units}
    polls = [_poll(dice, dice.choice(units)) for _ in range(dice.choice((3, 12, 60, 700)))]
    pause, timeout = dice.randint(2, 60) * _MS, dice.randint(80, 900) * _MS
    for number in range(exchanges):
        said = polls[number % len(polls)]
        trouble = dice.choice(kinds) if kinds and dice.random() < often else ""
        gap = pause + dice.randint(0, 1 + pause // 4)
        _exchange(talk, dice, said, pace[said[0]] + dice.randint(0, 3 * _MS), gap, timeout, trouble)
    octets, times = np.frombuffer(b"".join(talk.chunks), np.uint8), np.array(talk.times, np.int64)
    lengths = np.array([len(chunk) for chunk in talk.chunks], np.int64)
    if latency:
        times = -(-times // latency) * latency
    name = "modbus-ascii" if is_ascii else "modbus-rtu"
    session = Session("x", line, name, adapter=Adapter(latency=latency))
    return session, Reads(octets, times, lengths, np.zeros(len(times), bool))


def _poll(dice: random.Random, unit: int) -> bytes:
    kind = dice.choice((1, 3, 3, 3, 4, 6, 16))
    head = bytes((unit, kind, dice.randint(0, 3), dice.randint(0, 255)))
    if kind == 6:
        return head + bytes((dice.randint(0, 2), dice.randint(0, 255)))
    count = dice.randint(1, 8)
    return head + bytes((0, count)) + (bytes((2 * count,)) + dice.randbytes(2 * count) if kind == 16 else b"")


def _answer(dice: random.Random, said: bytes) -> bytes:
    kind, count = said[1], said[5]
    if kind == 6:
        return said
    if kind == 16:
        return said[:6]
    size = (count + 7) // 8 if kind == 1 else 2 * count
    return said[:2] + bytes((size,)) + dice.randbytes(size)


def _exchange(talk: _Line, dice: random.Random, said: bytes, took: int, gap: int, timeout: int, trouble: str) -> None:
    if trouble in _OTHER_TURNS:
        for octets, silence in _other_turn(talk, dice, said, took, gap, timeout, trouble):
            talk.say(octets, silence)
        return
    request, answer = talk.seal(said), talk.seal(_answer(dice, said))
    if trouble == "hurry":
        gap = gap // dice.choice((3, 8, 200))
    if trouble == "damage":
        at, whole = dice.randrange(len(request) + len(answer)), bytearray(request + answer)
        whole[at] ^= dice.randint(1, 127)
        request, answer = bytes(whole[: len(request)]), bytes(whole[len(request) :])
        if dice.random() < 0.3:
            answer = answer[: dice.randint(1, len(answer))]
    if trouble == "noise":
        talk.say(dice.randbytes(dice.randint(1, 30)), gap // 2)
    talk.say(request, gap, split=dice.randint(1, 3) * talk.timing.char if trouble == "pause" else 0)
    if trouble == "repeat":
        for _ in range(dice.randint(1, 3)):
            talk.say(request, timeout + dice.randint(0, 3 * _MS))
    elif trouble == "echo":
        talk.say(request, dice.choice((talk.timing.char, took // 3)))
    elif trouble == "cut":
        talk.say(request[: dice.randint(1, len(request) - 1)], talk.timing.char)
    elif trouble == "master":
        talk.say(talk.seal(_poll(dice, said[0])), took // 4)
    elif trouble == "late":
        talk.say(talk.seal(_poll(dice, said[0])), timeout)
    elif trouble == "slow":
        took = dice.choice((timeout * 9 // 10, 600 * _MS))
    elif trouble == "refusal":
        answer = talk.seal(bytes((said[0], said[1] | 0x80, dice.choice((1, 2, 3, 4, 6, 0x55)))))
    elif trouble == "elsewhere":
        answer = talk.seal(bytes((said[0] % 247 + 1,)) + _answer(dice, said)[1:])
    elif trouble == "bare":
        answer = answer[:-1]
    talk.say(answer, took, split=dice.randint(1, 3) * talk.timing.char if trouble == "pause" else 0)
    if trouble == "twice":
        talk.say(talk.seal(_answer(dice, said)), dice.choice((took, 3 * _MS)))


_OTHER_TURNS = ("silent", "broadcast", "nobody", "malformed", "reserved", "unasked")


def _other_turn(
    talk: _Line, dice: random.Random, said: bytes, took: int, gap: int, timeout: int, trouble: str
) -> list[tuple[bytes, int]]:
    """What is said instead of a good exchange, and the silence before each."""
    seal = talk.seal
    if trouble == "silent":
        return [(seal(bytes((dice.choice((99, 98)),)) + said[1:]), gap), (b"", timeout)]
    if trouble == "broadcast":
        everybody = dice.randbytes(4)
        answers = dice.random() < 0.2
        copy = (seal(bytes((said[0], 6)) + everybody), 20 * _MS) if answers else (b"", 150 * _MS)
        return [(seal(b"\0\6" + everybody), gap), copy]
    if trouble == "nobody":
        return [(seal(b"\0" + said[1:]), gap), (seal(_answer(dice, said)), took)]
    if trouble == "malformed":
        said = said[:1] + b"\x10\0\1\0\2\6" + dice.randbytes(6)
        return [(seal(said), gap), (seal(said[:1] + b"\x90\3"), took)]
    if trouble == "reserved":
        said = b"\xf9" + said[1:]
        return [(seal(said), gap), (seal(_answer(dice, said)), took)]
    return [(seal(_answer(dice, said)), gap)]
