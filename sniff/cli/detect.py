"""Listens only; the port is opened once and its settings are changed in place. Stops as soon as what is heard
suffices; a silent bus is told from a wrong setting. Exit code 0 when found, 4 when not.

Of a file its octets tell the protocol; its settings are those that it says, or that the times of its octets tell. Exit
code 0 when found, 3 when not.
"""

from __future__ import annotations

import argparse
import shlex
from dataclasses import replace

from dissectors import registry
from dissectors.words import percent
from sniff.analysis.autodetect import Candidature, Ending, Outcome, sureness
from sniff.analysis.sanitizing import sanitized
from sniff.analysis.told_protocol import Sureness, detected, told_by
from sniff.cli import PORT_TROUBLE, UNREADABLE, arguments, json_output, listening, targets, watching
from sniff.cli.searching import TIMEOUT, search, sentence
from sniff.engine.session import AUTO, Session, with_settings


def configure(parser: argparse.ArgumentParser) -> None:
    """Options of `detect`."""
    parser.add_argument("port", metavar="PORT", help="port, gateway, a configured bus, or a capture file")
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
        help="give up after (default: 2m); a bus that talks seldom needs longer",
    )
    parser.add_argument("--json", action="store_true", help="one JSON object")


def run(args: argparse.Namespace) -> int:
    """Search, and say what was found."""
    if watching.is_file(args.port):
        return of_file(args)
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


def of_file(args: argparse.Namespace) -> int:
    """Say what the octets of a file are, bus by bus."""
    found = True
    for name, capture in arguments.open_buses(args.port):
        outcome, told = _of_session(args, capture.session)
        found = found and outcome.ending is Ending.FOUND
        if args.json:
            print(json_output.dumps(to_json(name, outcome)))
        else:
            of_several = "" if name == args.port else f" --bus {shlex.quote(sanitized(capture.session.bus))}"
            write(name, outcome, told, f"open {shlex.quote(sanitized(args.port))}{of_several}")
    return 0 if found else UNREADABLE


def _of_session(args: argparse.Namespace, session: Session) -> tuple[Outcome, str]:
    """What is found in the octets of a capture, and what more is to be said of it."""
    if args.line not in (None, AUTO):
        session = with_settings(session, None, args.line)
    told = told_by(session, args.protocol if args.protocol != AUTO else None)
    octets = sum(len(chunk.octets) for chunk in session.sample)
    reading = told.reading
    if reading is None or told.sureness is Sureness.NO:
        return Outcome(Ending.UNKNOWN if octets else Ending.SILENT, None, 1, octets), told.neighbour and told.words
    cannot: tuple[str, ...] = ()
    line = session.line
    if session.line_is_assumed and reading.protocol not in registry.RELATIVES:
        line = detected(replace(session, protocol=reading.protocol, line=reading.line)).line
        cannot = (
            (f"the format beside {line.baud} Bd, which the times of its octets tell",)
            if line.baud != reading.line.baud
            else (f"rate and format: the file does not say them; {line} is usual",)
        )
    ending = Ending.FOUND if told.sureness is Sureness.SURE else Ending.LIKELY
    also = ""
    if told.second is not None:
        name, frames = told.second
        also = f"with foreign frames that read as {registry.get(name).title} ({frames})"
    return Outcome(ending, replace(reading, line=line), 1, octets, cannot), also


def write(port: str, outcome: Outcome, also: str = "", opened: str = "") -> None:
    """Print for people. `opened`: of a file, by which command it is looked at."""
    if opened and outcome.reading is None:
        print(f"{sanitized(port)}: {also or _of_no_protocol(outcome)}")
        return
    print(f"{sanitized(port)}: {sentence(outcome)}")
    reading = outcome.reading
    if reading is None:
        return
    print(f"  {evidence(reading)}")
    if also:
        print(f"  {also}")
    for words in outcome.cannot_tell:
        print(f"  cannot tell {words}")
    if opened:
        print(f"  next: sniff485 {opened} -p {reading.protocol}")
    else:
        print(f"  next: sniff485 live {shlex.quote(sanitized(port))} -s {reading.line} -p {reading.protocol}")


def _of_no_protocol(outcome: Outcome) -> str:
    if outcome.ending is Ending.SILENT:
        return "no octets in it"
    return f"no protocol makes good frames of its first {outcome.octets} octets; -p names one all the same"


def evidence(reading: Candidature) -> str:
    """Why it is believed."""
    frames = "1 good frame holds" if reading.frames == 1 else f"{reading.frames} good frames hold"
    return (
        f"{frames} {percent(reading.covered, 0)} of {reading.octets} octets; {sureness(reading)}"
        f"{f'; {percent(reading.marked, 0)} of the octets came with line errors' if reading.marked else ''}"
    )


def to_json(port: str, outcome: Outcome) -> dict[str, object]:
    """One object; keys and their order are a promise."""
    reading = outcome.reading
    return {
        "port": port,
        "outcome": outcome.ending.value,
        "line": None if reading is None or reading.protocol in registry.RELATIVES else str(reading.line),
        "protocol": None if reading is None else reading.protocol,
        "evidence_bits": None if reading is None else round(reading.bits, 1),
        "frames": None if reading is None else reading.frames,
        "octets": outcome.octets,
        "covered": None if reading is None else round(reading.covered, 3),
        "tried": outcome.tried,
        "cannot_tell": list(outcome.cannot_tell),
    }
