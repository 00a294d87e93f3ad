"""Frames as a table in a file, CSV or Parquet: what `show --csv` and `show --parquet` give, by `convert`."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from pathlib import Path

from dissectors.findings import counted
from dissectors.profiles import Devices
from sniff.analysis.sanitizing import sanitized
from sniff.bus.row_files import save
from sniff.bus.second_protocol import Judged
from sniff.cli import UNREADABLE, USAGE, Failure, filtering, writing
from sniff.cli.listed_rows import ListedRows
from sniff.engine.capture import Capture, CaptureError
from sniff.engine.session import Session
from sniff.formats import parquet


def write(args: argparse.Namespace, capture: Capture, session: Session, devices: Devices) -> None:
    """Write the frames of a capture to `args.output` and say how many rows. Ends with exit code 2 or 3."""
    if args.link_type is not None:
        raise Failure(f"{args.output}: a table of frames has no --link-type", USAGE)
    target = Path(args.output)
    writing.refuse_to_overwrite(target, [args.source], args.force)
    is_parquet = target.name.lower().endswith(".parquet")
    if is_parquet and not parquet.available():
        raise Failure(f"{target}: needs polars: pip install 'sniff485[parquet]'", USAGE)
    try:
        count = save(target, _rows(args, capture, session, devices), session)
    except CaptureError as error:
        raise Failure(str(error), UNREADABLE) from None
    print(f"{sanitized(target)}: {counted(count, 'row')}, frames and what was between them", file=sys.stderr)


def _rows(args: argparse.Namespace, capture: Capture, session: Session, devices: Devices) -> Iterator[Judged]:
    proof, wanted = filtering.filter_of_both(args, capture, session, devices)
    return ListedRows(args, capture, session, proof, wanted).all(devices or None)
