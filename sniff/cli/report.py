"""One page of HTML that stands alone (no network, no script) and prints well: verdict, findings, stations, load and
errors over time, response times, token ring, and what the measurement cannot tell. Needs `pip install
'sniff485[report]'`; --json does not.
"""

from __future__ import annotations

import argparse
import importlib.util
import os
import sys
from pathlib import Path

from sniff.analysis.sanitizing import sanitized
from sniff.cli import UNREADABLE, USAGE, Failure, arguments, filtering, json_output
from sniff.cli.progress import Watched
from sniff.cli.writing import refuse_to_overwrite
from sniff.engine.capture import Capture
from sniff.formats.table import suffixes
from sniff.reporting.collecting import collect
from sniff.reporting.numbers import CaptureNumbers

LIBRARIES = ("jinja2", "matplotlib")

GENERATOR = b'<meta name="generator" content="sniff485 report">'
"""What every page says of itself."""


def configure(parser: argparse.ArgumentParser) -> None:
    """Options of `report`."""
    arguments.add_files(parser)
    arguments.add_line(parser)
    arguments.add_devices(parser)
    arguments.add_reference(parser)
    filtering.add_filter(parser, "only what matches, exchanges with a frame that does, and findings that one shows")
    parser.add_argument(
        "-o",
        "--output",
        metavar="OUT",
        help="the page (default: FILE's name with .html, beside it or in this folder); - for standard output",
    )
    parser.add_argument("-f", "--force", action="store_true", help="overwrite OUT, also where it is no such page")
    parser.add_argument("--json", action="store_true", help="the same numbers as JSON, one object a file, no page")


def run(args: argparse.Namespace) -> int:
    """Report on all captures, the parts of one recording as one."""
    if not args.json:
        require_libraries()
    place = args.output or ("-" if args.json else str(default_place(args.files[0])))
    if place != "-" and not _is_page(place):  # an earlier one is what everybody wants to be rid of
        refuse_to_overwrite(Path(place), args.files, args.force)
    reports = [_numbers(name, capture, args) for name, capture in arguments.open_captures(args.files)]
    if args.json:
        text = "".join(json_output.dumps(report.to_json()) + "\n" for report in reports)
    else:
        from sniff.reporting.page import page

        text = page(reports)
    if place == "-":
        sys.stdout.write(text)
        return 0
    try:
        Path(place).write_text(text, "utf-8", "backslashreplace")  # names need not be text
    except OSError as error:
        raise Failure(f"{place}: cannot be written: {error.strerror}", UNREADABLE) from None
    print(f"sniff485: report in {sanitized(place)}", file=sys.stderr)
    return 0


def _is_page(place: str) -> bool:
    """Whether a report stands there."""
    try:
        with open(place, "rb") as file:
            return GENERATOR in file.read(1024)
    except OSError:
        return False


def require_libraries() -> None:
    """End with one line when a library of the page is absent."""
    absent = [name for name in LIBRARIES if importlib.util.find_spec(name) is None]
    if absent:
        raise Failure(f"report needs {' and '.join(absent)}: pip install 'sniff485[report]'", USAGE)


def default_place(file: str) -> Path:
    """The capture's name with .html, beside it where one may write, else in this folder."""
    path = Path("standard-input" if file == "-" else file)
    suffix = next((suffix for suffix in suffixes() if path.name.lower().endswith(suffix)), path.suffix)
    name = f"{path.name[: -len(suffix)] if suffix else path.name}.html"
    return path.with_name(name) if os.access(path.parent, os.W_OK) else Path(name)


def _numbers(path: str, capture: Capture, args: argparse.Namespace) -> CaptureNumbers:
    session = arguments.settings_of(args, capture.session, path)
    devices = arguments.noted_devices(args, session)
    wanted = filtering.filter_of(args, capture, session, devices) if args.filter else None
    name = f"{Path(path).name}, only {args.filter}" if args.filter else Path(path).name
    return collect(name, capture, session, devices, Watched(capture), args.reference, wanted)
