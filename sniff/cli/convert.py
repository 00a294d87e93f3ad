"""The suffix of OUT chooses the format. What a format cannot keep is said."""

from __future__ import annotations

import argparse

from sniff.cli import arguments, writing


def configure(parser: argparse.ArgumentParser) -> None:
    """Options of `convert`."""
    parser.add_argument("source", metavar="IN", help="capture to read")
    parser.add_argument("output", metavar="OUT", help="capture to write")
    arguments.add_line(parser)
    parser.add_argument(
        "--link-type",
        type=int,
        choices=[147, 165, 250, 252],
        help="pcap, pcapng: 252 exported PDU (default for Modbus RTU; opens in Wireshark as it is), 147 bare RTU "
        "(needs a DLT_USER entry for mbrtu), 250 RTAC serial with line errors (Decode As: RTAC Serial → Modbus RTU), "
        "165 MS/TP",
    )
    parser.add_argument("-f", "--force", action="store_true", help="overwrite OUT")


def run(args: argparse.Namespace) -> int:
    """Read, write, say what was lost."""
    capture = arguments.open_capture(args.source)
    session = arguments.settings_of(args, capture.session)
    options = {"link-type": str(args.link_type)} if args.link_type is not None else None
    writing.write(args, session, capture.items(), [args.source], options)
    writing.say_incomplete(args.source, capture)
    return 0
