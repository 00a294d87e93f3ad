"""Stations that stop answering together; whatever the times say, something is told or nothing, and never an error."""

from __future__ import annotations

from dissectors.tracker import Transaction, Verdict
from sniff.analysis.lost_together import LostTogether

S = 1_000_000_000


def asked(no: int, station: int, start: int, end: int, *, answered: bool) -> Transaction:
    verdict = Verdict.ANSWERED if answered else Verdict.NO_RESPONSE
    return Transaction(no, station, "read", 2 * no, 2 * no + 1 if answered else None, verdict, start, end)


def test_a_request_sent_before_the_last_answer_was_over_is_a_loss_by_itself() -> None:
    lost = LostTogether()
    for no in range(6):
        lost.settle(asked(no, 4, no * S, no * S + 10, answered=True))
    for no in range(6, 10):  # their times run backwards, as a damaged file may have them
        lost.settle(asked(no, 4, 2 * S, 2 * S, answered=False))
    assert list(lost.findings(0, 20 * S)) == []
