"""What the rules find in octets that were heard on an N2 bus."""

from __future__ import annotations

from collections.abc import Iterable

from dissectors.findings import Finding, Severity
from dissectors.frame import Chunk
from dissectors.line import MS, LineSettings, Timing
from dissectors.n2 import N2
from dissectors.n2.findings import N2Findings
from sniff.engine.engine import Engine, Output

LINE = LineSettings.parse("9600,8N1")
BEGIN = 10**12


def findings_of(chunks: Iterable[Chunk]) -> tuple[Finding, ...]:
    """All of them."""
    judge, engine = N2Findings(Timing(LINE)), Engine(N2, Timing(LINE))

    def take(output: Output) -> None:
        for row in output.rows:
            judge.see(row.no, row.event, row.header, row.placement)
        for transaction in output.transactions:
            judge.settle(transaction)

    for chunk in chunks:
        take(engine.feed(chunk))
    take(engine.close())
    return judge.findings()


def warned_of(chunks: Iterable[Chunk]) -> set[tuple[str, str]]:
    """Code and subject of what is a warning at least."""
    return {(one.code, one.subject) for one in findings_of(chunks) if one.severity >= Severity.WARNING}


def in_turns(turns: Iterable[Iterable[bytes]], wait: int, pause: int = 12) -> Iterable[Chunk]:
    """Turns `wait` ms apart: a command, and what follows it after `pause` ms."""
    now = BEGIN
    for turn in turns:
        for at, octets in enumerate(turn):
            now += (pause if at else wait) * MS + len(octets) * LINE.char
            yield Chunk(now, octets)
