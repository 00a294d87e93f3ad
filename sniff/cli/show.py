"""Filters (-Y) use columns and Wireshark's field names: `dst == 3 && kind contains "write"`, `latency_ms > 50`,
`verdict in {no-response, late}`. Columns: no src dst addr role kind func register count ok error noise found damage
len marks tx verdict latency_ms attempt text hex. Dotted names: see --fields.
"""

from __future__ import annotations

import argparse
import csv
import sys
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Any

from dissectors import registry
from dissectors.manifest import Dissector
from dissectors.profiles import Devices
from sniff.analysis.filtering import Filter, FilterError, compile_filter
from sniff.analysis.packet_tree import Field
from sniff.analysis.row_tree import tree_of
from sniff.bus.offline import settled, settled_columns, settled_in_bulk
from sniff.cli import USAGE, Failure, arguments, json_output, rows, writing
from sniff.cli.progress import Watched
from sniff.cli.tables import safe_cell
from sniff.config import nearest
from sniff.engine.capture import Capture
from sniff.engine.follow_settings import dissector_for
from sniff.engine.session import Session
from sniff.engine.verdict_join import Settled
from sniff.formats.parquet import ParquetWriter

if TYPE_CHECKING:
    from sniff.cli.row_columns import RowColumns
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
    parser.add_argument("-c", "--count", type=int, metavar="N", help="stop after N frames shown")


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
        named = args.tree or args.fields  # then every register is named, with a profile or without
        spoken = devices if named or (devices and (not args.table or "text" in args.names)) else None
        if args.reference or spoken or named or args.hex:
            left = _show(args, _settled(args, capture, session, spoken, wanted), session, dissector, left, table)
        else:
            left = _show_in_bulk(args, capture, session, wanted, left, table)
        writing.say_incomplete(path, capture)
        if left == 0:
            break
    return 0


def _filter(args: argparse.Namespace, dissector: Dissector) -> Filter:
    try:
        return compile_filter(args.filter, dissector)
    except FilterError as error:
        raise Failure(f"filter {args.filter!r}: {error}", USAGE) from None


def _settled(
    args: argparse.Namespace, capture: Capture, session: Session, devices: Devices | None, wanted: Filter
) -> Iterator[Settled]:
    watched = Watched(capture)
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
            writer.writerow([_cell(value) for value in rows.to_json(item, dissector, session).values()])
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
    from sniff.cli.row_columns import RowColumns

    made = RowColumns(dissector_for(session), session)
    for settled_rows in settled_columns(Watched(capture), session) if left != 0 else ():
        places = _chosen(settled_rows, wanted)
        if left is not None:
            places = places[:left]
            left -= len(places)
        _write(args, made, settled_rows, places, table)
        if left == 0:
            break
    return left


def _chosen(some: SettledRows, wanted: Filter) -> list[int]:
    """Places of the rows that a filter accepts."""
    places = wanted.candidates(some.table)
    if places is None:
        places = list(range(some.begin, some.end))
    else:
        places = [place for place in places if some.begin <= place < some.end]
    odd = some.table.odd
    if wanted.exact:
        return [place for place in places if place not in odd or wanted(odd[place], some.transaction(place))]
    from sniff.engine.table import AT_ONCE, rows_at

    chosen: list[int] = []
    for begin in range(0, len(places), AT_ONCE):
        part = places[begin : begin + AT_ONCE]
        rows_of = zip(part, rows_at(some.table, part), strict=True)
        chosen += [place for place, row in rows_of if wanted(row, some.transaction(place))]
    return chosen


def _write(
    args: argparse.Namespace, made: RowColumns, some: SettledRows, places: list[int], table: ParquetWriter | None
) -> None:
    if not places:
        return
    if table is not None:
        for cells in made.cells(some, places, rows.JSON_KEYS, lambda cell: cell, instants=True):
            table.add(cells)
    elif args.csv or args.table:
        writer = csv.writer(sys.stdout, delimiter="," if args.csv else "\t", lineterminator="\n")
        writer.writerows(made.cells(some, places, rows.JSON_KEYS if args.csv else args.names, _cell))
    elif args.json:
        form = "{" + ", ".join(f'"{key}": %s' for key in rows.JSON_KEYS) + "}\n"
        sys.stdout.writelines(map(form.__mod__, made.cells(some, places, rows.JSON_KEYS, _as_json)))
    else:
        sys.stdout.writelines(f"{line}\n" for line in made.lines(some, places, arguments.colour()))


def _as_json(cell: Any) -> Any:
    return cell if isinstance(cell, int | float) and not isinstance(cell, bool) else json_output.dumps(cell)


def _cells(item: Settled, names: list[str], dissector: Dissector, session: Session) -> list[str]:
    fields = rows.fields_of(item, dissector)
    if any(name not in fields for name in names):
        fields = {**rows.to_json(item, dissector, session), **fields}
    return [_cell(fields.get(name)) for name in names]


def _cell(value: object) -> str:
    if value is None:
        return ""
    return (
        str(int(value)) if isinstance(value, bool) else str(safe_cell(str(value)) if isinstance(value, str) else value)
    )


def _tree(item: Settled, dissector: Dissector) -> str:
    return "\n".join(_tree_lines(tree_of(dissector, item.row, item.transaction, rows.iso, item.meaning), "        "))


def _tree_lines(fields: Iterable[Field], indent: str) -> Iterator[str]:
    for field in fields:
        yield f"{indent}{field.name}: {field.value}" if field.value else f"{indent}{field.name}"
        yield from _tree_lines(field.children, indent + "  ")
