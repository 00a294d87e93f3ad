"""What observers say of two parts of a capture, put together, is what they say of the whole, wherever it is cut."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, lru_cache
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sniff.analysis.summary import Summary
from sniff.bus.offline import outputs
from sniff.engine.engine import Output
from sniff.engine.observer import observe
from sniff.engine.session import LineEvent, Session
from sniff.formats import read
from sniff.reporting.happenings import Happenings
from sniff.reporting.timeline import Timeline

CAPTURES = Path(__file__).parents[2] / "captures"
NAMES = ("rtu-usual-faults", "ascii-usual-faults", "n2-usual-faults", "mstp-usual-faults", "rtu-noisy-ftdi")

Items = tuple[Output | LineEvent, ...]


@cache
def _items(name: str) -> tuple[Session, Items]:
    """All that a capture gives, row by row."""
    capture = read(CAPTURES / f"{name}.cap.txt")
    items: list[Output | LineEvent] = []
    for item in outputs(capture.items(), capture.session):
        if isinstance(item, LineEvent):
            items.append(item)
            continue
        items += [Output((row,)) for row in item.rows]
        items += [Output((), (transaction,)) for transaction in item.transactions]
    return capture.session, tuple(items)


@dataclass(frozen=True, slots=True)
class Kind:
    """One kind of observer: `made` for a capture, its value as `told`."""

    made: Callable[[Session], Any]
    told: Callable[[Any], object] = lambda observer: observer


KINDS = {
    "counts": Kind(lambda session: Summary(session.line)),
    "load": Kind(lambda session: Summary(session.line), lambda summary: (summary.load.share(), summary.load.total)),
    "nodes": Kind(lambda session: Summary(session.line), lambda summary: list(summary.nodes.present())),
    "timeline": Kind(lambda session: Timeline(session.line.char)),
    "report": Kind(Happenings, lambda told: (told.happenings, told.left_out, told.trouble)),
}


def _seen(kind: Kind, session: Session, items: Items) -> Any:
    observer = kind.made(session)
    observe(items, observer)
    return observer


@lru_cache(1)  # all examples are of the same
def _told_of_whole(of: str, name: str) -> object:
    return KINDS[of].told(_seen(KINDS[of], *_items(name)))


@pytest.mark.parametrize("of", KINDS)
@pytest.mark.parametrize("name", [name for name in NAMES if (CAPTURES / f"{name}.cap.txt").exists()])
@settings(max_examples=10, deadline=None)
@given(st.data())
def test_parts_merge_wherever_a_capture_is_cut(of: str, name: str, data: st.DataObject) -> None:
    kind, (session, items) = KINDS[of], _items(name)
    cuts = sorted(data.draw(st.lists(st.integers(0, len(items)), max_size=3)))
    merged = _seen(kind, session, ())
    for begin, end in zip([0, *cuts], [*cuts, len(items)], strict=True):
        merged = merged.merge(_seen(kind, session, items[begin:end]))
    assert kind.told(merged) == _told_of_whole(of, name)
