"""Filters (-Y) use columns and Wireshark's field names: `dst == 3 && kind contains "write"`, `latency_ms > 50`,
`verdict in {no-response, late}`. Columns: no src dst addr role kind func register count ok error noise found damage
len marks tx verdict latency_ms attempt text hex. Dotted names: see --fields.
"""

from __future__ import annotations

import argparse
import csv
import sys
from collections.abc import Callable, Iterable, Iterator
from typing import TYPE_CHECKING

from dissectors import registry
from dissectors.manifest import Dissector
from dissectors.profiles import Devices
from sniff.analysis.filtering import Filter, FilterError, compile_filter
from sniff.analysis.packet_tree import Field
from sniff.analysis.row_tree import tree_of
from sniff.bus.offline import settled, settled_columns, settled_in_bulk
from sniff.cli import USAGE, Failure, arguments, rows, standard_streams, writing
from sniff.cli.progress import Watched
from sniff.cli.tables import Cell, plain_cell
from sniff.config import nearest
from sniff.engine.capture import Capture
from sniff.engine.follow_settings import dissector_for
from sniff.engine.session import Session
from sniff.engine.verdict_join import Settled
from sniff.formats.parquet import ParquetWriter

if TYPE_CHECKING:
    from dissectors.columns import Times
    from sniff.engine.column_join import SettledRows


def configure(parser: argparse.ArgumentParser) -> None:
    """Options of `show`."""
    arguments.add_files(parser)
    arguments.add_line(parser)
    arguments.add_devices(parser)
    arguments.add_reference(parser)
    style = parser.add_mutually_exclusive_group()
    style.add_argument("--json", action="store_true", help="one JSON object a frame")
    style.add_argument("--csv", action="store_true", help="comma-separated values, the columns of --json")
    style.add_argument("--parquet", metavar="OUT", help="the same into a Parquet file: instants, numbers and texts")
    parser.add_argument("-f", "--force", action="store_true", help="overwrite OUT")
    parser.add_argument("--fields", action="store_true", help="with --json: add every field under Wireshark's names")
    parser.add_argument("-V", dest="tree", action="store_true", help="full tree of each frame")
    parser.add_argument("-x", dest="hex", action="store_true", help="octets of each frame")
    parser.add_argument("-Y", dest="filter", metavar="FILTER", default="", help="only frames that match")
    style.add_argument("-T", dest="table", choices=["fields"], help="tab-separated fields, chosen by -e")
    parser.add_argument("-e", dest="names", metavar="NAME", action="append", default=[], help="a field; repeatable")
    parser.add_argument("-c", "--count", type=arguments.whole, metavar="N", help="stop after N frames shown")


def run(args: argparse.Namespace) -> int:
    """Show every capture in turn, the parts of one recording as one."""
    if args.table and not args.names:
        raise Failure(
            "-T fields: say which with -e NAME (repeatable), such as -e kind; --json --fields lists them", USAGE
        )
    of_protocols = tuple(prefix for dissector in registry.usable() for prefix in dissector.prefixes)
    for name in args.names:
        if name not in rows.JSON_KEYS and not name.startswith((*of_protocols, "frame.", "tx.", "line.")):
            raise Failure(f"-e {name}: unknown field{nearest(name, rows.JSON_KEYS)}; --fields lists a capture's", USAGE)
    with writing.parquet_file(args, rows.COLUMNS) as table:
        return _show_all(args, table)


def _show_all(args: argparse.Namespace, table: ParquetWriter | None) -> int:
    if args.csv:
        csv.writer(sys.stdout, lineterminator="\n").writerow(rows.JSON_KEYS)
    left = args.count
    for path, capture in arguments.open_captures(args.files):
        session = arguments.settings_of(args, capture.session, path)
        dissector = dissector_for(session)
        devices = arguments.noted_devices(args, session)
        wanted = _filter(args, dissector)
        spoken = devices if not args.table or "text" in args.names else None
        if args.reference or spoken or args.tree or args.hex or args.fields:
            left = _show(args, _settled(args, capture, session, spoken, wanted), session, dissector, left, table)
        else:
            in_tables = _filter(args, dissector, with_closings=True)
            left = _show_in_bulk(args, capture, session, in_tables, left, table)
        writing.say_incomplete(path, capture)
        if left == 0:
            break
    return 0


def _filter(args: argparse.Namespace, dissector: Dissector, with_closings: bool = False) -> Filter:
    try:
        return compile_filter(args.filter, dissector, with_closings)
    except FilterError as error:
        raise Failure(f"filter {args.filter!r}: {error}", USAGE) from None


def _settled(
    args: argparse.Namespace, capture: Capture, session: Session, devices: Devices | None, wanted: Filter
) -> Iterator[Settled]:
    watched = Watched(capture, prints=True)
    if args.reference:
        return settled(watched.items(), session, devices, wanted)
    return settled_in_bulk(watched, session, devices, wanted)


def _show(
    args: argparse.Namespace,
    items: Iterable[Settled],
    session: Session,
    dissector: Dissector,
    left: int | None,
    table: ParquetWriter | None,
) -> int | None:
    colour = arguments.colour()
    writer = csv.writer(sys.stdout, delimiter="," if args.csv else "\t", lineterminator="\n", quoting=csv.QUOTE_MINIMAL)
    for item in items if left != 0 else ():
        left = None if left is None else left - 1
        if table is not None:
            table.add(rows.typed(item, dissector, session))
        elif args.csv:
            writer.writerow([plain_cell(value) for value in rows.to_json(item, dissector, session).values()])
        elif args.table:
            writer.writerow(_cells(item, args.names, dissector, session))
        elif args.json:
            print(rows.json_line(item, dissector, session, args.fields))
        else:
            print(rows.text_line(item, dissector, session, colour))
            if args.tree:
                print(_tree(item, dissector))
            if args.hex:
                print(rows.hex_dump(item.row.event.octets))
        if left == 0:
            break
    return left


def _show_in_bulk(
    args: argparse.Namespace,
    capture: Capture,
    session: Session,
    wanted: Filter,
    left: int | None,
    table: ParquetWriter | None,
) -> int | None:
    listed = _listed(args, dissector_for(session), session, table)
    for settled_rows in settled_columns(Watched(capture, prints=True), session) if left != 0 else ():
        places = _chosen(settled_rows, wanted)
        if left is not None:
            places = places[:left]
            left -= len(places)
        if len(places):
            listed(settled_rows, places)
        if left == 0:
            break
    return left


def _chosen(some: SettledRows, wanted: Filter) -> Times:
    """Places of the rows that a filter accepts."""
    import numpy as np

    from sniff.engine.table import AT_ONCE, rows_at

    odd = some.table.odd
    if wanted.columns is None:
        places = np.arange(some.begin, some.end)
    else:
        mask = wanted.columns(some.table, some.closings if wanted.of_closing else None)
        mask[list(odd)] = True
        places = np.flatnonzero(mask[some.begin : some.end]) + some.begin
    asked = np.isin(places, list(odd)) if wanted.exact else np.ones(len(places), bool)
    for at in range(0, len(asked_places := np.flatnonzero(asked)), AT_ONCE):
        part = asked_places[at : at + AT_ONCE]
        chosen = places[part].tolist()
        rows_of = zip(chosen, rows_at(some.table, chosen), strict=True)
        asked[part] = [not wanted(row, some.transaction(place)) for place, row in rows_of]
    return places[~asked]


def _listed(
    args: argparse.Namespace, dissector: Dissector, session: Session, table: ParquetWriter | None
) -> Callable[[SettledRows, Times], None]:
    """What lists rows at some places."""
    from sniff.cli.row_cells import RowCells, json_lines, separated
    from sniff.cli.row_columns import RowColumns
    from sniff.cli.row_lines import RowLines

    if table is not None:
        columns = RowColumns(dissector, session)

        def added(some: SettledRows, places: Times) -> None:
            for cells in columns.cells(some, places.tolist(), rows.JSON_KEYS, lambda cell: cell, instants=True):
                table.add(cells)

        return added
    made: RowCells | RowLines
    if args.csv:
        made = RowCells(dissector, session, rows.JSON_KEYS, separated(len(rows.JSON_KEYS), ","))
    elif args.table:
        made = RowCells(dissector, session, args.names, separated(len(args.names), "\t"))
    elif args.json:
        made = RowCells(dissector, session, rows.JSON_KEYS, json_lines(rows.JSON_KEYS))
    else:
        made = RowLines(dissector, session, arguments.colour())
    return lambda some, places: standard_streams.write(made.lines(some, places))


def _cells(item: Settled, names: list[str], dissector: Dissector, session: Session) -> list[Cell]:
    fields = rows.fields_of(item, dissector)
    if any(name not in fields for name in names):
        fields = {**rows.to_json(item, dissector, session), **fields}
    return [plain_cell(fields.get(name)) for name in names]


def _tree(item: Settled, dissector: Dissector) -> str:
    return "\n".join(_tree_lines(tree_of(dissector, item.row, item.transaction, rows.iso), "        "))


def _tree_lines(fields: Iterable[Field], indent: str) -> Iterator[str]:
    for field in fields:
        yield f"{indent}{field.name}: {field.value}" if field.value else f"{indent}{field.name}"
        yield from _tree_lines(field.children, indent + "  ")
