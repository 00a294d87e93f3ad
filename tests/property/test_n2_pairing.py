"""N2 exchanges paired by columns held against the tracker: buses with every kind of answer, at any cut of blocks."""

from __future__ import annotations

import random
from collections.abc import Sequence

import pytest

from dissectors.frame import Chunk
from dissectors.line import LineSettings
from dissectors.n2.envelope import make_answer, make_command
from dissectors.tracker import Transaction
from sniff.bus.offline import outputs
from sniff.engine.blocks import blocks_of
from sniff.engine.bulk import tables
from sniff.engine.engine import Output, Row
from sniff.engine.session import Adapter, Session
from sniff.engine.table import Table
from tests.seeds import seeds

MS = 1_000_000
LINE = LineSettings.parse("9600,8N1")


def bus(dice: random.Random, exchanges: int, trouble: float) -> list[Chunk]:
    """Commands to eight stations of different speed; some answers are early, late, missing, double, odd or damaged."""
    now, chunks = 10**9, []
    usual = [dice.randint(4, 40) for _ in range(9)]

    def say(octets: bytes, pause: float) -> None:
        nonlocal now
        now += int(pause * MS) + len(octets) * LINE.char
        chunks.append(Chunk(now, octets))

    for _ in range(exchanges):
        station = dice.randint(1, 8)
        command, answer = dice.choice(
            [
                ("04", ""),
                ("04", "0103"),
                ("1101" + "03", "42280000"),
                ("F", "10"),
                ("72" + "03" + "01" + "42280000", ""),
            ]
        )
        asked, answered = make_command(f"{station:02X}{command}"), make_answer(answer)
        say(asked, dice.uniform(2, 30))
        pause, kind = usual[station] * dice.uniform(0.9, 1.3), dice.random()
        if kind > trouble:
            say(answered, pause)
            continue
        match dice.randrange(10):
            case 0:
                say(answered, pause / 4)
            case 1:
                say(answered, dice.choice((2990, 3010, 6500)))
            case 2:
                now += 250 * MS
            case 3:
                now += 250 * MS
                say(asked, 0)
                say(answered, pause)
            case 4:
                say(answered, pause)
                say(answered, dice.choice((0.5, 20, 900)))
            case 5:
                say(make_answer("12345"), pause)
            case 6:
                say(answered[:-2] + b"\r", pause)
            case 7:
                say(b"N%s\r" % dice.choice((b"01", b"11")), pause)
            case 8:
                say(asked, 0.3)
                say(answered, pause)
            case _:
                say(dice.randbytes(dice.randint(1, 6)), pause)
    return chunks


def by_rows(chunks: Sequence[Chunk], session: Session) -> tuple[list[Row], list[Transaction]]:
    given = [output for output in outputs(chunks, session) if isinstance(output, Output)]
    return [row for output in given for row in output.rows], [one for output in given for one in output.transactions]


@pytest.mark.parametrize("trouble", [0.0, 0.02, 0.3])
@pytest.mark.parametrize("seed", seeds(4, 2))
def test_exchanges_are_paired_as_the_tracker_pairs_them(seed: int, trouble: float) -> None:
    dice = random.Random(seed)
    session = Session("x", LINE, "n2", adapter=Adapter(latency=dice.choice((0, MS, 17 * MS))))
    chunks = bus(dice, 1500, trouble)
    cuts = sorted(dice.sample(range(1, len(chunks)), 3))
    parts = [chunks[first:beyond] for first, beyond in zip([0, *cuts], [*cuts, None], strict=True)]
    rows: list[Row] = []
    closed: list[Transaction] = []
    for table in tables((block for part in parts for block in blocks_of(part)), session):
        assert isinstance(table, Table)
        rows += table.rows()
        closed += [table.transaction(place) for place in range(len(table.transactions))]
    assert (rows, closed) == by_rows(chunks, session)
