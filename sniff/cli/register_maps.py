"""`profile import`: a device profile out of a register map that somebody else wrote."""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from dissectors.profiles import ProfileError, parse_text
from dissectors.profiles.parsing import is_name
from sniff.analysis.plain import plain
from sniff.cli import UNREADABLE, USAGE, Failure, arguments, writing

if TYPE_CHECKING:
    from sniff.analysis.register_map import RegisterMap

LARGEST = 16 << 20
"""Octets of a map that are read at most."""

NUMBERINGS = ("auto", "40001", "0", "1")
TABLES = ("holding", "input", "coil", "discrete")
_YAML = (".yaml", ".yml")
_WORKSPACES = (".mbp", ".mbw", ".mbs")


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
    from sniff.analysis.register_map import document

    if args.write is not None:
        writing.refuse_to_overwrite(args.write, [args.file], args.force)
    found = _of_station(args, _read(args))
    name = args.name or _name_of(args.file)
    text, count = document(name, f"imported from {Path(args.file).name}", found)
    if not count:
        raise Failure(f"{args.file}: no register that can be read", UNREADABLE)
    try:
        parse_text(text, name)
    except ProfileError as error:  # then the document says what is to be corrected
        print(f"sniff485: to be corrected by hand: {plain(error)}", file=sys.stderr)
    write_document(args, text)
    where = f" to {plain(args.write)}" if args.write is not None else ""
    print(f"sniff485: {count} registers imported{where}; {'; '.join(map(plain, found.said))}", file=sys.stderr)
    for what, times in sorted(found.left_out.items()):
        print(f"sniff485: left out: {plain(what)} ({times})", file=sys.stderr)
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


def _read(args: argparse.Namespace) -> RegisterMap:
    """The map in a file, by what is in it."""
    path, text = Path(args.file), _text_of(args.file)
    if path.suffix.lower() in _YAML or re.search(r"^modbus:", text, re.MULTILINE):
        return _home_assistant(args.file, text)
    from sniff.analysis.register_map_csv import read_csv

    found = read_csv(text, args.numbering, args.table)
    if found is None:
        raise Failure(
            f"{args.file}: no line has a heading for the number of a register (address, register …), with commas, "
            "semicolons, tabs or bars between the columns",
            UNREADABLE,
        )
    return found


def _text_of(name: str) -> str:
    path = Path(name)
    if path.suffix.lower() in _WORKSPACES:
        raise Failure(
            f"{name}: the form of a Modbus Poll workspace is not published; copy its table, or log it as text, "
            "and import that with a heading line such as address,name,type",
            USAGE,
        )
    try:
        if name == "-":
            octets = sys.stdin.buffer.read(LARGEST + 1)
        else:
            with path.open("rb") as file:
                octets = file.read(LARGEST + 1)
    except OSError as error:
        raise Failure(f"{name}: {error.strerror or error}", UNREADABLE) from None
    if len(octets) > LARGEST:
        raise Failure(f"{name}: over {LARGEST >> 20} MiB is no register map", UNREADABLE)
    if octets.startswith((b"PK\x03\x04", b"\xd0\xcf\x11\xe0")):
        raise Failure(f"{name}: a spreadsheet file; save the sheet as CSV and import that", USAGE)
    for encoding in ("utf-16",) if octets[:2] in (b"\xff\xfe", b"\xfe\xff") else ("utf-8-sig", "cp1252"):
        try:
            return octets.decode(encoding)
        except UnicodeDecodeError:
            continue
    return octets.decode("latin-1")


def _home_assistant(name: str, text: str) -> RegisterMap:
    from sniff.analysis.register_map_yaml import read_home_assistant

    try:
        import yaml
    except ImportError:
        raise Failure("YAML needs PyYAML: pip install 'sniff485[yaml]'", USAGE) from None

    class Loader(yaml.SafeLoader):
        """As safe as its parent; `!include`, `!secret` and other tags of Home Assistant stand for nothing."""

    Loader.add_multi_constructor("!", lambda loader, suffix, node: f"!{suffix}")
    try:
        data = yaml.load(text, Loader)  # a SafeLoader makes nothing but plain values
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        said = str(error).replace("\n", " ") or "nested too deeply"
        raise Failure(f"{name}: {said}", UNREADABLE) from None
    found = read_home_assistant(data)
    if found is None:
        raise Failure(f"{name}: no modbus: with sensors, switches or the like", UNREADABLE)
    return found


def _name_of(file: str) -> str:
    """The file's own name as that of a profile."""
    slug = re.sub(r"[^A-Za-z0-9_-]+", "-", Path(file).stem).strip("-_")
    return slug if is_name(slug) else "device"
