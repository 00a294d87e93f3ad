"""Listens only; the port is opened once and its settings are changed in place. Stops as soon as what is heard
suffices; a silent bus is told from a wrong setting. Exit code 0 when found, 4 when not.
"""

from __future__ import annotations

import argparse

from sniff.analysis.autodetect import Ending, Outcome, Reading, sureness
from sniff.analysis.plain import plain
from sniff.cli import PORT_TROUBLE, arguments, json_output, listening, targets
from sniff.cli.searching import TIMEOUT, search, sentence
from sniff.config import AUTO


def configure(parser: argparse.ArgumentParser) -> None:
    """Options of `detect`."""
    parser.add_argument("port", metavar="PORT", help="port, gateway, or a configured bus")
    parser.add_argument(
        "-s", "--line", type=arguments.line_settings, metavar="LINE", help="these settings; search the protocol only"
    )
    parser.add_argument(
        "-p", "--protocol", type=arguments.protocol, metavar="PROTOCOL", help="this protocol; search the settings only"
    )
    parser.add_argument(
        "--timeout",
        type=arguments.duration,
        default=TIMEOUT,
        metavar="TIME",
        help="give up after (default 2m); a bus that talks seldom needs longer",
    )
    parser.add_argument("--json", action="store_true", help="one JSON object")


def run(args: argparse.Namespace) -> int:
    """Search, and say what was found."""
    args.line, args.protocol = args.line or AUTO, args.protocol or AUTO
    target = targets.target_of(args)
    assert target.search is not None
    with listening.start_link([target.source], None) as link:
        outcome = search(link, target.search, args.timeout)
    if args.json:
        print(json_output.dumps(to_json(args.port, outcome)))
    else:
        write(args.port, outcome)
    return 0 if outcome.ending is Ending.FOUND else PORT_TROUBLE


def write(port: str, outcome: Outcome) -> None:
    """Print for people."""
    print(f"{plain(port)}: {sentence(outcome)}")
    reading = outcome.reading
    if reading is None:
        return
    print(f"  {evidence(reading)}")
    for words in outcome.cannot_tell:
        print(f"  cannot tell {words}")
    print(f"  next: sniff485 live {port} -s {reading.line} -p {reading.protocol}")


def evidence(reading: Reading) -> str:
    """Why it is believed."""
    return (
        f"{reading.frames} good frames hold {reading.covered:.0%} of {reading.octets} octets; {sureness(reading)}"
        f"{f'; {reading.marked:.0%} of the octets came with line errors' if reading.marked else ''}"
    )


def to_json(port: str, outcome: Outcome) -> dict[str, object]:
    """One object; keys and their order are a promise."""
    reading = outcome.reading
    return {
        "port": port,
        "outcome": outcome.ending.value,
        "line": None if reading is None else str(reading.line),
        "protocol": None if reading is None else reading.protocol,
        "evidence_bits": None if reading is None else round(reading.bits, 1),
        "frames": None if reading is None else reading.frames,
        "octets": outcome.octets,
        "covered": None if reading is None else round(reading.covered, 3),
        "tried": outcome.tried,
        "cannot_tell": list(outcome.cannot_tell),
    }
