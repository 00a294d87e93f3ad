"""Tables that somebody looks at before they are taken: the same, none made twice, errors at their place."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice

import pytest

from sniff.bus.tables_ahead import TablesAhead
from sniff.engine.capture_error import CaptureError
from sniff.engine.table import Table


def made(asked: list[int], broken_at: int = 9) -> Iterator[Table]:
    for number in range(4):
        asked.append(number)
        if number == broken_at:
            raise CaptureError("cut here")
        yield Table.of("toy", number, [], [])


def test_what_was_looked_at_is_given_and_made_once() -> None:
    asked: list[int] = []
    ahead = TablesAhead(made(asked))
    assert [one.first for one in islice(ahead.look(), 2) if isinstance(one, Table)] == [0, 1]
    assert asked == [0, 1]
    assert [one.first for one in ahead if isinstance(one, Table)] == [0, 1, 2, 3]
    assert asked == [0, 1, 2, 3]


@pytest.mark.parametrize("looked", [0, 1, 4])
def test_an_error_comes_behind_all_before_it(looked: int) -> None:
    ahead = TablesAhead(made([], broken_at=2))
    if looked == 4:
        with pytest.raises(CaptureError):
            list(ahead.look())
    else:
        list(islice(ahead.look(), looked))
    given = iter(ahead)
    assert [one.first for one in islice(given, 2) if isinstance(one, Table)] == [0, 1]
    with pytest.raises(CaptureError, match="cut here"):
        next(given)
