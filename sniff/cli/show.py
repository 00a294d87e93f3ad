"""Filters (-Y) have Wireshark's grammar and names: `dst in {1..5, 9} && kind contains "write"`, `latency_ms > 5ms`,
`frame.time >= "10:02"`, `verdict in {no-response, late}`, `frame.octets[2:2] == 03:00`. --help-fields lists the names.
"""

from __future__ import annotations

import argparse
import csv
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

from dissectors.manifest import Dissector
from dissectors.profiles import Devices
from sniff.analysis.sanitizing import sanitized
from sniff.bus import row_words as rows
from sniff.bus.offline import settled_columns
from sniff.bus.second_proof import SecondProof
from sniff.cli import USAGE, Failure, arguments, filtering, standard_streams, writing
from sniff.cli.incomplete import say_incomplete
from sniff.cli.listed_rows import ListedRows
from sniff.cli.progress import Watched
from sniff.cli.tables import Cell, plain_cell
from sniff.engine.capture import Capture
from sniff.engine.follow_settings import dissector_for
from sniff.engine.session import Session
from sniff.engine.verdict_join import JudgedRow
from sniff.formats.parquet import Kind, ParquetWriter

if TYPE_CHECKING:
    from dissectors.columns import Times
    from sniff.analysis.packet_tree import Field
    from sniff.cli.field_names import FieldCells
    from sniff.engine.column_join import SettledRows
    from sniff.filter import Filter


SOURCE = "source"
"""What `-e` calls the capture or bus that a row is of."""


def configure(parser: argparse.ArgumentParser) -> None:
    """Options of `show`."""
    arguments.add_files(parser)
    arguments.add_line(parser)
    arguments.add_devices(parser)
    arguments.add_reference(parser)
    style = parser.add_mutually_exclusive_group()
    style.add_argument("--json", action="store_true", help="one JSON object a frame; of several captures: whose it is")
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
    parser.add_argument(
        "-e",
        dest="names",
        metavar="NAME",
        action="append",
        default=[],
        help="a field, or source: whose row it is; repeatable",
    )
    parser.add_argument("-c", "--count", type=arguments.whole, metavar="N", help="stop after N frames shown")


def run(args: argparse.Namespace) -> int:
    """Show every capture in turn, the parts of one recording as one."""
    if args.table and not args.names:
        raise Failure(
            "-T fields: say which with -e NAME (repeatable), such as -e kind; --json --fields lists them", USAGE
        )
    if args.names and not args.table:
        raise Failure(f"-e {args.names[0]} goes with -T fields", USAGE)
    if any(name not in rows.JSON_KEYS for name in args.names):
        from sniff.cli.field_names import check_names

        check_names(args.names)
    opened = arguments.open_captures(args.files)
    columns = {"source": Kind.TEXT, **rows.COLUMNS} if len(opened) > 1 else rows.COLUMNS
    with writing.parquet_file(args, columns) as table:
        return _show_all(args, opened, table)


def _show_all(args: argparse.Namespace, opened: Sequence[tuple[str, Capture]], table: ParquetWriter | None) -> int:
    are_several = len(opened) > 1
    if args.csv:
        names = ("source", *rows.JSON_KEYS) if are_several else rows.JSON_KEYS
        csv.writer(sys.stdout, lineterminator="\n").writerow(names)
    left = args.count
    for at, (path, capture) in enumerate(opened):
        source = path if are_several else None  # of several captures each row says of which it is
        if args.table and not at and are_several and SOURCE not in args.names:
            print(f"sniff485: rows of {len(opened)} captures; -e {SOURCE} says of which each is", file=sys.stderr)
        if source is not None and _is_text(args):
            print(f"\n{sanitized(source)}" if at else sanitized(source))
        left = _show_capture(args, path, capture, source, table, left)
        if left == 0:
            break
    return 0


def _show_capture(
    args: argparse.Namespace,
    path: str,
    capture: Capture,
    source: str | None,
    table: ParquetWriter | None,
    left: int | None,
) -> int | None:
    """List it, or explain how it would be filtered; how many rows are left to be shown, None for all."""
    session = arguments.settings_of(args, capture.session, path)
    devices = arguments.noted_devices(args, session)
    proof, wanted = filtering.filter_of_both(args, capture, session, devices)
    if wanted is not None and args.explain:
        print(wanted.explain())
        return left
    # with a tree or fields every register is named, with a profile or without
    are_named = args.tree or args.fields or _by_request(args.names, session)
    spoken = devices if are_named or (devices and (not args.table or "text" in args.names)) else None
    shown = _Shown(args, path, source, session, table, _cells_of_filters(args.names, capture, session, devices))
    listed = ListedRows(args, capture, session, proof, wanted, *(() if shown.ours is None else (shown.ours.noting,)))
    only_source = bool(args.names) and all(name == SOURCE for name in args.names)
    if args.reference or spoken or are_named or shown.ours or args.hex or proof.name or only_source:
        left = _show(shown, listed.all(spoken), left)
    else:
        left = _show_in_bulk(shown, capture, proof, wanted, left)
        if proof.name and left != 0:
            left = _show(shown, listed.of_both(spoken), left)
    say_incomplete(path, capture)
    return left


def _is_text(args: argparse.Namespace) -> bool:
    """Whether rows are printed as lines for people."""
    return not (args.json or args.csv or args.table or args.parquet or args.explain)


def _cells_of_filters(names: list[str], capture: Capture, session: Session, devices: Devices) -> FieldCells | None:
    """Of names that only filters know; None where there are none."""
    if all(name in rows.JSON_KEYS for name in names):
        return None
    from sniff.cli.field_names import FieldCells

    findings = filtering.evidence(capture, session, devices) if "finding" in names else None
    return FieldCells(names, session, devices, findings) or None


def _by_request(names: list[str], session: Session) -> bool:
    """Whether answers have any of these fields by their request."""
    if all(name in rows.JSON_KEYS for name in names):
        return False
    from sniff.filter.fields import types_of

    types = types_of(dissector_for(session))
    return any(types[name].by_request for name in names if name in types)


@dataclass(frozen=True, slots=True)
class _Shown:
    """A capture that is listed, and how. `source`: what rows say of whose they are, None of a single capture. `table`:
    where they go instead of standard output. `ours`: names of `-e` that only filters know."""

    args: argparse.Namespace
    path: str
    source: str | None
    session: Session
    table: ParquetWriter | None
    ours: FieldCells | None

    @property
    def first(self) -> tuple[str, ...]:
        """What each row of a table begins with."""
        return () if self.source is None else (self.source,)


def _show(shown: _Shown, items: Iterable[tuple[JudgedRow, Dissector]], left: int | None) -> int | None:
    """Rows one by one, `left` of them, None for all; how many are left."""
    list_row = _lister(shown)
    for item, dissector in items if left != 0 else ():
        left = None if left is None else left - 1
        list_row(item, dissector)
        if left == 0:
            break
    return left


def _lister(shown: _Shown) -> Callable[[JudgedRow, Dissector], None]:
    """What lists a row."""
    args, session, table = shown.args, shown.session, shown.table
    writer = csv.writer(sys.stdout, delimiter="," if args.csv else "\t", lineterminator="\n", quoting=csv.QUOTE_MINIMAL)
    if table is not None:
        return lambda item, dissector: table.add([*shown.first, *rows.typed(item, dissector, session)])
    if args.csv:
        return lambda item, dissector: writer.writerow(
            [plain_cell(value) for value in (*shown.first, *rows.to_json(item, dissector, session).values())]
        )
    if args.table:
        return lambda item, dissector: writer.writerow(_cells(shown, item, dissector))
    if args.json:
        return lambda item, dissector: print(rows.json_line(item, dissector, session, args.fields, shown.source))
    return partial(_print_row, shown, dissector_for(session), arguments.colour())


def _print_row(shown: _Shown, usual: Dissector, colour: bool, item: JudgedRow, dissector: Dissector) -> None:
    """For people. `usual`: the protocol that is not named."""
    title = dissector.title if dissector is not usual else ""
    print(rows.text_line(item, dissector, shown.session, colour, title))
    if shown.args.tree:
        print(_tree(item, dissector, shown.session))
    if shown.args.hex:
        print(rows.hex_dump(item.row.event.octets))


def _show_in_bulk(
    shown: _Shown, capture: Capture, proof: SecondProof, wanted: Filter | None, left: int | None
) -> int | None:
    """The rows before the first that may be one of a second protocol."""
    list_rows = _lister_of_many(shown)
    watched = Watched(capture, prints=True)
    for settled_rows in settled_columns(watched, shown.session, proof) if left != 0 else ():
        places, first = _chosen(settled_rows, wanted), settled_rows.table.first
        if proof.name:
            places = places[places + first < proof.since]
        if left is not None:
            places = places[:left]
            left -= len(places)
        if len(places):
            list_rows(settled_rows, places)
        if left == 0 or (proof.name and first + settled_rows.end > proof.since):
            break
    return left


def _chosen(some: SettledRows, wanted: Filter | None) -> Times:
    if wanted is None:
        import numpy as np

        return np.arange(some.begin, some.end)
    from sniff.filter.choosing import chosen

    return chosen(some, wanted)


def _lister_of_many(shown: _Shown) -> Callable[[SettledRows, Times], None]:
    """What lists rows at some places."""
    args, session, table = shown.args, shown.session, shown.table
    dissector = dissector_for(session)
    if table is not None:
        from sniff.cli.row_columns import RowColumns

        columns = RowColumns(dissector, session)

        def added(some: SettledRows, places: Times) -> None:
            for cells in columns.cells(some, places.tolist(), rows.JSON_KEYS, lambda cell: cell, instants=True):
                table.add([*shown.first, *cells])

        return added
    made: RowCells | RowLines
    if args.csv or args.table or args.json:
        from sniff.cli.row_cells import RowCells, chosen, json_lines, separated

        if args.csv:
            made = RowCells(dissector, session, rows.JSON_KEYS, separated(len(rows.JSON_KEYS), ",", shown.first))
        elif args.table:
            names = [name for name in args.names if name != SOURCE]
            made = RowCells(dissector, session, names, chosen(args.names, shown.path))
        else:
            made = RowCells(dissector, session, rows.JSON_KEYS, json_lines(rows.JSON_KEYS, shown.source))
    else:
        from sniff.cli.row_lines import RowLines

        made = RowLines(dissector, session, arguments.colour())
    return lambda some, places: standard_streams.write(made.lines(some, places))


def _cells(shown: _Shown, item: JudgedRow, dissector: Dissector) -> list[Cell]:
    names, ours = shown.args.names, shown.ours
    fields = rows.fields_of(item, dissector)
    if any(name not in fields for name in names):
        fields = {**rows.to_json(item, dissector, shown.session), **fields, SOURCE: shown.path}
    return [
        ours.cell(name, item.row, item.transaction) if ours and name in ours else plain_cell(fields.get(name))
        for name in names
    ]


def _tree(item: JudgedRow, dissector: Dissector, session: Session) -> str:
    from sniff.analysis.row_tree import tree_of  # with what takes packets apart

    time_text = rows.iso if session.has_times else None
    return "\n".join(_tree_lines(tree_of(dissector, item.row, item.transaction, time_text, item.meaning), "        "))


def _tree_lines(fields: Iterable[Field], indent: str) -> Iterator[str]:
    for field in fields:
        yield f"{indent}{field.name}: {field.value}" if field.value else f"{indent}{field.name}"
        yield from _tree_lines(field.children, indent + "  ")
