"""What is gathered of one station for the rules."""

from __future__ import annotations

from dataclasses import dataclass, field

from dissectors.findings import Tally
from dissectors.tracker import Transaction, Verdict

_LISTENED = frozenset((Verdict.ANSWERED, Verdict.RETRY, Verdict.EXCEPTION, Verdict.DAMAGED_ANSWER, Verdict.LATE))


@dataclass(slots=True)
class Record:
    """Requests to a station and what became of them. `run`, `worst`: repeats in a row, now and at most."""

    requests: int = 0
    answers: int = 0
    unanswered: Tally = field(default_factory=Tally)
    repeated: Tally = field(default_factory=Tally)
    damaged: Tally = field(default_factory=Tally)
    refused: Tally = field(default_factory=Tally)
    twice: Tally = field(default_factory=Tally)
    slow: Tally = field(default_factory=Tally)
    slowest: int = 0
    refusals: set[str] = field(default_factory=set)
    worst: int = 0

    def settle(self, closed: Transaction, slow: int) -> None:
        """Take an exchange with it. `slow`: ns that an answer may take."""
        verdict = closed.verdict
        if verdict is Verdict.ANSWERED_TWICE:
            self.twice.add(closed.start, closed.request, closed.response)
            return
        if closed.request is None:
            return
        self.requests += 1
        self.answers += verdict in _LISTENED
        if closed.attempt > 1:
            self.repeated.add(closed.start, closed.request)
            self.worst = max(self.worst, closed.attempt - 1)
        if verdict is Verdict.NO_RESPONSE:
            self.unanswered.add(closed.start, closed.request)
        elif verdict is Verdict.DAMAGED_ANSWER:
            self.damaged.add(closed.start, closed.request, closed.response)
        elif verdict is Verdict.EXCEPTION:
            self.refused.add(closed.start, closed.request, closed.response)
            self.refusals.add(f"{closed.kind}: {closed.error}")
        if closed.latency is not None and closed.latency.low > slow and verdict is not Verdict.DAMAGED_ANSWER:
            self.slow.add(closed.start, closed.request, closed.response)
            self.slowest = max(self.slowest, closed.latency.low)
