"""The topics that a live bus sends back into its recording beside frames: /bus, /nodes and /findings. Pure.

One message a second for the bus and for each station heard in it, flat JSON as in `sniff.recording.topics`; one
message in the schema foxglove.Log for each finding when it is raised, and again when it gets graver.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator

from dissectors.findings import Finding, Severity
from dissectors.histogram import Histogram
from dissectors.line import MS, NS_PER_S
from dissectors.token_ring import RingWindow
from dissectors.tracker import Verdict
from sniff.analysis.health import bus_health, station_health
from sniff.analysis.nodes import Node
from sniff.analysis.summary import Summary
from sniff.bus.model import BusModel
from sniff.engine.engine import Output
from sniff.engine.table import Table
from sniff.recording.derived_message import DerivedMessage
from sniff.recording.topics import topic_part

WINDOW = NS_PER_S
JUDGED_EVERY = 5
"""Windows between two looks at the findings."""
NODES_A_SECOND, NODES_AT_ONCE = 0.5, 600
"""Messages of stations: in the long run, and at once."""

BUS, NODE, LOG = "sniff485.Bus", "sniff485.Node", "foxglove.Log"
"""Schema records, of `sniff.recording.topics`."""

_LEVELS = {Severity.INFO: 2, Severity.NOTE: 2, Severity.WARNING: 3, Severity.ERROR: 4}
_TROUBLE = (
    Verdict.NO_RESPONSE,
    Verdict.LATE,
    Verdict.DAMAGED_ANSWER,
    Verdict.DAMAGED_REQUEST,
    Verdict.ANSWERED_TWICE,
    Verdict.EXCEPTION,
)


class BusChannels:
    """Messages of one bus, of what its model knows; `due` gives what is to be written by then."""

    def __init__(
        self,
        model: BusModel,
        judged_every: int = JUDGED_EVERY,
        ring_window: Callable[[], RingWindow | None] | None = None,
    ) -> None:
        """`judged_every`: windows between two looks at the findings; 0: only when asked. `ring_window`: gives what
        changed in the ring since it was called the last time; else the model does.
        """
        self._model = model
        self._judged_every = judged_every
        self._session = session = model.session
        self._bus = topic_part(session.bus) or "bus"
        self._ring_window = model.ring_window if ring_window is None else ring_window
        self._ring_window()
        self._window = Summary(session.line)
        self._has_part = False  # whether anything is counted in it
        self._begin: int | None = None
        self._windows = 0
        self._said: dict[tuple[str, str], Severity] = {}

    def add(self, output: Output) -> None:
        """Take what the engine gave, and the model took."""
        self._has_part = True
        self._window.add(output)

    def add_table(self, table: Table) -> None:
        """The same with many rows at once."""
        self._has_part = True
        self._window.add_table(table)

    def add_summary(self, part: Summary) -> None:
        """The same counted by somebody else, of one window or a piece of it."""
        self._window = self._window.merge(part) if self._has_part else part
        self._has_part = True

    def is_due(self, now: int) -> bool:
        """Whether a window has ended by `now`: what was heard until then should be counted in it."""
        return self._begin is not None and now - self._begin >= WINDOW

    def due(self, now: int, has_turn: Callable[[str, int], bool] = lambda *_: True) -> list[DerivedMessage]:
        """What a window that has ended by `now` (ns, the capture's clock) gives; nothing in between.

        `has_turn`: whether the numbers of a station, by their topic, are to be told at that time.
        """
        if self._begin is None:
            self._begin = now
        if not self.is_due(now):
            return []
        begin, window = self._begin, self._window
        self._begin, self._window, self._has_part = now, Summary(self._session.line), False
        self._windows += 1
        messages = [*self._of_window(begin, now, window, has_turn)]
        if self._judged_every and self._windows % self._judged_every == 0:
            messages += self.findings(now)
        return messages

    def findings(self, now: int | None = None) -> list[DerivedMessage]:
        """Findings that are new, or graver than they were said to be. `now`: ns; else when each was last seen."""
        messages = []
        for finding in self._model.findings():
            key = finding.code, finding.subject
            before = self._said.get(key)
            if before is None or finding.severity > before:
                self._said[key] = finding.severity
                messages.append(_log(finding, self._bus, finding.last if now is None else now))
        return messages

    def _of_window(
        self, begin: int, end: int, window: Summary, has_turn: Callable[[str, int], bool]
    ) -> Iterator[DerivedMessage]:
        span = max(1, end - begin)
        errors = window.damaged + sum(window.verdicts[verdict] for verdict in _TROUBLE)
        content: dict[str, object] = {
            "load": min(1.0, window.load.total.busy / span),
            "frames": window.frames,
            "octets": window.octets,
            "errors": errors,
            "error_rate": min(1.0, errors / max(1, window.frames)),  # an answer may be missed when nothing comes
            "health": bus_health(window).score,
            **_latency(window.latency),
        }
        ring = self._ring_window()
        whole = {} if ring is None else ring.bus
        yield DerivedMessage(f"/bus/{self._bus}", BUS, end, begin, _json(content | dict(whole)))
        for node in window.nodes.present():
            topic = f"/nodes/{self._bus}/{node.address}"
            if has_turn(topic, end):
                told = _of_node(node) | dict({} if ring is None else ring.of(node.address))
                yield DerivedMessage(topic, NODE, end, begin, _json(told))


def _of_node(node: Node) -> dict[str, object]:
    errors = sum(node.verdicts[verdict] for verdict in _TROUBLE)
    health = station_health(node)
    return {
        "requests": node.asked,
        "responses": node.sent,
        "errors": errors,
        "error_rate": min(1.0, errors / max(1, node.asked)),
        **({} if health is None else {"health": health.score}),
        **_latency(node.latency),
    }


def _latency(latency: Histogram) -> dict[str, object]:
    """Response times in ms; absent where there were none, since the schema has no null."""
    named = (
        ("latency_p50_ms", latency.quantile(0.5)),
        ("latency_p95_ms", latency.quantile(0.95)),
        ("latency_max_ms", latency.most),
    )
    return {name: value / MS for name, value in named if value is not None}


def _log(finding: Finding, bus: str, now: int) -> DerivedMessage:
    seconds, rest = divmod(finding.last, NS_PER_S)
    parts = (finding.seen, f"means: {finding.means}" if finding.means else "", f"next: {finding.next}")
    content = {
        "timestamp": {"sec": seconds, "nsec": rest},
        "level": _LEVELS[finding.severity],
        "message": f"{finding.subject}: {'; '.join(part for part in parts if part)}",
        "name": finding.code,
        "file": bus,
        "line": finding.evidence[0] if finding.evidence else 0,
    }
    return DerivedMessage("/findings", LOG, now, finding.first, _json(content))


def _json(content: dict[str, object]) -> bytes:
    return json.dumps(content, ensure_ascii=False).encode()
