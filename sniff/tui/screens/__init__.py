"""The screens: one file and one line of this table each.

A screen is a class built on `sniff.tui.screens.base.ViewScreen`. It is imported when it is shown first. Keys follow the
order people know from the documentation, so numbers without a screen stay free.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from textual.screen import Screen


class Entry(NamedTuple):
    """One screen: the key that shows it, its name for people, where its class is ("module:Class")."""

    key: str
    title: str
    target: str

    @property
    def name(self) -> str:
        """Name in code and on the command line."""
        return self.title.lower()


SCREENS: tuple[Entry, ...] = (
    Entry("1", "Frames", "sniff.tui.screens.frames:FramesScreen"),
    Entry("2", "Transactions", "sniff.tui.screens.transactions:TransactionsScreen"),
    Entry("3", "Nodes", "sniff.tui.screens.nodes:NodesScreen"),
    Entry("4", "Points", "sniff.tui.screens.points:PointsScreen"),
    Entry("5", "Findings", "sniff.tui.screens.findings:FindingsScreen"),
    Entry("6", "Timeline", "sniff.tui.screens.timeline:TimelineScreen"),
    Entry("7", "Ring", "sniff.tui.screens.ring:RingScreen"),
    Entry("8", "Polls", "sniff.tui.screens.polls:PollsScreen"),
    Entry("9", "Line", "sniff.tui.screens.line:LineScreen"),
)

STYLED: tuple[str, ...] = ("frames", "nodes", "points", "findings", "timeline", "ring", "polls", "line")
"""Screens that have a style sheet beside them."""


def load(entry: Entry) -> type[Screen[None]]:
    """The class of a screen."""
    module, _, name = entry.target.partition(":")
    found: type[Screen[None]] = getattr(import_module(module), name)
    return found
