"""For testing other software: it sees the bus as it was. Never onto a real port: the octets of a capture on a live
bus would be taken for commands. The replay begins when somebody opens what is printed.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from sniff.cli import PORT_TROUBLE, USAGE, Failure, arguments, filtering
from sniff.cli.interruption import until_interrupted


def configure(parser: argparse.ArgumentParser) -> None:
    """Options of `replay`."""
    parser.add_argument("file", metavar="FILE", help="capture")
    arguments.add_bus(parser)
    parser.add_argument(
        "--to", required=True, metavar="pty|tcp|tcp:PORT", help="a new pseudo-terminal, or a TCP port of this machine"
    )
    filtering.add_filter(parser, "only the octets of frames that match")
    parser.add_argument("--speed", type=float, default=1.0, metavar="X", help="2 is twice as fast (default: 1)")


def run(args: argparse.Namespace) -> int:
    """Play one capture."""
    from sniff.simulation.replaying import PtyReplay, Replay, TcpReplay

    if not args.speed > 0:
        raise Failure(f"--speed {args.speed}: expected more than 0", USAGE)
    kind, _, number = args.to.partition(":")
    is_number = number.isascii() and number.isdigit() and len(number) < 6 and int(number) < 1 << 16
    if kind not in {"pty", "tcp"} or (number and (kind == "pty" or not is_number)):
        raise Failure(
            f"--to {args.to}: refused; a capture is only played to pty, tcp or tcp:PORT, never to a port", USAGE
        )
    capture = arguments.open_capture(args.file)  # says what is wrong with the file before anything is opened
    arguments.say_assumed(capture.session, args.file)
    played = filtering.sifted(args, capture, capture.session)
    if args.filter and filtering.is_empty(played):
        raise Failure(f"{args.file}: no octets of frames that match; nothing to play", USAGE)
    try:
        replay: Replay = (
            PtyReplay(Path(args.file), args.speed)
            if kind == "pty"
            else TcpReplay(Path(args.file), args.speed, int(number or 0))
        )
    except OSError as error:
        raise Failure(f"--to {args.to}: {error.strerror or error}", PORT_TROUBLE) from None
    if args.filter:
        replay.capture = played
    with replay, until_interrupted() as caught:
        print(replay.port, flush=True)
        while not caught and not replay.wait(0.1):
            pass
    if replay.error:
        raise Failure(f"{args.file}: {replay.error}", PORT_TROUBLE)
    print(f"sniff485: {replay.sent} octets played", file=sys.stderr)
    return 130 if caught else 0
