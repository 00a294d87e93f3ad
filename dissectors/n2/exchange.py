"""A command and what became of it, while its answer may still come."""

from __future__ import annotations

from dataclasses import dataclass

from dissectors.frame import Frame
from dissectors.line import NS_PER_S
from dissectors.n2.commands import parse_command
from dissectors.n2.forms import fits, may_answer
from dissectors.tracker import Transaction, Verdict

GIVE_UP = 3 * NS_PER_S
"""Longest time that a master waits for an answer, ns (upper end of the NAE's setting; digimat.n2's default)."""

_LATE_LEAST = NS_PER_S
_TIMES_THE_WAIT = 4


@dataclass(slots=True)
class Exchange:
    """A command and what became of it."""

    id: int
    no: int
    octets: bytes
    station: int | None
    kind: str
    start: int
    end: int
    slack: int
    attempt: int
    of: int | None
    damaged: bool
    spoilt: bool = False  # octets came that may have been an answer
    bad: Transaction | None = None  # how it ends if the damaged answer that came was all
    answer: bytes = b""
    answer_end: int = 0
    gap: int | None = None  # ns from the end of the same command before it, where it is that one again
    echoed: bool = False
    waited: int = GIVE_UP  # ns, until the master went on
    waits: int = 0  # ns that it waits at least: as long as for one whose late answer it took for this one's
    known_answers: int = 0  # of its station when it was closed without one

    @property
    def owed_for(self) -> int:
        """How long after it an answer may still be its late one, ns: some times as long as the master waited."""
        return min(2 * GIVE_UP, max(_LATE_LEAST, _TIMES_THE_WAIT * self.waited))

    @property
    def is_owed(self) -> bool:
        """Whether it is known what was asked, and nothing came that may have been the answer."""
        return not self.damaged and not self.spoilt and self.bad is None

    @property
    def first_try(self) -> int:
        return self.id if self.of is None else self.of


def best_owed(exchanges: list[Exchange], frame: Frame) -> Exchange | None:
    """The command that an answer belongs to: the oldest whose form it surely has, else the oldest it may answer."""
    able = [e for e in exchanges if e.is_owed and may_answer(parse_command(e.octets), frame.octets)]
    sure = [e for e in able if fits(parse_command(e.octets), frame.octets)]
    return next(iter(sure or able), None)


def closed_exchange(exchange: Exchange, verdict: Verdict, error: str | None = None) -> Transaction:
    """Its transaction, closed without a good answer."""
    return Transaction(
        id=exchange.id,
        station=exchange.station,
        kind=exchange.kind,
        request=exchange.no,
        response=None,
        verdict=verdict,
        start=exchange.start,
        end=exchange.end,
        attempt=exchange.attempt,
        of=exchange.of,
        error=error,
    )
