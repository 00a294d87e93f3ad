"""Columns put together with their neighbours make the same lines."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from sniff.cli.byte_columns import Chosen, Column, digits, joined, width
from sniff.cli.merged_columns import merged

ROWS = 7
texts = st.binary(max_size=5).map(lambda text: text.replace(b"\0", b"x"))
few = st.lists(texts, min_size=1, max_size=4)
chosen = few.flatmap(
    lambda held: st.lists(st.integers(0, len(held) - 1), min_size=ROWS, max_size=ROWS).map(
        lambda codes: Chosen.of(held, np.array(codes, np.int64))
    )
)
numbers = st.lists(st.integers(0, 10**6), min_size=ROWS, max_size=ROWS).map(lambda held: digits(np.array(held)))


@given(st.lists(texts | chosen | numbers, max_size=8))
def test_lines_are_the_same(columns: list[Column]) -> None:
    assert b"".join(joined(merged(columns), 0, ROWS)) == b"".join(joined(columns, 0, ROWS))


def test_neighbours_of_few_texts_become_one_and_of_many_stay() -> None:
    some = Chosen.of([b"a", b"bb"], np.arange(2000) % 2)
    many = Chosen.of([b"%d" % number for number in range(2000)], np.arange(2000))
    assert len(merged([b"<", some, b",", some, b">"])) == 1
    assert len(merged([some, b",", many, b"\n"])) == 3
    assert width(merged([some, b",", some])[0]) == 5
