"""The summary of a capture, counted: frames, noise, checks, verdicts, stations, load; mergeable. Pure."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from dissectors.frame import Frame, LineError
from dissectors.histogram import Histogram
from dissectors.line import LineSettings
from dissectors.tracker import Transaction, Verdict
from sniff.analysis.load import KEPT_SECONDS, Load
from sniff.analysis.nodes import NodeTable
from sniff.analysis.wording import mark_names
from sniff.engine.engine import Output, Row
from sniff.engine.session import LineEvent, LineEventKind

if TYPE_CHECKING:
    from dissectors.columns import TransactionColumns
    from sniff.engine.table import Table


def ranked(counts: Mapping[str, int]) -> dict[str, int]:
    """Counts by name, the largest first, equal ones by name."""
    return dict(sorted(((name, count) for name, count in counts.items() if count), key=lambda one: (-one[1], one[0])))


@dataclass(slots=True)
class Summary:
    """Counts over a whole capture or a stretch of one. Durations are ns, but for `kept_seconds`."""

    line: LineSettings
    frames: int = 0
    damaged: int = 0
    noise: int = 0  # octets
    octets: int = 0  # without those that were only heard
    searched: int = 0  # octets heard while the settings were searched for
    kinds: Counter[str] = field(default_factory=Counter)
    damages: Counter[str] = field(default_factory=Counter)
    found: Counter[str] = field(default_factory=Counter)
    marks: Counter[str] = field(default_factory=Counter)
    verdicts: Counter[Verdict] = field(default_factory=Counter)
    events: Counter[LineEventKind] = field(default_factory=Counter)
    latency: Histogram = field(default_factory=Histogram)
    nodes: NodeTable = field(default_factory=NodeTable)
    load: Load = field(init=False)
    kept_seconds: int = KEPT_SECONDS  # of the load, one by one

    def __post_init__(self) -> None:
        self.load = Load(self.line, kept=self.kept_seconds)

    def merge(self, other: Summary) -> Summary:
        """Both together, as a new value."""
        whole = Summary(
            self.line,
            self.frames + other.frames,
            self.damaged + other.damaged,
            self.noise + other.noise,
            self.octets + other.octets,
            self.searched + other.searched,
            self.kinds + other.kinds,
            self.damages + other.damages,
            self.found + other.found,
            self.marks + other.marks,
            self.verdicts + other.verdicts,
            self.events + other.events,
            self.latency.merge(other.latency),
            self.nodes.merge(other.nodes),
            self.kept_seconds,
        )
        whole.load = self.load.merge(other.load)
        return whole

    def use(self, line: LineSettings) -> None:
        """Count with other line settings from here on: the right ones were found."""
        self.line = self.load.line = line

    def add(self, output: Output) -> None:
        """Count what the engine gave."""
        for row in output.rows:
            self._add_row(row)
        for transaction in output.transactions:
            self._add_transaction(transaction)

    def add_table(self, table: Table) -> None:
        """Count rows and transactions; the same as one after the other."""
        self._add_rows(table)
        self._add_transactions(table.transactions)

    def _add_rows(self, table: Table) -> None:
        import numpy as np

        from dissectors.columns import CHECKS, DAMAGES, FOUNDS, counted

        frames, heard = table.frames, table.heard
        octets, is_frame = frames.length, table.is_frame & heard
        self.searched += int(octets[~heard].sum())
        self.octets += int(octets[heard].sum())
        self.noise += int(octets[heard & ~table.is_frame].sum())
        self.frames += int(is_frame.sum())
        self.load.add_table(table)
        self.nodes.add_table(table)
        for row in table.odd.values():
            if row.searched is None:
                self.add_marks(row)
        bad = is_frame & ~table.good
        self.damaged += int(bad.sum())
        for code, count in enumerate(np.bincount(frames.found[is_frame]).tolist()):
            self.found[FOUNDS[code].value] += count
        for code, count in enumerate(np.bincount(frames.kind[is_frame]).tolist()):
            self.kinds[frames.names[code]] += count
        for (damage, check), count in counted(frames.damage[bad], frames.check[bad]):
            said = DAMAGES[damage]
            self.damages[said.value if said is not None else CHECKS[check].value] += count
        for counter in (self.found, self.kinds):
            for name in [name for name, count in counter.items() if not count]:
                del counter[name]

    def _add_transactions(self, closed: TransactionColumns) -> None:
        import numpy as np

        from dissectors.columns import NONE, VERDICTS

        for code, count in enumerate(np.bincount(closed.verdict).tolist()):
            if count:
                self.verdicts[VERDICTS[code]] += count
        timed = (closed.latency != NONE) & (closed.verdict != VERDICTS.index(Verdict.DATA))
        self.latency.add_many(closed.latency[timed])

    def add_line_event(self, event: LineEvent) -> None:
        """Count something that happened to the line."""
        self.events[event.kind] += 1
        self.load.add_line_event(event)

    def _add_row(self, row: Row) -> None:
        event = row.event
        if row.searched is not None:
            self.searched += len(event.octets)
            return
        self.octets += len(event.octets)
        self.load.add(row)
        self.nodes.add_row(row)
        self.add_marks(row)
        if not isinstance(event, Frame):
            self.noise += len(event.octets)
            return
        self.frames += 1
        self.found[event.found.value] += 1
        if row.header is not None:
            self.kinds[row.header.kind] += 1
        if not event.ok:
            self.damaged += 1
            self.damages[event.damage.value if event.damage is not None else event.check.value] += 1

    def add_marks(self, row: Row) -> None:
        """Count the line errors of one row."""
        for mark in row.event.marks:
            self.marks[mark_names(mark.error & ~LineError.OVERRUN) or "overrun"] += 1

    def _add_transaction(self, transaction: Transaction) -> None:
        self.verdicts[transaction.verdict] += 1
        self.nodes.add_transaction(transaction)
        if transaction.latency is not None and transaction.verdict is not Verdict.DATA:  # the use of a token is none
            self.latency.add(transaction.latency.nominal)

    @property
    def seconds(self) -> float:
        """From the first octet to the last."""
        if self.load.first is None or self.load.last is None:
            return 0.0
        return (self.load.last - self.load.first) / 1e9
