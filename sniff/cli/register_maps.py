"""`profile import`: a device profile out of a register map that somebody else wrote."""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Callable
from pathlib import Path

from dissectors import registry
from dissectors.profiles import ProfileError
from dissectors.profiles.packaged import parse_text
from dissectors.profiles.parsing import is_name
from dissectors.register_maps import NUMBERINGS, TABLES, MapError, MapReader, RegisterMap, document
from sniff.analysis.sanitizing import sanitized
from sniff.cli import UNREADABLE, USAGE, Failure, arguments, writing

LARGEST = 16 << 20
"""Octets of a map that are read at most."""


def configure(
    parser: argparse.ArgumentParser, add_document: Callable[[argparse.ArgumentParser, str | None], None]
) -> None:
    """Options of `profile import`."""
    parser.add_argument(
        "file", metavar="MAP", help=".csv, .tsv, .txt with headings; .yaml of Home Assistant; - for CSV"
    )
    parser.add_argument(
        "--numbering",
        choices=NUMBERINGS,
        default="auto",
        help="how a table's numbers are to be read: 40001-style, as on the wire (0), one more (1); auto: 40001-style "
        "where all can be, else as on the wire",
    )
    parser.add_argument("--table", choices=TABLES, help="which table, where a map does not say it (default: holding)")
    parser.add_argument("--station", type=arguments.whole, metavar="N", help="which one, where the map has several")
    add_document(parser, None)


def run(args: argparse.Namespace) -> int:
    """Read the map, write the profile, say what could not be taken over."""
    knowing = [one for one in registry.usable() if one.register_maps is not None]
    reader, family = knowing[0].register_maps, knowing[0].profile_family
    assert reader is not None
    protocols = [one.name for one in knowing if one.profile_family == family]
    if args.write is not None:
        writing.refuse_to_overwrite(args.write, [args.file], args.force)
    found = _of_station(args, _read(args, reader))
    name = args.name or _name_of(args.file)
    text, count = document(name, f"imported from {Path(args.file).name}", found, family, protocols)
    if not count:
        raise Failure(f"{args.file}: no register that can be read", UNREADABLE)
    try:
        parse_text(text, name)
    except ProfileError as error:  # then the document says what is to be corrected
        print(f"sniff485: to be corrected by hand: {sanitized(error)}", file=sys.stderr)
    write_document(args, text)
    where = f" to {sanitized(args.write)}" if args.write is not None else ""
    print(f"sniff485: {count} registers imported{where}; {'; '.join(map(sanitized, found.said))}", file=sys.stderr)
    for what, times in sorted(found.left_out.items()):
        print(f"sniff485: left out: {sanitized(what)} ({times})", file=sys.stderr)
    return 0


def write_document(args: argparse.Namespace, document: str) -> None:
    """To -w, else to standard output."""
    if args.write is None:
        print(document, end="")
        return
    try:
        args.write.write_text(document, encoding="utf-8")
    except OSError as error:
        raise Failure(f"{args.write}: {error.strerror or error}", UNREADABLE) from None


def _of_station(args: argparse.Namespace, found: RegisterMap) -> RegisterMap:
    stations = found.stations
    if args.station is not None:
        if stations and args.station not in stations:
            raise Failure(f"{args.file}: no station {args.station}; there are {_listed(stations)}", USAGE)
        return found.of_station(args.station)
    if len(stations) > 1:
        raise Failure(f"{args.file}: describes stations {_listed(stations)}: name one with --station", USAGE)
    return found


def _listed(stations: list[int]) -> str:
    return ", ".join(map(str, stations))


def _read(args: argparse.Namespace, reader: MapReader) -> RegisterMap:
    """The map in a file."""
    try:
        if args.file == "-":
            octets = sys.stdin.buffer.read(LARGEST + 1)
        else:
            with Path(args.file).open("rb") as file:
                octets = file.read(LARGEST + 1)
    except OSError as error:
        raise Failure(f"{args.file}: {error.strerror or error}", UNREADABLE) from None
    if len(octets) > LARGEST:
        raise Failure(f"{args.file}: over {LARGEST >> 20} MiB is no register map", UNREADABLE)
    try:
        return reader(args.file, octets, args.numbering, args.table)
    except MapError as error:
        raise Failure(f"{args.file}: {error}", UNREADABLE) from None


def _name_of(file: str) -> str:
    """The file's own name as that of a profile."""
    slug = re.sub(r"[^A-Za-z0-9_-]+", "-", Path(file).stem).strip("-_")
    return slug if is_name(slug) else "device"
