"""Two captures of one line, taken at the same time at two places (both sides of a repeater, a gateway, a stretch of
cable): every frame matched, how long it took, what is damaged or missing on one side only, and on which side the fault
is. Exit code 1 when there is one.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

from dissectors.words import duration
from sniff.analysis.sanitizing import sanitized
from sniff.bus.offline import survey
from sniff.cli import USAGE, Failure, arguments, json_output, tables
from sniff.cli.progress import Watched
from sniff.engine.capture import Capture
from sniff.engine.session import Session
from sniff.taps.frames import TapEar
from sniff.taps.matching import matched
from sniff.taps.verdict import SegmentFault, faults, traffic


def configure(parser: argparse.ArgumentParser) -> None:
    """Options of `taps`."""
    parser.add_argument(
        "words", nargs="+", metavar="A B", help="two captures on one clock; or one capture and two buses in it"
    )
    arguments.add_line(parser)
    arguments.add_reference(parser)
    style = parser.add_mutually_exclusive_group()
    style.add_argument("--json", action="store_const", const="json", dest="style", help="one JSON object a sender")
    style.add_argument("--csv", action="store_const", const="csv", dest="style", help="comma-separated values")
    parser.set_defaults(style="text")


def run(args: argparse.Namespace) -> int:
    """Compare two taps."""
    from sniff.taps import words

    ears, doubts = [], []
    taps = _taps(args.words)
    spoken = []
    for path, capture in taps:
        session = arguments.settings_of(args, capture.session, path)
        spoken.append(session.protocol)
        if not session.has_times:
            raise Failure(f"{path}: does not say when anything came; taps are compared by times", USAGE)
        ear = TapEar()
        survey(Watched(capture), session, ear, reference=args.reference)
        ears.append(ear)
        doubts.append(_doubt(session))
    if spoken[0] != spoken[1]:
        raise Failure(f"A is {spoken[0]}, B is {spoken[1]}: these are not two taps on one line; -p names both", USAGE)
    doubt = sum(doubts)
    first, second = (ear.frames() for ear in ears)
    senders = traffic(first, second, matched(first, second, doubt, (ears[0].holes, ears[1].holes)))
    is_one_clock = len(args.words) != 2 or not Path(args.words[1]).exists()
    found = faults(senders, doubt, is_one_clock)
    tables.write(words.HEADINGS if args.style == "text" else words.KEYS, words.rows(senders), args.style)
    if args.style == "json":
        for fault in found:
            print(json_output.dumps(words.as_value(fault)))
    if args.style == "text":
        print(f"A: {sanitized(taps[0][0])}, B: {sanitized(taps[1][0])}; {words.certainty(doubt, is_one_clock)}")
        _say(found, bool(senders), any(one.both for one in senders.values()))
        for name, ear in zip(words.TAPS, ears, strict=True):
            if ear.holes.total:
                print(f"left out: {duration(ear.holes.total)} in which {name} heard nothing, by its own account")
    return 1 if found else 0


def _taps(words: Sequence[str]) -> list[tuple[str, Capture]]:
    """Two captures by name, or two buses of one; ends with exit code 2 for anything else."""
    path, *names = words
    if len(names) == 1 and Path(names[0]).exists():
        return [(each, arguments.open_capture(each)) for each in words]
    buses = arguments.open_buses(path)
    by_name = {capture.session.bus: (label, capture) for label, capture in buses}
    wanted = names or list(by_name)
    missing = [name for name in wanted if name not in by_name]
    if missing:
        there = ", ".join(by_name)
        raise Failure(f"{missing[0]}: no such file, and no such bus in {path}; there is {there}", USAGE)
    if len(wanted) != 2:
        raise Failure(f"two taps are compared: {path} has {', '.join(by_name)}; name two", USAGE)
    return [by_name[name] for name in wanted]


def _say(found: Sequence[SegmentFault], heard: bool, common: bool) -> None:
    from sniff.taps import words

    if not heard:
        print("no frame was heard while both taps listened")
    elif not common:
        print("not one frame was heard at both: two lines, two times, or nothing passes; nothing more can be said")
    elif not found:
        print("nothing is wrong between the taps")
    for fault in found:
        print(words.sentence(fault))


def _doubt(session: Session) -> int:
    """ns by which a frame's time may be off: what the adapter holds back, and a character."""
    return session.timing.latency + session.timing.char
