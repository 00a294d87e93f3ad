"""The suffix of OUT chooses the format; .csv and .parquet are tables of frames. What a format cannot keep is said. An
.mcap also holds the values of devices that have a profile (-d), each point on a channel of its own.
"""

from __future__ import annotations

import argparse

from dissectors.profiles import Devices
from sniff.analysis.judging import Judging
from sniff.bus.capture_writer import PacketOptions
from sniff.bus.marked_rows import MarkedRows
from sniff.bus.offline import survey
from sniff.cli import USAGE, Failure, arguments, filtering, writing
from sniff.cli.incomplete import say_incomplete
from sniff.cli.progress import Watched
from sniff.devices import with_devices
from sniff.engine.capture import Capture
from sniff.engine.follow_settings import dissector_for
from sniff.engine.session import Session
from sniff.formats import table
from sniff.formats.linktypes import held_by_protocols, written_link_types

TABLES = (".csv", ".parquet")
"""Suffixes of tables of frames."""


def configure(parser: argparse.ArgumentParser) -> None:
    """Options of `convert`."""
    parser.add_argument("source", metavar="IN", help="capture to read")
    parser.add_argument("output", metavar="OUT", help="capture to write")
    arguments.add_bus(parser)
    arguments.add_line(parser)
    arguments.add_devices(parser)
    arguments.add_reference(parser)
    filtering.add_filter(parser, "only the octets of frames that match")
    parser.add_argument(
        "--link-type",
        type=int,
        choices=written_link_types(),
        help="pcap, pcapng: 252 exported PDU and 165 open in Wireshark as they are, 147 is the bare frame (needs a "
        "DLT_USER entry), 250 RTAC serial with line errors (needs Decode As); others are bare frames of one protocol. "
        f"What can hold what, the default first: {held_by_protocols()}",
    )
    parser.add_argument("--microseconds", action="store_true", help=".pcap: times in µs, for programs that know no ns")
    parser.add_argument("-f", "--force", action="store_true", help="overwrite OUT")


def run(args: argparse.Namespace) -> int:
    """Read, write, say what was lost."""
    suffixes = dict.fromkeys((*table.writers("items_writer"), *table.writers("frames_writer"), *TABLES))
    if not args.output.lower().endswith(tuple(suffixes)):
        raise Failure(f"{args.output}: unknown suffix; expected one of {' '.join(suffixes)}", USAGE)
    capture = arguments.open_capture(args.source)
    session = arguments.settings_of(args, capture.session, args.source)
    if args.output.lower().endswith(TABLES):
        from sniff.cli import frame_table

        frame_table.write(args, capture, session, arguments.noted_devices(args, session))
        say_incomplete(args.source, capture)
        return 0
    if args.microseconds and not args.output.lower().endswith((".pcap", ".cap")):
        raise Failure(f"{args.output}: --microseconds is for .pcap", USAGE)
    devices = arguments.noted_devices(args, session)
    session = with_devices(session, devices)
    noted = args.output.lower().endswith(".pcapng") and not args.filter  # of a part the rows have other numbers
    notes, marks = _evidence(capture, session, devices, args.reference) if noted else ({}, {})
    packets = PacketOptions(args.link_type, args.microseconds, notes, marks)
    source = filtering.sifted(args, capture, session, devices)
    writing.write(args, session, source, [args.source], devices=devices, packets=packets)
    say_incomplete(args.source, capture)
    return 0


def _evidence(
    capture: Capture, session: Session, devices: Devices, reference: bool
) -> tuple[dict[int, str], dict[int, str]]:
    """The findings in words, and what people wrote, by the rows that they are about."""
    judging, marked = Judging(session, dissector_for(session), devices), MarkedRows()
    survey(Watched(writing.with_comments(capture)), session, judging, marked, reference=reference)
    notes: dict[int, str] = {}
    for finding in judging.findings():
        said = f"{finding.code} {finding.subject}: {finding.seen}"
        for no in finding.evidence:
            notes[no] = f"{notes[no]}; {said}" if no in notes else said
    return notes, marked.by_row()
