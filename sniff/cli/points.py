"""Values by name: the latest of each point as a table; --csv, --json and --parquet give every sample. Names and units
come from device profiles (-d), else a point is its place: holding/40108, AI/9, and the table says what its values look
like: "guessed" stands before that, and two registers that are one number are one row then. Quality: 0 good, 1 doubtful,
2 out of range. every ms: from one sample to the next, half of them are shorter; jitter ms: by how much nine of ten
differ, halved. Parquet needs `pip install 'sniff485[parquet]'`. Of a PORT or a configured bus: the table as it becomes,
until Ctrl-C or --duration, then as it is; nothing is recorded.
"""

from __future__ import annotations

import argparse
import fnmatch
import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import TYPE_CHECKING

from dissectors.line import MS, NS_PER_S
from dissectors.profiles import Devices
from dissectors.profiles.decoding import Quality, number
from dissectors.words import brief
from sniff.analysis.point_reader import PointReader, Sample
from sniff.analysis.points import Point, PointTable
from sniff.analysis.sanitizing import sanitized
from sniff.bus.offline import outputs
from sniff.bus.row_words import iso
from sniff.bus.sample_row import COLUMNS, sample_row, shown_value
from sniff.cli import USAGE, Failure, arguments, filtering, tables, watching, writing
from sniff.cli.incomplete import say_incomplete
from sniff.cli.interruption import until_interrupted
from sniff.cli.progress import Watched
from sniff.cli.tables import Cell
from sniff.engine.capture import Capture
from sniff.engine.engine import Output
from sniff.engine.follow_settings import dissector_for
from sniff.engine.session import LineEvent, Session
from sniff.formats.parquet import Kind

if TYPE_CHECKING:
    from sniff.analysis.guessed_points import GuessedPoint, Guessing
    from sniff.analysis.point_columns import TableSamples
    from sniff.bus.live import LiveBus

LATEST = (
    "device",
    "point",
    "value",
    "unit",
    "means",
    "quality",
    "age s",
    "changed s",
    "samples",
    "every ms",
    "jitter ms",
    "low",
    "high",
    "a second",
    "written",
)
_SELDOM = ("unit", "written")
"""Columns that a person need not see when there is nothing in them."""

FRESH = 2.0
"""Seconds for which a change is marked on a terminal."""

OF_TIME = frozenset(("time", "age s", "changed s", "every ms", "jitter ms", "a second"))
"""Columns that a capture without times does not know."""

SAMPLES = ("time", "device", "point", "value", "raw", "unit", "quality", "how", "frame", "means")


def configure(parser: argparse.ArgumentParser) -> None:
    """Options of `points`."""
    arguments.add_files(parser)
    arguments.add_line(parser)
    arguments.add_devices(parser)
    arguments.add_reference(parser)
    filtering.add_filter(parser, "only values of exchanges with a frame that matches")
    parser.add_argument("-n", "--name", action="append", default=[], metavar="GLOB", help="only points like output-*")
    parser.add_argument("--sort", choices=SORTS, default="device", help="order of the table (default: device)")
    parser.add_argument("--no-guess", action="store_true", help="say nothing of what undescribed registers may hold")
    parser.add_argument("--bits", action="store_true", help="in the table, also the single bits of registers")
    style = parser.add_mutually_exclusive_group()
    style.add_argument("--json", action="store_const", const="json", dest="style", help="one JSON object a sample")
    style.add_argument("--csv", action="store_const", const="csv", dest="style", help="comma-separated values")
    style.add_argument("--parquet", metavar="OUT", help="every sample into a Parquet file: instants, numbers and texts")
    parser.add_argument("-f", "--force", action="store_true", help="overwrite OUT")
    watching.add_duration(parser)
    which = parser.add_mutually_exclusive_group()
    which.add_argument("--latest", action="store_const", const=True, dest="latest", help="only the latest of each")
    which.add_argument("--all", action="store_const", const=False, dest="latest", help="every sample")
    parser.set_defaults(style="text", latest=None)


def run(args: argparse.Namespace) -> int:
    """Print the values of every capture in turn, the parts of one recording as one; or of a port."""
    port = watching.port_of(args.files)
    if port is not None:
        with until_interrupted():  # from before it begins
            return _listen(args, port)
    watching.refuse_duration(args)
    if args.parquet is None:
        return _print(args)
    if args.latest:
        raise Failure("--parquet holds every sample: leave --latest out", USAGE)
    opened = arguments.open_captures(args.files)
    columns = {"source": Kind.TEXT, **COLUMNS} if len(opened) > 1 else COLUMNS
    with writing.parquet_file(args, columns) as table:
        assert table is not None
        for name, capture in opened:
            first = [name] if len(opened) > 1 else []
            session = arguments.settings_of(args, capture.session, name)
            for samples in _chosen(args, capture, session):
                for sample in samples.in_order():
                    time, *rest = sample_row(sample)
                    table.add([*first, time if session.has_times else None, *rest])
            say_incomplete(name, capture)
    return 0


def _print(args: argparse.Namespace) -> int:
    opened = arguments.open_captures(args.files)
    latest = args.latest if args.latest is not None else args.style == "text"
    headings = LATEST if latest else SAMPLES
    first = ("source",) if len(opened) > 1 else ()  # of several captures each row says of which it is
    growing = tables.Growing((*first, *headings), args.style) if args.style != "text" else None
    for at, (path, capture) in enumerate(opened):
        session = arguments.settings_of(args, capture.session, path)
        if first and growing is None:
            print(f"\n{sanitized(path)}" if at else sanitized(path))
        if latest:
            cells: Iterable[tuple[Cell, ...]] = _latest_of(args, capture, session)
        else:
            cells = (cells for samples in _chosen(args, capture, session) for cells in _cells(samples))
        if not session.has_times:
            cells = (
                tuple(None if name in OF_TIME else cell for name, cell in zip(headings, row, strict=True))
                for row in cells
            )
        if growing is not None:
            growing.add((path, *row) for row in cells) if first else growing.add(cells)
        elif latest:
            _write_latest(list(cells))
        else:
            tables.write(SAMPLES, cells)
        say_incomplete(path, capture)
    return 0


def _chosen(args: argparse.Namespace, capture: Capture, session: Session) -> Iterator[TableSamples]:
    """The samples that the user wants, many at a time."""
    for samples in _samples(args, capture, session, arguments.noted_devices(args, session)):
        yield _wanted(args, samples)


def _samples(
    args: argparse.Namespace, capture: Capture, session: Session, devices: Devices, points: PointTable | None = None
) -> Iterator[TableSamples]:
    """All samples, many at a time. `points`: is told of holes."""
    from sniff.analysis.point_columns import TableSamples, no_samples
    from sniff.analysis.table_points import samples_of
    from sniff.engine.bulk import tables_of

    reader = PointReader(dissector_for(session), devices)
    watched = Watched(capture, prints=True)
    if args.filter:
        taken = _Taken(reader, points)
        filtering.surveyed(args, capture, session, taken, every_row=True, devices=reader.devices)
        yield TableSamples(no_samples(), [(0, sample) for sample in taken.samples])
        return
    if args.reference:
        for output in outputs(watched.items(), session):
            if isinstance(output, Output):
                yield TableSamples(no_samples(), [(0, sample) for sample in reader.add(output)])
            else:
                _happen(points, output)
        return
    for table in tables_of(watched, session):
        if isinstance(table, LineEvent):
            _happen(points, table)
        else:
            yield samples_of(reader, table)


def _happen(points: PointTable | None, event: LineEvent) -> None:
    if points is not None and event.kind.is_hole:
        points.miss(event.time)


class _Taken:
    """The samples of exchanges that are handed on."""

    def __init__(self, reader: PointReader, points: PointTable | None) -> None:
        self._reader, self._points = reader, points
        self.samples: list[Sample] = []

    def add(self, output: Output) -> None:
        """Take rows and exchanges."""
        self.samples += self._reader.add(output)

    def add_line_event(self, event: LineEvent) -> None:
        """Take what happened to the line."""
        _happen(self._points, event)


def _wanted(args: argparse.Namespace, samples: TableSamples) -> TableSamples:
    """Those with a name that is asked for."""
    if not args.name:
        return samples
    return samples.named(lambda point: any(fnmatch.fnmatchcase(point, name) for name in args.name))


def _latest_of(args: argparse.Namespace, capture: Capture, session: Session) -> list[tuple[Cell, ...]]:
    """The newest of each point of a capture."""
    from sniff.analysis.guessed_points import Guessing
    from sniff.analysis.point_columns import add_to

    devices, dissector = arguments.noted_devices(args, session), dissector_for(session)
    points, end = PointTable(), None
    guessing = None if args.no_guess else Guessing(dissector, devices)
    for samples in _samples(args, capture, session, devices, points):
        if guessing is not None:
            guessing.add(samples)
        samples = _wanted(args, samples)
        add_to(points, samples)
        last = samples.last
        end = last if end is None or (last is not None and last > end) else end
    return _latest_rows(args, points, guessing, end or 0)


def _latest_rows(
    args: argparse.Namespace, points: PointTable, guessing: Guessing | None, end: int
) -> list[tuple[Cell, ...]]:
    """The table as it is at `end`, ns."""
    shown = [point for point in points if args.bits or args.name or not point.sample.value.bit]
    told = guessing.of(points) if guessing is not None else {}
    rows = []
    for point in sorted(shown, key=SORTS[args.sort]):
        guess = told.get((point.sample.station, point.sample.name))
        if guess is None or not guess.is_covered:
            rows.append(_latest(point, end, args.style, guess))
    return rows


def _write_latest(rows: Sequence[tuple[Cell, ...]]) -> None:
    """For people: without columns in which nothing stands."""
    kept = [at for at, name in enumerate(LATEST) if name not in _SELDOM or any(row[at] for row in rows)]
    changed = LATEST.index("changed s")
    fresh = [_is_fresh(row[changed]) for row in rows] if arguments.colour() else ()
    tables.write([LATEST[at] for at in kept], [[row[at] for at in kept] for row in rows], bold=fresh)


def _listen(args: argparse.Namespace, port: str) -> int:
    """The values of a port: the latest of each as a table drawn anew, or each as it comes."""
    if args.filter or args.parquet:
        raise Failure("-Y, --parquet: not of a port; record it, then `points FILE`", USAGE)
    latest = args.latest if args.latest is not None else args.style == "text"
    live = watching.start(args, port)
    values = _Values(args, live, None if latest else tables.Growing(SAMPLES, args.style))
    if not latest:
        return watching.follow(live, values, None)

    def show() -> None:
        told = _latest_rows(args, values.points, values.guessing, values.now)
        if args.style == "text":
            _write_latest(told)
        else:
            tables.write(LATEST, told, args.style)

    return watching.follow(live, values, show, args.style)


class _Values(watching.Listener):
    """Values of a live bus: kept, or printed as they come."""

    def __init__(self, args: argparse.Namespace, live: LiveBus, printed: tables.Growing | None) -> None:
        self.points = PointTable()
        self.guessing: Guessing | None = None
        self._args = args
        self._printed = printed
        self._protocol = ""
        self.now = 0  # ns, until when all is known

    def on_time(self, live: LiveBus, now: int) -> None:
        """Ages are counted from here."""
        self.now = now

    def on_event(self, live: LiveBus, event: LineEvent) -> None:
        """Over a hole there is no interval."""
        _happen(self.points, event)

    def on_samples(self, live: LiveBus, samples: Sequence[Sample]) -> None:
        """Keep them, or print them."""
        from sniff.analysis.guessed_points import Guessing
        from sniff.analysis.point_columns import TableSamples, no_samples

        if self._protocol != live.session.protocol:  # at first, and when one was found
            self._protocol = live.session.protocol
            self.guessing = None if self._args.no_guess else Guessing(live.dissector, live.devices)
        many = TableSamples(no_samples(), [(0, sample) for sample in samples])
        if self.guessing is not None and self._printed is None:
            self.guessing.add(many)
        wanted = _wanted(self._args, many).in_order()
        if self._printed is None:
            self.points.add(wanted)
        else:
            self._printed.add(map(_sample, wanted))


def _latest(point: Point, end: int, style: str, guess: GuessedPoint | None) -> tuple[Cell, ...]:
    sample, value = point.sample, point.sample.value
    means = f"command: {value.words}".rstrip(": ") if point.is_command else value.words
    quality, low, high, rate = int(value.quality), point.low, point.high, point.rate
    shown = _rounded(sample) if style == "text" else shown_value(sample)
    if guess is not None:
        means = f"{means}; {guess.words}".removeprefix("; ")
        quality, low, high, rate = int(Quality.UNCERTAIN), guess.low, guess.high, guess.rate
        shown = guess.value if style != "text" or guess.value is None else number(guess.value)
    age = round((end - sample.time) / NS_PER_S, 3)
    changed = round((end - point.changed) / NS_PER_S, 3) if point.changed else None
    often = (_ms(point.interval), _ms(point.jitter))
    span = tuple(_brief(number, style) for number in (low, high, rate))
    counted = (age, changed, point.count, *often, *span, point.written)
    return (sample.station, sample.name, shown, value.unit, means, quality, *counted)


def _is_fresh(changed: Cell) -> bool:
    return isinstance(changed, float) and changed <= FRESH


def _ms(time: int | None) -> Cell:
    return None if time is None else round(time / MS, 1)


def _brief(value: float | None, style: str) -> Cell:
    """Whole numbers with all their digits, others with five."""
    if value is None or style != "text":
        return value
    return brief(value, 5)


def _by_device(point: Point) -> tuple[float, ...]:
    return (-1 if point.sample.device is None else point.sample.device,)


SORTS: dict[str, Callable[[Point], tuple[float | str, ...]]] = {
    "device": _by_device,
    "name": lambda point: (point.sample.name, *_by_device(point)),
    "changed": lambda point: (-point.changed, *_by_device(point)),
    "samples": lambda point: (-point.count, *_by_device(point)),
    "every": lambda point: (math.inf if point.interval is None else point.interval, *_by_device(point)),
    "rate": lambda point: (-(point.rate or 0.0), *_by_device(point)),
}


def _cells(samples: TableSamples) -> Iterator[tuple[Cell, ...]]:
    """All samples as rows of a table."""
    if samples.others:
        yield from map(_sample, samples.in_order())
        return
    import numpy as np

    from dissectors.reading_columns import HOWS

    plain = samples.plain
    (points, which), hows = plain.points(), [how.value for how in HOWS]
    stamps = [f"{stamp}Z" for stamp in np.datetime_as_string(plain.time.view("M8[ns]")).tolist()]
    columns = zip(*(column.tolist() for column in (which, plain.raw, plain.how, plain.frame)), strict=True)
    for stamp, (point, raw, how, frame), value, unit, words in zip(
        stamps, columns, plain.values(), plain.units(), plain.words(), strict=True
    ):
        yield stamp, *points[point], value, raw, unit, 0, hows[how], frame, words


def _sample(sample: Sample) -> tuple[Cell, ...]:
    value = sample.value
    return (
        iso(sample.time),
        sample.station,
        sample.name,
        shown_value(sample),
        value.raw,
        value.unit,
        int(value.quality),
        value.how.value,
        sample.frame,
        value.words,
    )


def _rounded(sample: Sample) -> Cell:
    """The value as a text with the digits that its scale makes."""
    value = sample.value
    return shown_value(sample) if isinstance(value.value, str) else number(value.value, value.entry)
