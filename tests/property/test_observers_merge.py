"""Counts of two parts of a capture, put together, are the counts of the whole, wherever it is cut."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sniff.analysis.summary import Summary
from sniff.bus.offline import outputs
from sniff.engine.engine import Output
from sniff.engine.observer import observe
from sniff.engine.session import LineEvent
from sniff.formats import read

CAPTURES = Path(__file__).parents[2] / "captures"
NAMES = ("rtu-usual-faults", "ascii-usual-faults", "n2-usual-faults", "mstp-usual-faults", "rtu-noisy-ftdi")

Items = tuple[Output | LineEvent, ...]


@cache
def _items(name: str) -> tuple[Summary, Items]:
    """Nothing counted yet, and all that a capture gives, row by row."""
    capture = read(CAPTURES / f"{name}.cap.txt")
    items: list[Output | LineEvent] = []
    for item in outputs(capture.items(), capture.session):
        if isinstance(item, LineEvent):
            items.append(item)
            continue
        items += [Output((row,)) for row in item.rows]
        items += [Output((), (transaction,)) for transaction in item.transactions]
    return Summary(capture.session.line), tuple(items)


def _counted(name: str, items: Items) -> Summary:
    counts = Summary(_items(name)[0].line)
    observe(items, counts)
    return counts


@pytest.mark.parametrize("name", [name for name in NAMES if (CAPTURES / f"{name}.cap.txt").exists()])
@settings(max_examples=25, deadline=None)
@given(st.data())
def test_counts_merge_wherever_a_capture_is_cut(name: str, data: st.DataObject) -> None:
    items = _items(name)[1]
    cuts = sorted(data.draw(st.lists(st.integers(0, len(items)), max_size=3)))
    whole = _counted(name, items)
    merged = _counted(name, ())
    for begin, end in zip([0, *cuts], [*cuts, len(items)], strict=True):
        merged = merged.merge(_counted(name, items[begin:end]))
    assert merged == whole
