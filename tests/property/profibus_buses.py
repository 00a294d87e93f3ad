"""PROFIBUS lines on which anything may happen: slaves that come up, fall back, are asked again, are late or gone."""

from __future__ import annotations

import random
from dataclasses import dataclass, field

from dissectors.frame import Chunk
from dissectors.line import LineSettings
from dissectors.profibus.telegram import telegram, token
from sniff.engine.session import Adapter, Session

LINE = LineSettings.parse("500000,8E1")
US, MS = 1_000, 1_000_000
MASTERS = {2: (5, 6, 7), 4: (20, 21), 9: ()}

TROUBLES = (
    "unanswered",
    "repeated",
    "late",
    "twice",
    "foreign",
    "damaged",
    "refused",
    "urgent",
    "clear",
    "restart",
    "pause",
    "poll",
    "token again",
    "claim",
    "skipped",
    "diagnosis",
)


@dataclass
class Wire:
    """What is said, with its times."""

    dice: random.Random
    chunks: list[Chunk] = field(default_factory=list)
    now: int = 10**9

    def say(self, octets: bytes, pause: int = 0) -> None:
        """One telegram, after `pause` ns or a usual one."""
        self.now += (pause or self.dice.randint(40, 150) * US) + len(octets) * LINE.char
        self.chunks.append(Chunk(self.now, octets))


def bus(
    seed: int, turns: int = 150, troubles: tuple[str, ...] = TROUBLES, share: float = 0.1
) -> tuple[Session, list[Chunk]]:
    """A session and the reads of it. `turns`: of masters. `share`: of the exchanges in which one of `troubles` is."""
    dice = random.Random(seed)
    wire, counts = Wire(dice), dict.fromkeys(range(128), 0)
    order = list(MASTERS)
    for at in range(turns):
        master, following = order[at % len(order)], order[(at + 1) % len(order)]
        for slave in MASTERS[master]:
            counts[slave] ^= 0x20
            trouble = dice.choice(troubles) if troubles and dice.random() < share else ""
            _exchange(wire, master, slave, 0x5D ^ counts[slave], trouble)
        if dice.random() < share and troubles:
            _ring_trouble(wire, master, following, dice.choice(troubles))
        wire.say(token(following, master))
    latency = dice.choice((0, 0, MS, 16 * MS))
    chunks = [Chunk(-(-one.time // latency) * latency, one.octets) for one in wire.chunks] if latency else wire.chunks
    return Session("x", LINE, "profibus", adapter=Adapter(latency=latency)), chunks


def _exchange(wire: Wire, master: int, slave: int, control: int, trouble: str) -> None:
    dice = wire.dice
    outputs = bytes(4) if trouble == "clear" else dice.choice((b"\x01\x02\x03\x04", dice.randbytes(4)))
    asked = telegram(slave, master, control, outputs)
    answer = (
        b"\xe5" if slave == 21 else telegram(master, slave, 0x0A if trouble == "urgent" else 0x08, dice.randbytes(4))
    )
    if trouble == "restart":
        _restart(wire, master, slave)
        return
    if trouble == "diagnosis":
        asked = telegram(slave, master, control, dsap=60, ssap=62)
        told = bytes((dice.choice((0, 2, 8, 0x10)), 4, 0, dice.choice((master, 255, 3)), 0xF5, 0x10))
        answer = telegram(master, slave, 0x08, told, dsap=62, ssap=60)
    elif trouble == "refused":
        answer = telegram(master, slave, dice.choice((1, 2, 3)))
    elif trouble == "foreign":
        answer = telegram(master, slave + 1, 0x08, b"\x01")
    elif trouble == "damaged":
        at = dice.randrange(len(asked))
        asked = asked[:at] + bytes((asked[at] ^ 1 << dice.randrange(8),)) + asked[at + 1 :]
    wire.say(asked, dice.choice((30, 200, 900)) * MS if trouble == "pause" else 0)
    if trouble in ("unanswered", "repeated"):
        for _ in range(dice.randint(1, 3) if trouble == "repeated" else 0):
            if dice.random() < 0.5:
                wire.say(answer)
            wire.say(asked, 500 * US)
        if trouble == "unanswered" or dice.random() < 0.5:
            return
    wire.say(answer, dice.choice((20, 995, 1100)) * MS if trouble == "late" else 0)
    if trouble == "twice":
        wire.say(dice.choice((answer, telegram(master, slave, 0x08, b"\x09"))))


def _restart(wire: Wire, master: int, slave: int) -> None:
    """A slave that has lost its parameters comes up again, or its master asks in vain."""
    points = {"dsap": 62, "ssap": 60}
    wire.say(telegram(slave, master, 0x5D, b"\x01\x01\x01\x01"))
    wire.say(telegram(master, slave, 0x03))
    wire.say(telegram(slave, master, 0x7D, dsap=60, ssap=62))
    wire.say(telegram(master, slave, 0x08, bytes((0, 5, 0, 255, 0xF5, 0x10)), **points))
    wire.say(telegram(slave, master, 0x5D, bytes((0x88, 2, 5, 11, 0xF5, 0x10, 0)), dsap=61, ssap=62))
    wire.say(b"\xe5")
    if wire.dice.random() < 0.5:
        wire.say(telegram(slave, master, 0x7D, bytes((0x13, 0x23)), dsap=62, ssap=62))
        wire.say(b"\xe5")


def _ring_trouble(wire: Wire, master: int, following: int, trouble: str) -> None:
    dice = wire.dice
    if trouble == "poll":
        for address in range(30, 30 + dice.randint(1, 4)):
            wire.say(telegram(address, master, 0x49))
            if dice.random() < 0.3:
                wire.say(telegram(master, address, dice.choice((0x00, 0x20))))
    elif trouble == "clear":
        wire.say(telegram(127, master, 0x46, bytes((dice.choice((0, 2)), dice.choice((0, 1)))), dsap=58, ssap=62))
        wire.now += dice.choice((0, 6000 * MS))
    elif trouble == "token again":
        wire.say(token(following, master))
    elif trouble == "claim":
        wire.say(token(following, following), dice.choice((50 * US, 20 * MS)))
    elif trouble == "skipped":
        wire.say(token(MASTERS_AFTER[following], master))
    elif trouble == "damaged":
        wire.say(dice.randbytes(dice.randint(1, 6)))
    elif trouble == "foreign":
        wire.say(telegram(5, following, 0x5D, b"\x01"))


MASTERS_AFTER = {2: 4, 4: 9, 9: 2}
