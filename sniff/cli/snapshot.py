"""Writes, or with --check compares, FILE.expect.txt beside each capture: frames, transactions, findings. The pytest
plugin does the same: `pytest --sniff-update`.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from sniff.analysis.sanitizing import sanitized
from sniff.cli import UNREADABLE, Failure, arguments, filtering
from sniff.engine.capture import CaptureError

if TYPE_CHECKING:
    from sniff.testing import CaptureReading


def configure(parser: argparse.ArgumentParser) -> None:
    """Options of `snapshot`."""
    parser.add_argument("files", nargs="+", metavar="FILE", help="capture")
    filtering.add_filter(parser, "only what matches, and findings with such a frame among their evidence")
    parser.add_argument("--check", action="store_true", help="write nothing; exit code 1 and a diff where one differs")


def run(args: argparse.Namespace) -> int:
    """Write or compare expectations."""
    from sniff.testing import expectation_path, read_capture, render
    from sniff.testing.expectation import difference

    differing = 0
    for name in args.files:
        path = Path(name)
        place, reading = expectation_path(path), read_capture(path)
        arguments.say_assumed(arguments.open_capture(name).session, name)
        found = render(_of_filter(args, reading))
        try:
            expected = place.read_text(encoding="utf-8") if place.exists() else ""
            if not args.check and expected != found:
                place.write_text(found, encoding="utf-8")
                print(f"{sanitized(place)}: written")
        except OSError as error:
            raise Failure(f"{place}: {error.strerror}", UNREADABLE) from None
        except UnicodeDecodeError:
            raise Failure(f"{place}: not in UTF-8, so nothing that was written here; remove it", UNREADABLE) from None
        except CaptureError as error:
            raise Failure(str(error), UNREADABLE) from None
        if args.check and expected != found:
            differing += 1
            said = difference(expected, found, place.name).splitlines() if expected else [f"{place}: no expectation"]
            print("\n".join(map(sanitized, said)))
    if differing:
        print(f"sniff485: {differing} of {len(args.files)} captures differ", file=sys.stderr)
    return 1 if differing else 0


def _of_filter(args: argparse.Namespace, reading: CaptureReading) -> CaptureReading:
    """What -Y accepts of a reading."""
    if not args.filter:
        return reading
    wanted = filtering.filter_of(args, arguments.open_capture(str(reading.path)), reading.session)
    rows = tuple(item for item in reading.rows if wanted(item.row, item.transaction))
    numbers = {item.row.no for item in rows}
    return replace(
        reading,
        rows=rows,
        transactions=tuple(one for one in reading.transactions if numbers.intersection((one.request, one.response))),
        findings=tuple(one for one in reading.findings if numbers.intersection(one.evidence)),
        points=(),
    )
