"""Tables: nodes (each station), health (bus and stations, and why), transactions (by kind and verdict), latency (each
station's response times), load (by second, or longer), ring (of a protocol that passes a token), stations (that it
serves: lost, syncs, repeats, illegal), polls (the master's programme: each request, how often
it is asked, what became of it, and when that changed). Response times are uncertain by what the adapter may hold
back: see `info`. Of a PORT or a configured bus: the table as it becomes, until Ctrl-C or --duration, then as it is;
nothing is recorded.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from dissectors import registry
from dissectors.histogram import Histogram
from dissectors.line import MS, NS_PER_S
from dissectors.tracker import Verdict
from sniff.analysis.load import Load, Second
from sniff.analysis.nodes import Node
from sniff.analysis.summary import Summary
from sniff.analysis.wording import station_word
from sniff.bus.offline import survey
from sniff.bus.row_words import iso
from sniff.cli import USAGE, Failure, arguments, filtering, tables, watching
from sniff.cli.incomplete import say_incomplete
from sniff.cli.interruption import until_interrupted
from sniff.cli.progress import Watched
from sniff.cli.tables import Cell
from sniff.editing.merging import Merged, merged_session
from sniff.engine.engine import Output
from sniff.engine.follow_settings import dissector_for
from sniff.engine.session import LineEvent, Session

if TYPE_CHECKING:
    from sniff.bus.model import BusModel
    from sniff.engine.capture import Capture
    from sniff.engine.table import Table

MOST_ROWS = 100
ROW_LENGTHS = (1, 5, 10, 30, 60, 300, 600, 1800, 3600, 21_600, 86_400)
"""Seconds that a row of load may stand for, where nobody says for how many."""
TABLES = ("nodes", "health", "transactions", "latency", "load", "ring", "stations", "polls")


def configure(parser: argparse.ArgumentParser) -> None:
    """Options of `stats`."""
    parser.add_argument(
        "words", nargs="+", metavar="FILE", help="captures of one bus; parts of a rotation together; or a port"
    )
    arguments.add_bus(parser)
    parser.add_argument("--table", choices=TABLES, help="which table; may also stand beside the files (default: nodes)")
    arguments.add_line(parser)
    arguments.add_devices(parser)
    parser.add_argument(
        "--every",
        type=arguments.duration,
        metavar="TIME",
        help=f"load: length of a row (default: such that there are {MOST_ROWS} at most; with --json and --csv 1s)",
    )
    style = parser.add_mutually_exclusive_group()
    style.add_argument("--json", action="store_const", const="json", dest="style", help="one JSON object a row")
    style.add_argument("--csv", action="store_const", const="csv", dest="style", help="comma-separated values")
    arguments.add_reference(parser)
    filtering.add_filter(parser, "only what matches, and exchanges with a frame that does")
    watching.add_duration(parser)
    parser.set_defaults(style="text")


def run(args: argparse.Namespace) -> int:
    """Print one table."""
    table, files = args.table or "nodes", args.words
    if len(files) > 1 and files[-1] in TABLES:
        table, files = files[-1], files[:-1]
    elif len(files) > 1 and files[0] in TABLES and not Path(files[0]).exists():
        table, files = files[0], files[1:]
    if args.every is not None and table != "load":
        raise Failure(f"--every is the length of a row of load, and {table} has none", USAGE)
    if args.every is not None and args.every % 1:
        raise Failure(f"--every {args.every:g} s: load is counted by whole seconds; expected 1s or a multiple", USAGE)
    port = watching.port_of(files)
    if port is not None:
        with until_interrupted():  # from before it begins
            return _listen(args, port, table)
    watching.refuse_duration(args)
    stray = [word for word in files if "." not in word and not Path(word).exists() and word != "-"]
    if len(files) > 1 and stray:
        hint = "; values have a command of their own: points" if "points" in stray else ""
        raise Failure(f"{stray[0]}: neither a file nor a table; tables are {', '.join(TABLES)}{hint}", USAGE)
    opened = arguments.open_parts(files)
    _of_captures(args, table, opened)
    for name, capture in opened:
        say_incomplete(name, capture)
    return 0


def _of_captures(args: argparse.Namespace, table: str, opened: Sequence[tuple[str, Capture]]) -> None:
    """Print a table of captures of one bus together."""
    captures = [capture for _, capture in opened]
    names = [name for name, _ in opened]
    session = arguments.settings_of(args, merged_session(captures, names), names[0])
    source = Merged(captures) if len(captures) > 1 else captures[0]
    if args.filter and table in ("ring", "stations", "health"):
        raise Failure(f"{table}: of a whole bus; -Y does not go with it", USAGE)
    if table in ("ring", "stations"):
        shown = dissector_for(session).ring
        if shown is None:
            if table == "stations":
                raise Failure(f"stations: {_for_whom(table)}; of {session.protocol} see nodes", USAGE)
            raise Failure(f"ring: {session.protocol} passes no token; {_for_whom(table)}", USAGE)
        if table == "stations" and shown.stations is None:
            raise Failure(f"stations: {_for_whom(table)}; of {session.protocol} see nodes and ring", USAGE)
        from sniff.cli import ring

        if table == "stations" and shown.stations is not None:
            ring.show_stations(Watched(source), session, shown, shown.stations, args)
        else:
            ring.show(Watched(source), session, shown, args.style, args.reference)
    elif table == "health":
        devices = arguments.noted_devices(args, session)
        from sniff.bus.model import BusModel  # with the rules: other tables count only

        model = BusModel(session, dissector_for(session), devices, with_points=False)
        survey(Watched(source), session, model, reference=args.reference)
        tables.write(HEALTH_HEADINGS, _health(model, station_word(session.protocol)), args.style)
    elif table == "polls":
        from sniff.cli import polls

        polls.show(args, Watched(source), session)
    else:
        summary, kinds = Summary(session.line), _Kinds()
        filtering.surveyed(args, source, session, summary, kinds)
        _write(args, table, summary, kinds, session)


def _write(args: argparse.Namespace, table: str, summary: Summary, kinds: _Kinds, session: Session) -> None:
    """Print a table of what was counted."""
    if table == "nodes":
        bound = session.adapter.latency / MS
        nodes = [(*_node(node), bound if node.latency.count else None) for node in summary.nodes.present()]
        if nodes or args.style != "text":
            tables.write(NODE_HEADINGS, nodes, args.style)
        else:
            print(f"no stations were heard in {summary.frames} frames and {summary.noise} octets of noise")
    elif table == "transactions":
        ordered = sorted(kinds.counts.items(), key=lambda pair: (pair[0][0], -pair[1], pair[0][1].value))
        words = [(kind, _verdict(verdict, args), count) for (kind, verdict), count in ordered]
        tables.write(("kind", "verdict", "count"), words, args.style)
    elif table == "latency":
        rows = [(node.address, *_quantiles(node.latency)) for node in summary.nodes if node.latency.count]
        bound = session.adapter.latency / MS
        tables.write(LATENCY_HEADINGS, [(*row, bound) for row in rows], args.style)
    elif not session.has_times:
        raise Failure("load: this capture does not say when anything came", USAGE)
    else:
        tables.write(LOAD_HEADINGS, _load(summary, _row_length(args, summary.load)), args.style)
        _say_forgotten(summary.load)


def _listen(args: argparse.Namespace, port: str, table: str) -> int:
    """A table of a port, as it becomes."""
    if args.filter:
        raise Failure("-Y: a port is counted whole; record it, then `stats FILE -Y`", USAGE)
    live = watching.start(args, port)
    kinds = _Kinds()

    def take(item: object) -> None:
        from sniff.engine.table import Table

        if isinstance(item, Table):
            kinds.add_table(item)
        elif isinstance(item, Output):
            kinds.add(item)

    def show() -> None:
        model = live.model
        if table in ("ring", "stations"):
            _show_ring(model, table, args.style)
        elif table == "health":
            tables.write(HEALTH_HEADINGS, _health(model, station_word(live.session.protocol)), args.style)
        elif table == "polls":
            from sniff.cli import polls

            polls.write(args, model.polls, model.devices, live.session)
        else:
            _write(args, table, model.summary, kinds, live.session)

    return watching.follow(live, watching.Listener(), show, args.style, take)


def _for_whom(table: str) -> str:
    rings = {one.name: one.ring for one in registry.usable() if one.ring is not None}
    names = [name for name, ring in rings.items() if table == "ring" or ring.stations is not None]
    return f"this table is for {', '.join(names)}"


def _show_ring(model: BusModel, table: str, style: str) -> None:
    from sniff.cli import ring

    shown = model.dissector.ring
    if shown is None:
        print(f"{model.session.protocol} passes no token", file=sys.stdout if style == "text" else sys.stderr)
    elif table == "ring":
        ring.write(model.ring(), shown, style)
    elif shown.stations is not None:
        tables.write(shown.stations.headings, shown.stations.rows(model.ring()), style)
    else:
        print(_for_whom(table), file=sys.stdout if style == "text" else sys.stderr)


NODE_HEADINGS = (
    "address",
    "sent",
    "received",
    "asked",
    "answered",
    "exceptions",
    "no answer",
    "late",
    "twice",
    "damaged",
    "p50 ms",
    "p95 ms",
    "max ms",
    "± ms",
)
HEALTH_HEADINGS = ("subject", "health", "why")
LATENCY_HEADINGS = ("address", "answers", "least ms", "p50 ms", "p95 ms", "max ms", "± ms")
LOAD_HEADINGS = ("time", "heard s", "load %", "frames", "damaged", "noise octets", "octets")


class _Kinds:
    """How often transactions of each kind ended how."""

    def __init__(self) -> None:
        self.counts: Counter[tuple[str, Verdict]] = Counter()

    def add(self, output: Output) -> None:
        """Count what closed."""
        self.counts.update((transaction.kind, transaction.verdict) for transaction in output.transactions)

    def add_table(self, table: Table) -> None:
        """Count what closed."""
        from dissectors.columns import VERDICTS, counted

        closed = table.transactions
        for (kind, verdict), count in counted(closed.kind, closed.verdict):
            self.counts[closed.names[kind], VERDICTS[verdict]] += count

    def add_line_event(self, event: LineEvent) -> None:
        """Nothing of it is counted here."""


def _verdict(verdict: Verdict, args: argparse.Namespace) -> str:
    """In words for people, as the stable value for programs."""
    return verdict.words if args.style == "text" else verdict.value


def _health(model: BusModel, word: str) -> list[tuple[Cell, ...]]:
    health = model.health()
    if not model.summary.octets:  # a bus that nobody heard is neither well nor ill
        return [("bus", None, "nothing was heard")]
    rows = [("bus", health.bus), *((f"{word} {address}", one) for address, one in sorted(health.stations.items()))]
    return [(subject, one.score, "; ".join(one.reasons)) for subject, one in rows]


def _node(node: Node) -> tuple[Cell, ...]:
    return (
        node.address,
        node.sent,
        node.received,
        node.asked,
        node.answered,
        node.verdicts[Verdict.EXCEPTION],
        node.unanswered,
        node.verdicts[Verdict.LATE],
        node.verdicts[Verdict.ANSWERED_TWICE],
        node.damaged,
        *_quantiles(node.latency)[2:],
    )


def _quantiles(latency: Histogram) -> tuple[Cell, ...]:
    values = (latency.least, latency.quantile(0.5), latency.quantile(0.95), latency.most)
    return (latency.count, *(None if value is None else value / MS for value in values))


def _row_length(args: argparse.Namespace, load: Load) -> int:
    """ns of a row: as it is wanted, else a second for programs, and for people as little as keeps the rows few."""
    if args.every is not None:
        return int(args.every * NS_PER_S)
    if args.style != "text" or load.first is None or load.last is None:
        return NS_PER_S
    whole = load.last // NS_PER_S - load.first // NS_PER_S
    return next((every for every in ROW_LENGTHS if whole // every < MOST_ROWS), whole // MOST_ROWS + 1) * NS_PER_S


def _say_forgotten(load: Load) -> None:
    first = min(load.seconds, default=None)
    if first is not None and load.first is not None and load.first // NS_PER_S < first:
        print(f"sniff485: load: of what came before {iso(first * NS_PER_S)} seconds are not kept", file=sys.stderr)


def _load(summary: Summary, every: int) -> list[tuple[Cell, ...]]:
    spans: dict[int, Second] = {}
    for number, second in summary.load.seconds.items():
        part = spans.setdefault(number * NS_PER_S // every, Second())
        part.busy += second.busy
        part.octets += second.octets
        part.frames += second.frames
        part.damaged += second.damaged
        part.noise += second.noise
    return [
        (
            iso(number * every),
            round(summary.load.heard_of(number * every, (number + 1) * every) / NS_PER_S, 4),
            round(100 * summary.load.share_of(part, number * every, (number + 1) * every), 4),
            part.frames,
            part.damaged,
            part.noise,
            part.octets,
        )
        for number, part in sorted(spans.items())
    ]
