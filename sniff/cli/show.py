"""Filters (-Y) have Wireshark's grammar and names: `dst in {1..5, 9} && kind contains "write"`, `latency_ms > 5ms`,
`frame.time >= "10:02"`, `verdict in {no-response, late}`, `frame.octets[2:2] == 03:00`. --help-fields lists the names.
"""

from __future__ import annotations

import argparse
import csv
import sys
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Any

from dissectors.manifest import Dissector
from dissectors.profiles import Devices
from sniff.analysis.packet_tree import Field
from sniff.analysis.row_tree import tree_of
from sniff.bus.offline import settled, settled_columns, settled_in_bulk
from sniff.cli import USAGE, Failure, arguments, filtering, json_output, rows, writing
from sniff.cli.progress import Watched
from sniff.cli.tables import safe_cell
from sniff.engine.capture import Capture
from sniff.engine.follow_settings import dissector_for
from sniff.engine.session import Session
from sniff.engine.verdict_join import Settled, Wanted
from sniff.filter import Filter
from sniff.formats.parquet import ParquetWriter

if TYPE_CHECKING:
    from sniff.cli.filtering import FieldCells
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
    filtering.add_filter(parser)
    filtering.add_help_fields(parser)
    parser.add_argument("--explain", action="store_true", help="say how -Y is carried out, and show nothing")
    style.add_argument("-T", dest="table", choices=["fields"], help="tab-separated fields, chosen by -e")
    parser.add_argument("-e", dest="names", metavar="NAME", action="append", default=[], help="a field; repeatable")
    parser.add_argument("-c", "--count", type=int, metavar="N", help="stop after N frames shown")


def run(args: argparse.Namespace) -> int:
    """Show every capture in turn, the parts of one recording as one."""
    if args.table and not args.names:
        raise Failure(
            "-T fields: say which with -e NAME (repeatable), such as -e kind; --json --fields lists them", USAGE
        )
    if args.names and not args.table:
        raise Failure(f"-e {args.names[0]} goes with -T fields", USAGE)
    filtering.check_names(args.names)
    with writing.parquet_file(args, rows.COLUMNS) as table:
        return _show_all(args, table)


def _show_all(args: argparse.Namespace, table: ParquetWriter | None) -> int:
    if args.csv:
        csv.writer(sys.stdout, lineterminator="\n").writerow(rows.JSON_KEYS)
    left = args.count
    for path, capture in arguments.open_captures(args.files):
        session = arguments.settings_of(args, capture.session, path)
        devices = arguments.noted_devices(args, session)
        wanted = filtering.filter_of(args, capture, session, devices)
        if args.explain:
            print(wanted.explain())
            continue
        spoken = devices if not args.table or "text" in args.names else None
        ours = filtering.FieldCells(args.names, session, devices)
        if args.reference or spoken or ours or args.tree or args.hex or args.fields:
            left = _show(
                args, _settled(args, capture, session, spoken, ours.noting(wanted)), session, ours, left, table
            )
        else:
            left = _show_in_bulk(args, capture, session, wanted, left, table)
        writing.say_incomplete(path, capture)
        if left == 0:
            break
    return 0


def _settled(
    args: argparse.Namespace, capture: Capture, session: Session, devices: Devices | None, wanted: Wanted
) -> Iterator[Settled]:
    watched = Watched(capture)
    if args.reference:
        return settled(watched.items(), session, devices, wanted)
    return settled_in_bulk(watched, session, devices, wanted)


def _show(
    args: argparse.Namespace,
    items: Iterable[Settled],
    session: Session,
    ours: FieldCells,
    left: int | None,
    table: ParquetWriter | None,
) -> int | None:
    colour = arguments.colour()
    dissector = dissector_for(session)
    writer = csv.writer(sys.stdout, delimiter="," if args.csv else "\t", lineterminator="\n", quoting=csv.QUOTE_MINIMAL)
    for item in items if left != 0 else ():
        left = None if left is None else left - 1
        if table is not None:
            table.add(rows.typed(item, dissector, session))
        elif args.csv:
            writer.writerow([_cell(value) for value in rows.to_json(item, dissector, session).values()])
        elif args.table:
            writer.writerow(_cells(item, args.names, dissector, session, ours))
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
    from sniff.filter.choosing import chosen

    made = RowColumns(dissector_for(session), session)
    for settled_rows in settled_columns(Watched(capture), session) if left != 0 else ():
        places = chosen(settled_rows, wanted)
        if left is not None:
            places = places[:left]
            left -= len(places)
        _write(args, made, settled_rows, places, table)
        if left == 0:
            break
    return left


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


def _cells(item: Settled, names: list[str], dissector: Dissector, session: Session, ours: FieldCells) -> list[str]:
    fields = rows.fields_of(item, dissector)
    if any(name not in fields for name in names):
        fields = {**rows.to_json(item, dissector, session), **fields}
    return [ours.cell(name, item.row, item.transaction) if name in ours else _cell(fields.get(name)) for name in names]


def _cell(value: object) -> str:
    if value is None:
        return ""
    return (
        str(int(value)) if isinstance(value, bool) else str(safe_cell(str(value)) if isinstance(value, str) else value)
    )


def _tree(item: Settled, dissector: Dissector) -> str:
    return "\n".join(_tree_lines(tree_of(dissector, item.row, item.transaction, rows.iso), "        "))


def _tree_lines(fields: Iterable[Field], indent: str) -> Iterator[str]:
    for field in fields:
        yield f"{indent}{field.name}: {field.value}" if field.value else f"{indent}{field.name}"
        yield from _tree_lines(field.children, indent + "  ")
