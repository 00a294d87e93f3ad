"""Everything is computed from the octets in the file, with the settings in the file or those given by -s and -p."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from dissectors import registry
from dissectors.findings import counted
from dissectors.line import MS, NS_PER_S
from dissectors.manifest import Dissector
from dissectors.tracker import Verdict
from dissectors.words import duration, milliseconds, percent
from sniff.analysis.nodes import Node
from sniff.analysis.sanitizing import sanitized
from sniff.analysis.summary import Summary, ranked
from sniff.bus.row_words import iso
from sniff.bus.second_protocol import ForeignFrames
from sniff.cli import arguments, filtering, json_output
from sniff.engine.capture import Capture
from sniff.engine.engine import Output
from sniff.engine.event_texts import settings_change
from sniff.engine.follow_settings import dissector_for
from sniff.engine.session import LINE_NOTE, Adapter, LineEvent, Session

if TYPE_CHECKING:
    from sniff.engine.table import Table

UNDATED = 366 * 86_400 * NS_PER_S
"""ns since 1970: a capture from before has no date, but times since its begin or since midnight."""

Foreign = tuple[Dissector, int] | None
"""A second protocol on the bus, and how many frames of it."""

MOST_LISTED = 10
"""Kinds, errors and the like that are named in a line."""


def configure(parser: argparse.ArgumentParser) -> None:
    """Options of `info`."""
    arguments.add_files(parser)
    arguments.add_line(parser)
    arguments.add_reference(parser)
    filtering.add_filter(parser, "only what matches, and exchanges with a frame that does")
    parser.add_argument("--json", action="store_true", help="one JSON object a file")


def run(args: argparse.Namespace) -> int:
    """Describe every capture in turn."""
    opened = [one for path in args.files for one in arguments.open_buses(path)]
    for number, (path, capture) in enumerate(opened):
        session = arguments.settings_of(args, capture.session, path)
        summary, foreign, events = _summarise(args, capture, session)
        if args.json:
            print(json_output.dumps(_as_json(path, capture, session, summary, foreign)))
            continue
        if number:
            print()
        _print(path, capture, session, summary, foreign, events)
    return 0


def _summarise(
    args: argparse.Namespace, capture: Capture, session: Session
) -> tuple[Summary, Foreign, list[LineEvent]]:
    summary, foreign, happened = Summary(session.line), ForeignFrames(session), _Happened()
    filtering.surveyed(args, capture, session, summary, foreign, happened)
    return summary, foreign.told(), happened.events


class _Happened:
    """The first things that happened to the line."""

    def __init__(self) -> None:
        self.events: list[LineEvent] = []

    def add(self, output: Output) -> None:
        """Nothing of it is kept here."""

    def add_table(self, table: Table) -> None:
        """Nothing of it is kept here."""

    def add_line_event(self, event: LineEvent) -> None:
        """Keep it, unless there are very many."""
        if len(self.events) < 1000:
            self.events.append(event)


def _as_json(path: str, capture: Capture, session: Session, summary: Summary, foreign: Foreign) -> dict[str, Any]:
    complete = capture.completeness()
    first, last = (summary.load.first, summary.load.last) if session.has_times else (None, None)
    return {
        "file": path,
        "complete": complete.whole,
        "completeness": complete.text,
        "kept": _kept(capture, session),
        "first": iso(first) if first is not None else None,
        "last": iso(last) if last is not None else None,
        "seconds": summary.seconds if session.has_times else None,
        "unheard_seconds": summary.load.holes.total / NS_PER_S if session.has_times else None,
        "protocol": None if "protocol" in session.unknown else session.protocol,
        "line": None if "line" in session.unknown or _is_of_network(session) else str(session.line),
        "line_assumed": session.line_is_assumed and not _is_of_network(session),
        "port": session.port,
        "adapter": session.adapter.name,
        "adapter_latency_ms": session.adapter.latency / MS,
        "unknown": list(session.unknown),
        "octets": summary.octets + summary.searched,
        "searched_octets": summary.searched,
        "frames": summary.frames,
        "damaged": summary.damaged,
        "noise_octets": summary.noise,
        "load": summary.load.overall() if session.has_times and not _is_of_network(session) else None,
        "damages": ranked(summary.damages),
        "second_protocol": None if foreign is None else {"protocol": foreign[0].name, "frames": foreign[1]},
        "kinds": ranked(summary.kinds),
        "found": ranked(summary.found),
        "line_errors": ranked(summary.marks),
        "line_events": {kind.value: count for kind, count in summary.events.items()},
        "verdicts": ranked({verdict.value: count for verdict, count in summary.verdicts.items()}),
        "response_ms": _response_times(summary) if session.has_times else None,
        "nodes": [_node_as_json(node) for node in summary.nodes.present()],
        "polled_only": summary.nodes.absent(),
    }


_KEPT = "what is found in it, by this version with these settings"
_KEPT_OF_OTHERS = "what another version, or other settings, found in it: found anew, unless redissect keeps that"


def _kept(capture: Capture, session: Session) -> bool | None:
    """Whether a file that keeps what was found in it keeps what is found now; None for any other."""
    told = getattr(capture, "stored_fit", None)
    return None if told is None else told(session)


def _response_times(summary: Summary) -> dict[str, float | None]:
    times = {
        "min": summary.latency.least,
        "p50": summary.latency.quantile(0.5),
        "p95": summary.latency.quantile(0.95),
        "max": summary.latency.most,
    }
    return {name: None if time is None else time / MS for name, time in times.items()}


def _node_as_json(node: Node) -> dict[str, Any]:
    return {
        "address": node.address,
        "sent": node.sent,
        "received": node.received,
        "damaged": node.damaged,
        "asked": node.asked,
        "verdicts": ranked({verdict.value: count for verdict, count in node.verdicts.items()}),
        "errors": ranked(node.errors),
    }


def _print(
    path: str,
    capture: Capture,
    session: Session,
    summary: Summary,
    foreign: Foreign,
    events: list[LineEvent],
) -> None:
    complete = capture.completeness()
    adapter = session.adapter
    print(sanitized(path))
    _line("file", complete.text if complete.whole else f"CUT: {complete.text}")
    if (fits := _kept(capture, session)) is not None:
        _line("kept", _KEPT if fits else _KEPT_OF_OTHERS)
    if summary.load.first is None or summary.load.last is None:
        _line("content", "no octets" if not summary.searched else "only what was heard while searching for settings")
    else:
        missed = summary.load.holes.total
        unheard = f", {duration(missed)} of it not heard" if missed else ""
        if not session.has_times:
            _line("times", "none: the file does not say when anything came")
        elif session.started < UNDATED:
            _line("times", f"{_span(summary.seconds)}{unheard}; the file has no date")
        else:
            _line("from", iso(summary.load.first))
            _line("to", f"{iso(summary.load.last)} ({_span(summary.seconds)}{unheard})")
    _line("protocol", _settings(session))
    if summary.searched or session.unknown:
        _line("search", _search(session, summary, events))
    _line("port", session.port or "unknown")
    _line("adapter", adapter.name + (f"; {adapter.delay_words}" if session.has_times else ""))
    reports = "unknown" if adapter.reports is None else ", ".join(adapter.reports) or "none (zero errors mean nothing)"
    _line("reports", f"line errors: {reports}{'; ' + adapter.detail if adapter.detail else ''}")
    searched = f"{summary.searched} of them while searching, " if summary.searched else ""
    octets = summary.octets + summary.searched
    has_load = session.has_times and not _is_of_network(session)
    load = f"; bus load {percent(summary.load.overall())}" if has_load else ""
    _line("octets", f"{octets}, {searched}{summary.noise} of them noise{load}")
    if foreign is not None:
        many = counted(foreign[1], "frame")
        _line("foreign", f"{many} of {foreign[0].title} among what is none of {dissector_for(session).title}")
    _print_traffic(summary, adapter)
    _print_nodes(summary)
    for event in events[:20]:
        count = str(event.number) if event.number > 0 else ""  # -1: nobody knows
        _line("event", f"{iso(event.moment)} {event.kind.value} {event.text} {count}".rstrip())
    if len(events) > 20:
        _line("event", f"and {sum(summary.events.values()) - 20} more")
    sys.stdout.flush()


def _print_traffic(summary: Summary, adapter: Adapter) -> None:
    _line("frames", f"{summary.frames}, {summary.damaged} damaged{_counts(summary.damages)}")
    _line("found by", _listed(summary.found))
    _line("kinds", _listed(summary.kinds))
    if summary.marks:
        _line("line errors", _listed(summary.marks))
    verdicts = {verdict.words: count for verdict, count in summary.verdicts.items()}
    _line("transactions", _listed(verdicts))
    if summary.latency.count:
        quantiles = (
            ("p50", summary.latency.quantile(0.5)),
            ("p95", summary.latency.quantile(0.95)),
            ("max", summary.latency.most),
        )
        shown = ", ".join(f"{name} {milliseconds(value)}" for name, value in quantiles if value is not None)
        bound = f" (each known to ±{milliseconds(adapter.latency)})" if adapter.latency else ""
        _line("response", shown + bound)


def _print_nodes(summary: Summary) -> None:
    for node in summary.nodes.present():
        verdicts = {verdict.words: count for verdict, count in node.verdicts.items()}
        _line(
            f"node {node.address}",
            f"{counted(node.sent, 'frame')} from, {node.received} to; "
            f"{_listed(verdicts) if verdicts else 'nothing asked of it'}",
        )
        if node.errors:
            _line("", _listed(node.errors, " × ", "; "))  # their words have numbers and commas in them
    polled, all_of_them = summary.nodes.absent(), _broadcasts(summary)
    if polled:
        _line("polled only", f"{spans(polled)}: never heard, never asked anything")
    if all_of_them:
        _line("broadcasts", ", ".join(f"{node.received} to {node.address}" for node in all_of_them))


def _broadcasts(summary: Summary) -> list[Node]:
    """Addresses at which nobody in particular is spoken to."""
    return [node for node in summary.nodes if not node.seen and node.verdicts[Verdict.BROADCAST]]


def _settings(session: Session) -> str:
    title = "unknown" if "protocol" in session.unknown else dissector_for(session).title
    if "line" in session.unknown:
        return f"{title}, line settings unknown"
    if _is_of_network(session):
        return f"{title}, {session.line_words}"
    told = "assumed" if session.line_is_assumed else sanitized(session.notes.get(LINE_NOTE, ""))
    return f"{title}, {session.line}{f' ({told})' if told else ''}"


def _is_of_network(session: Session) -> bool:
    """Whether its frames are packets, which take no time on a line."""
    return session.protocol in registry.RELATIVES


def _search(session: Session, summary: Summary, events: list[LineEvent]) -> str:
    """How the search for settings went while this was recorded."""
    tried = dict.fromkeys(
        str(change.line) for event in events if (change := settings_change(event)) is not None and change.line
    )
    heard = f"{summary.searched} octets heard meanwhile say nothing about the bus; listened with {', '.join(tried)}"
    if not session.unknown:
        return heard
    return f"no settings found; {heard}; once they are known, read it with {' and '.join(arguments.options(session))}"


def _line(name: str, text: str) -> None:
    print(f"  {name:<13}{sanitized(text)}")


def _span(seconds: float) -> str:
    if seconds < 120:
        return f"{seconds:.3f} s"
    hours, rest = divmod(int(seconds), 3600)
    return f"{f'{hours} h ' if hours else ''}{rest // 60} min {rest % 60} s"


def _listed(counts: Mapping[str, int], times: str = " ", between: str = ", ") -> str:
    """The commonest, and how many more there are."""
    shown = [f"{count}{times}{name}" for name, count in ranked(counts).items()]
    more = len(shown) - MOST_LISTED
    if more > 1:
        shown[MOST_LISTED:] = [f"… and {more} more"]
    return between.join(shown) or "none"


def _counts(counts: Mapping[str, int]) -> str:
    return f" ({_listed(counts)})" if counts else ""


def spans(numbers: list[int]) -> str:
    """Ascending numbers with runs drawn together: "0–10, 13, 15–26"."""
    parts: list[list[int]] = []
    for number in numbers:
        if parts and parts[-1][-1] == number - 1:
            parts[-1][1:] = [number]
        else:
            parts.append([number])
    return ", ".join("–".join(map(str, part)) for part in parts)
