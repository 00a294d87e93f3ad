"""Views by name: which columns the lists have, in which order, and how time counts. Pure but for the names."""

from __future__ import annotations

from collections.abc import Sequence

from sniff.config import ConfigError, View, nearest
from sniff.tui.columns import Column
from sniff.tui.frame_list import COLUMNS as FRAMES
from sniff.tui.times import TimeMode
from sniff.tui.transaction_list import COLUMNS as TRANSACTIONS
from sniff.tui.view_state import Viewing

LISTS: dict[str, tuple[Column, ...]] = {"frames": FRAMES, "transactions": TRANSACTIONS}


def wrong_columns(which: str, words: Sequence[str]) -> str:
    """What is wrong with a choice of columns of a list; "" for nothing."""
    known = tuple(column.name for column in LISTS[which])
    for word in words:
        if word not in known:
            return f"no column {word!r}{nearest(word, known)}"
    if len(set(words)) < len(words):
        return "each column once"
    return ""


def use(viewing: Viewing, name: str, view: View) -> None:
    """Look so. Raises ConfigError for columns that there are not, FilterError for a filter that cannot be."""
    for which, words in view.columns.items():
        wrong = wrong_columns(which, words)
        if wrong:
            raise ConfigError(f"[view.{name}] {which}: {wrong}")
    viewing.set_filter(view.filter)
    viewing.columns = dict(view.columns)
    viewing.time_mode = TimeMode(view.time) if view.time else viewing.time_mode


def view_of(viewing: Viewing) -> View:
    """How one looks now."""
    return View(dict(viewing.columns), viewing.time_mode.value, viewing.filter)
