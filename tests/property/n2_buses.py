"""N2 buses on which everything happens now and then, made from a number: good exchanges first of all, and every kind of
trouble that the rules tell apart."""

from __future__ import annotations

import random
from collections.abc import Sequence

import numpy as np

from dissectors.columns import Reads
from dissectors.line import LineSettings, Timing
from dissectors.n2.envelope import make_answer, make_command
from sniff.engine.session import Adapter, Session

_MS = 1_000_000
TROUBLES = (
    "silent",  # an absent station is asked
    "repeat",  # the first try gets nothing
    "damage",
    "noise",
    "refusal",
    "reset",  # N00, then identified
    "override",
    "broadcast",
    "echo",
    "twice",  # two answers
    "late",  # after the next command
    "unasked",
    "slow",
    "misfit",  # an acknowledge that does not hold what was asked for
    "master",  # a second one breaks in
    "cut",  # a command that another one runs into
)


def bus(seed: int, exchanges: int = 1500, troubles: Sequence[str] | None = None) -> tuple[Session, Reads]:
    """One of them; `troubles`: which, else as the number says."""
    dice = random.Random(seed)
    line = LineSettings.parse("9600,8N1")
    timing = Timing(line)
    latency = 0 if dice.random() < 0.7 else dice.choice((1, 16)) * _MS
    kinds = dice.sample(TROUBLES, dice.randint(0, 5)) if troubles is None else list(troubles)
    often = dice.choice((0.003, 0.02, 0.1, 0.3))
    units = dice.sample(range(1, 256), dice.randint(1, 9))
    polls = [_poll(dice, dice.choice(units)) for _ in range(dice.choice((3, 12, 60, 700)))]
    pause, timeout = dice.randint(2, 60) * _MS, dice.randint(120, 900) * _MS
    now, times, chunks = 1_000 * _MS, [], []
    for number in range(exchanges):
        said, answer = polls[number % len(polls)]
        trouble = dice.choice(kinds) if kinds and dice.random() < often else ""
        took = (5 + len(said) + dice.randint(0, 8)) * _MS
        gap = pause + dice.randint(0, pause)
        for octets, silence in _turn(dice, said, answer, took, gap, timeout, trouble):
            now += silence + len(octets) * timing.char
            if octets:
                times.append(now)
                chunks.append(octets)
    read = np.array(times, np.int64)
    read = -(-read // latency) * latency if latency else read
    lengths = np.array([len(chunk) for chunk in chunks], np.int64)
    session = Session("x", line, "n2", adapter=Adapter(latency=latency))
    return session, Reads(np.frombuffer(b"".join(chunks), np.uint8), read, lengths, np.zeros(len(read), bool))


def _poll(dice: random.Random, unit: int) -> tuple[bytes, bytes]:
    """A command and its answer."""
    kind = dice.choice(("read", "read", "read", "poll", "acknowledge", "write", "override", "release", "identify"))
    number, value = dice.randint(1, 40), f"{dice.randint(0, 0xFFFF):04X}0000"
    body, answer = {
        "read": (f"1{dice.randint(1, 4)}{number:02X}03", make_answer(value)),
        "poll": ("04", make_answer()),
        "acknowledge": ("05", make_answer()),
        "write": (f"21{number:02X}0A{value}", make_answer()),
        "override": (f"7203{number:02X}{value}", make_answer()),
        "release": (f"7303{number:02X}", make_answer()),
        "identify": ("F", make_answer("10")),
    }[kind]
    return make_command(f"{unit:02X}{body}"), answer


def _turn(
    dice: random.Random, said: bytes, answer: bytes, took: int, gap: int, timeout: int, trouble: str
) -> list[tuple[bytes, int]]:
    """What is said, and the silence before each."""
    other = make_command(said[1:3].decode() + "1102" + f"{dice.randint(0, 9):02X}")
    at = dice.randint(1, len(said) - 1)
    code = dice.choice((b"N11\r", b"N01\r", b"N0B\r", b"N00\r", b"N10\r"))
    turns: dict[str, list[tuple[bytes, int]]] = {
        "silent": [(b">FE" + make_command("FE04")[3:], gap), (b"", timeout)],
        "repeat": [(said, gap), *[(said, timeout)] * dice.randint(1, 3), (answer, took)],
        "noise": [(dice.randbytes(dice.randint(1, 12)), gap), (said, gap), (answer, took)],
        "refusal": [(said, gap), (code, took)],
        "reset": [(said, gap), (b"N00\r", took), (make_command(said[1:3].decode() + "F"), gap), (b"A1061\r", took)],
        "override": [(make_command(said[1:3].decode() + "72030142480000"), gap), (b"A\r", took)],
        "broadcast": [(make_command("0000010203"), gap), (b"", 50 * _MS)],
        "echo": [(said, gap), (said, dice.choice((1, took // 3))), (answer, took)],
        "twice": [(said, gap), (answer, took), (dice.choice((answer, b"A\r")), took)],
        "late": [(said, gap), (other, timeout), (answer, took), (make_answer("42480000"), took)],
        "unasked": [(answer, gap)],
        "slow": [(said, gap), (answer, timeout - dice.randint(1, 100) * _MS)],
        "misfit": [(said, gap), (dice.choice((b"A\r", make_answer("42"), make_answer("0042480000"))), took)],
        "master": [(said, gap), (other, took // 8), (answer, took)],
        "cut": [(said[:at] + other, gap), (answer, took)],
    }
    if trouble != "damage":
        return turns.get(trouble, [(said, gap), (answer, took)])
    whole = bytearray(said + answer)
    whole[dice.randrange(len(whole))] ^= dice.randint(1, 127)
    return [(bytes(whole[: len(said)]), gap), (bytes(whole[len(said) :])[: dice.randint(1, 40)], took)]
