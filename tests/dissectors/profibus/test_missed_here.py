"""What this tap alone misses accuses nobody: answers, telegrams of a master, a token."""

from __future__ import annotations

import pytest

from dissectors.findings import Severity
from dissectors.profibus.telegram import telegram, token
from tests.dissectors.profibus.test_slaves import Telegrams, exchange, exchanges, found, judged

POLL = (1, telegram(9, 1, 0x49))


def unheard(count: int) -> list[tuple[int, bytes]]:
    """Requests for data exchange whose frame count bit changes as after an answer."""
    return [(2, telegram(9, 1, 0x5D | at % 2 << 5, b"\0")) for at in range(count)]


def absent(count: int) -> list[tuple[int, bytes]]:
    """Requests to a station that is not there: the master begins anew each time."""
    return [(2, telegram(9, 1, 0x6D, dsap=60 - at % 2, ssap=62)) for at in range(count)]


@pytest.mark.parametrize("between", [[], exchange(0), [POLL]])
@pytest.mark.parametrize(("asked", "grave"), [(unheard(8), Severity.NOTE), (absent(8), Severity.ERROR)])
def test_a_master_that_counts_on_had_its_answers(
    asked: list[tuple[int, bytes]], grave: Severity, between: list[tuple[int, bytes]]
) -> None:
    told = found(judged([*exchanges(2), *(one for ask in asked for one in (ask, *between)), *exchanges(2)]), "PB001")
    assert told is not None
    assert told.severity is grave
    assert ("did not hear" in told.seen) is (grave is Severity.NOTE)


def test_some_answers_missed_here_are_noted() -> None:
    heard = [one for at in range(40) for one in exchange(at % 2)[: 1 if at % 8 == 3 else 2]]
    told = found(judged(heard), "PB002")
    assert told is not None
    assert (told.count, told.severity) == (5, Severity.NOTE)


def turn(master: int, to: int) -> Telegrams:
    return [*exchange(0, by=master), (1, token(to, master))]


LOST = [*turn(1, 2), *turn(2, 1)] * 2 + [*turn(1, 2)[:-1], *turn(2, 1)]  # the token to 2 is not heard
NEVER = turn(2, 1) * 4  # nothing that 1 sends is heard
TOOL = [*turn(1, 2), (1, telegram(5, 3, 0x6D, dsap=60, ssap=62)), *turn(2, 1)]  # 3 speaks, and 2 goes on with the token

_ASKING = (1, telegram(5, 3, 0x6D, dsap=60, ssap=62))
ALONE = [*turn(1, 1), _ASKING, *[(1, token(1, 1))] * 3]  # 1 is the only master, and passes the token to itself
GONE = [*turn(1, 2), *turn(2, 3)[:-1], _ASKING, (200, token(1, 1)), *[(1, token(1, 1))] * 3]  # 1 claims it anew


@pytest.mark.parametrize(
    ("heard", "is_told"),
    [(LOST, False), (NEVER, False), (TOOL, True), (ALONE, True), (GONE, False)],
)
def test_who_speaks_while_another_one_holds_the_token(heard: Telegrams, is_told: bool) -> None:
    assert (found(judged(list(heard) * 4), "PB015") is not None) is is_told


def test_each_time_that_the_holder_goes_on_counts() -> None:
    told = found(judged([*turn(1, 1), *[*exchange(0, by=1), _ASKING] * 6]), "PB015")
    assert told is not None
    assert told.count == 5  # behind the last one nobody goes on


def test_a_taker_that_is_never_heard_is_one_that_this_tap_does_not_hear() -> None:
    deaf = found(judged([*turn(2, 1), (4, token(1, 2))] * 5), "PB014")
    assert deaf is not None
    assert deaf.severity is Severity.NOTE
    slow = found(judged([*turn(2, 1), (4, token(1, 2)), *turn(1, 2)] * 5), "PB014")
    assert slow is not None
    assert slow.severity is Severity.WARNING
