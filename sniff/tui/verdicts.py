"""Verdicts in words that fit a narrow column, and how alarming each is. Data."""

from __future__ import annotations

from dissectors.tracker import Interval, Transaction, Verdict
from dissectors.words import bare_milliseconds
from sniff.bus.trouble import is_trouble
from sniff.tui import times
from sniff.tui.columns import Cell

SHORT: dict[Verdict, str] = {
    Verdict.ANSWERED_TWICE: "twice",
    Verdict.DAMAGED_ANSWER: "bad answ.",
    Verdict.DAMAGED_REQUEST: "bad requ.",
    Verdict.UNDECIDED: "undecided",
}
"""At most 9 characters; the other verdicts fit as they are."""

STYLE: dict[Verdict, str] = {
    Verdict.OPEN: "dim",
    Verdict.ANSWERED: "good",
    Verdict.RETRY: "doubt",
    Verdict.EXCEPTION: "doubt",
    Verdict.NO_RESPONSE: "bad",
    Verdict.LATE: "bad",
    Verdict.ECHO: "doubt",
    Verdict.UNSOLICITED: "bad",
    Verdict.ANSWERED_TWICE: "bad",
    Verdict.DAMAGED_ANSWER: "bad",
    Verdict.DAMAGED_REQUEST: "bad",
    Verdict.BROADCAST: "dim",
    Verdict.DATA: "dim",
    Verdict.UNDECIDED: "dim",
}
"""Component style of the lists."""


def verdict_cell(transaction: Transaction | None, width: int, attempts: bool = True) -> Cell:
    """The verdict in a column of that width; nothing while the transaction is open; "×2" marks a repeated request."""
    if transaction is None:
        return Cell("")
    verdict = transaction.verdict
    text = verdict.words if width >= len(verdict.words) else SHORT.get(verdict, verdict.words)
    if attempts and transaction.attempt > 1 and width >= len(text) + 3:
        text += f" ×{transaction.attempt}"
    style = STYLE.get(verdict, "")
    return Cell(text, "dim" if style == "bad" and not is_trouble(transaction) else style)


def latency_cell(latency: Interval | None, held: int) -> Cell:
    """Milliseconds without the unit and the doubt, both are in the title; "?" where the doubt is larger than there."""
    if latency is None:
        return Cell("")
    more = max(latency.nominal - latency.low, latency.high - latency.nominal) > held
    return Cell(times.latency(latency.nominal) + ("?" if more else ""))


def latency_title(held: int, roomy: bool = False) -> str:
    """Title of that column; `held`: how long the adapter may hold octets back, ns: the most that a time is wrong."""
    title = "latency ms" if roomy or not held else "ms"
    return f"{title} ±{bare_milliseconds(held).removesuffix('.0')}" if held else title
