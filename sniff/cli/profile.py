"""list: what there is. show NAME: registers, objects, limits. check FILE…: whether profiles are right. guess CAPTURE…:
which profiles fit the stations that were heard. draft CAPTURE…: a profile of a station that has none, from what its
registers did; types, orders and uses are guesses, with how sure. import MAP: a profile out of a register map: a table
as CSV with headings (address, name, type, scale, unit, function …), or the YAML of Home Assistant. Own profiles:
./profiles/NAME.toml, or the user's folder.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dissectors.line import MS
from dissectors.profiles import ProfileError
from dissectors.profiles.decoding import bare_range, number, plain_name, state_words
from dissectors.profiles.model import Entry, Limits, Profile
from dissectors.profiles.parsing import is_name
from sniff.analysis.sanitizing import sanitized
from sniff.bus.offline import survey
from sniff.cli import UNREADABLE, USAGE, Failure, arguments, json_output, register_maps, tables, writing
from sniff.cli.incomplete import say_incomplete
from sniff.cli.progress import Watched
from sniff.devices import UnknownProfile, available, find, read
from sniff.engine.follow_settings import dissector_for

if TYPE_CHECKING:
    from sniff.analysis.profile_guess import Guess
    from sniff.analysis.register_series import RegisterSeries

TIE = 0.1
"""Share by which a profile must fit better than another to be preferred."""
ENTRY_HEADINGS = ("place", "point", "unit", "range", "access", "what")


def configure(parser: argparse.ArgumentParser) -> None:
    """`list`, `show`, `check`, `guess`, `draft` and `import`."""
    actions = parser.add_subparsers(dest="action", metavar="ACTION", required=True)
    listing = actions.add_parser("list", help="profiles by name, with where they are from")
    listing.add_argument("--json", action="store_true", help="one JSON object a profile")
    show = actions.add_parser("show", help="what a profile says")
    show.add_argument("name", metavar="NAME", help="a profile's name, or a .toml file")
    show.add_argument("--json", action="store_true", help="one JSON object a register or object")
    check = actions.add_parser("check", help="read profiles and say what is wrong with them")
    check.add_argument("files", nargs="+", metavar="FILE", help="a .toml file, or a profile's name")
    guess = actions.add_parser("guess", help="profiles that fit the stations of a capture")
    arguments.add_files(guess)
    arguments.add_line(guess)
    arguments.add_reference(guess)
    guess.add_argument("--json", action="store_true", help="one JSON object a guess")
    draft = actions.add_parser("draft", help="a profile of a station that has none, to be corrected by hand")
    arguments.add_files(draft)
    arguments.add_line(draft)
    arguments.add_reference(draft)
    draft.add_argument("--station", type=arguments.whole, metavar="N", help="which one, where several were heard")
    draft.add_argument(
        "--table", choices=["holding", "input"], help="only these registers, where both tables were read"
    )
    _add_document(draft, "device")
    register_maps.configure(
        actions.add_parser("import", help="a profile out of a register map: CSV, Home Assistant's YAML"), _add_document
    )


def _add_document(parser: argparse.ArgumentParser, name: str | None) -> None:
    usual = name or "that of the file"
    parser.add_argument("--name", type=_profile_name, default=name, help=f"of the profile (default: {usual})")
    parser.add_argument("-w", "--write", metavar="FILE", type=Path, help="write it there instead of standard output")
    parser.add_argument("-f", "--force", action="store_true", help="overwrite FILE")


def _profile_name(text: str) -> str:
    """argparse type for the name of a profile."""
    if not is_name(text):
        raise argparse.ArgumentTypeError(f"{text!r}: expected letters, digits, dots and hyphens")
    return text


def run(args: argparse.Namespace) -> int:
    """Do one of the six."""
    actions = {"list": _list, "show": _show, "check": _check, "guess": _guess, "draft": _draft}
    return {**actions, "import": register_maps.run}[args.action](args)


def _list(args: argparse.Namespace) -> int:
    rows = [
        (
            listed.name,
            listed.profile.title if listed.profile is not None else f"BROKEN: {listed.error}",
            list(listed.profile.protocols) if listed.profile is not None else [],
            len(listed.profile.entries) if listed.profile is not None else 0,
            listed.origin,
        )
        for listed in available()
    ]
    if args.json:
        for name, device, protocols, entries, origin in rows:
            told = {"name": name, "device": device, "protocols": protocols, "entries": entries, "origin": origin}
            print(json_output.dumps(told))
        return 0
    shown = [(name, device, " ".join(protocols), entries, origin) for name, device, protocols, entries, origin in rows]
    tables.write(("name", "device", "protocols", "entries", "from"), shown)
    return 0


def _show(args: argparse.Namespace) -> int:
    try:
        profile = find(args.name)
    except (UnknownProfile, ProfileError) as error:
        raise Failure(str(error), USAGE) from None
    if args.json:
        for entry in profile.entries:
            print(json_output.dumps(_as_json(entry)))
        return 0
    for line in _said(profile):
        print(line)
    print()
    tables.write(ENTRY_HEADINGS, [_row(entry) for entry in profile.entries])
    _print_codes(profile)
    _print_properties(profile)
    return 0


def _said(profile: Profile) -> Iterator[str]:
    """What a profile says beside its registers and objects."""
    maker = "; ".join(filter(None, (profile.vendor, ", ".join(profile.models))))
    yield f"{profile.name}: {profile.title}" + (f" ({maker})" if maker else "")
    yield f"protocols: {', '.join(profile.protocols)}"
    yield f"source: {profile.source or 'none is said'}"
    for family, limits in profile.limits.items():
        yield from _limits(family, limits)
    for family, codes in profile.exceptions.items():
        yield from (f"{family} error {code:02d} ({code:02X}h): {words}" for code, words in codes.items())
    yield from (f"{key}: {value}" for key, value in (*profile.constants.items(), *profile.facts.items()))
    for first, last in profile.reserved:
        offset = profile.address_offset
        wire = f" = wire 0x{first:04X} … 0x{last:04X}" if offset else ""
        yield f"reserved: {first - offset:04X}h … {last - offset:04X}h{wire}"
    if profile.absent:
        yield f"parameters without a register: {' '.join(profile.absent)}"
    if profile.address_offset:
        yield f"on the wire a register is the manual's number {profile.address_offset:+d}; both are in the table"


def _limits(family: str, limits: Limits) -> Iterator[str]:
    """What a device can do in one protocol family."""
    if limits.frame is not None:
        yield f"{family} longest frame: {limits.frame} octets"
    if limits.response is not None:
        yield f"{family} answers within: {limits.response / MS:g} ms"
    if limits.responses:
        by_rate = ", ".join(f"{rate} Bd {most / MS:g} ms" for rate, most in sorted(limits.responses.items()))
        yield f"{family} answers within: {by_rate}"
    if limits.stations is not None:
        yield f"{family} station numbers: {limits.stations[0]} … {limits.stations[1]}"
    if limits.functions is not None:
        yield f"{family} functions: {' '.join(f'{code:02X}' for code in sorted(limits.functions))} (hex)"
    if limits.unexecuted:
        yield f"{family} acknowledges and does not do: {_told(limits.unexecuted)}"
    if limits.read_only:
        yield f"{family} attributes that are read only: {_told(limits.read_only)}"


def _told(kinds: frozenset[str]) -> str:
    """ "override AI, override BI, release override"."""
    return ", ".join(sorted(kind.replace(":", " ").replace("-", " ") for kind in kinds))


def _row(entry: Entry) -> tuple[str, ...]:
    remarks = [f"in the device: {entry.label}"] if entry.label else []
    remarks += [f"usually {_usual(entry, entry.default)}"] if entry.default is not None else []
    remarks += [f"doubtful: {entry.doubt}"] if entry.doubt else []
    title = f"{entry.title} ({'; '.join(remarks)})" if remarks else entry.title
    unit = entry.unit if entry.scale == 1 else f"{entry.scale:.12g} {entry.unit}".rstrip()
    return _place(entry), entry.name, unit, bare_range(entry), entry.access.value, title


def _usual(entry: Entry, default: float) -> str:
    words = state_words(entry, int(default)) if default.is_integer() else ""
    return f"{number(default, entry)}, {words}" if words else number(default, entry, entry.unit)


def _place(entry: Entry) -> str:
    """The manual's number, and that of the wire where it is another."""
    if entry.space not in ("holding", "input"):
        return entry.number
    place = f"input {entry.number}" if entry.space == "input" else entry.number
    if entry.number == f"{entry.address:04X}h":
        return place
    return f"{place} = wire 0x{entry.address:04X}, {plain_name(entry.space, entry.address).partition('/')[2]}"


def _print_properties(profile: Profile) -> None:
    """Which properties which objects have, where the maker says so."""
    if not profile.properties:
        return
    kinds = sorted({kind for kinds in profile.properties.values() for kind in kinds})
    print()
    headings = ("property", *kinds)
    tables.write(
        headings,
        [(name, *("yes" if kind in had else "" for kind in kinds)) for name, had in profile.properties.items()],
    )


def _print_codes(profile: Profile) -> None:
    """Bits and codes, after the table, once for each name."""
    done: set[str] = set()
    for entry in profile.entries:
        if entry.name in done or not (entry.bits or entry.parts or entry.states):
            continue
        done.add(entry.name)
        print(f"\n{entry.name} ({entry.number})")
        for code, words in entry.states.items():
            print(f"  {code:>5}  {words}")
        if entry.reserved_codes:
            print(f"  reserved: {' '.join(map(str, sorted(entry.reserved_codes)))}")
        for bit in entry.bits:
            print(f"  bit {bit.number:X}  {bit.on}" + (f", else {bit.off}" if bit.off else ""))
        if entry.reserved_bits:
            bits = " ".join(f"{bit:X}" for bit in entry.reserved_bits)
            print(f"  bits {bits}  reserved" + (", to be written as 0" if entry.access.writable else ""))
        for part in entry.parts:
            print(f"  bits {part.low:X}…{part.high:X}  {part.name}")
            for code, words in part.states.items():
                print(f"    {code:>5}  {words}")


def _as_json(entry: Entry) -> dict[str, Any]:
    return {
        "space": entry.space,
        "address": entry.address,
        "number": entry.number,
        "name": entry.name,
        "title": entry.title,
        "type": entry.kind.value,
        "scale": entry.scale,
        "offset": entry.offset,
        "unit": entry.unit,
        "low": entry.low,
        "high": entry.high,
        "access": entry.access.value,
        "reserved": entry.reserved,
        "states": {str(code): words for code, words in entry.states.items()},
        "bits": {str(bit.number): bit.on for bit in entry.bits},
        "label": entry.label,
        "default": entry.default,
        "reserved_codes": sorted(entry.reserved_codes),
        "reserved_bits": list(entry.reserved_bits),
        "doubt": entry.doubt,
    }


def _check(args: argparse.Namespace) -> int:
    wrong = 0
    for name in args.files:
        try:
            profile = read(Path(name)) if Path(name).exists() else find(name)
        except (UnknownProfile, ProfileError) as error:
            wrong += 1
            print(f"sniff485: {error}", file=sys.stderr)
        else:
            print(f"{name}: {profile.name}, {len(profile.entries)} registers and objects: right")
    return UNREADABLE if wrong else 0


def _guess(args: argparse.Namespace) -> int:
    from sniff.analysis.profile_guess import Guessing

    profiles = [listed.profile for listed in available() if listed.profile is not None]
    rows: list[tuple[tables.Cell, ...]] = []
    for path in args.files:
        capture = arguments.open_capture(path)
        session = arguments.settings_of(args, capture.session, path)
        guessing = Guessing(dissector_for(session))
        survey(Watched(capture), session, guessing, reference=args.reference)
        guesses = list(guessing.guesses(profiles))
        rows += [(guess.station, guess.profile.name, round(100 * guess.score), guess.why) for guess in guesses]
        _say_ties(guesses)
        say_incomplete(path, capture)
    tables.write(("station", "profile", "fits %", "why"), rows, "json" if args.json else "text")
    return 0


def _draft(args: argparse.Namespace) -> int:
    from sniff.analysis.profile_draft import drafted
    from sniff.analysis.register_guess import guessed
    from sniff.analysis.register_kinds import GuessSureness
    from sniff.analysis.register_series import RegisterSeries

    if args.write is not None:
        writing.refuse_to_overwrite(args.write, args.files, args.force)
    series, protocols, families = RegisterSeries(), dict[str, None](), dict[str, str]()
    for path in args.files:
        capture = arguments.open_capture(path)
        session = arguments.settings_of(args, capture.session, path)
        dissector = dissector_for(session)
        families.setdefault(dissector.profile_family, path)
        if len(families) > 1:
            held = "; ".join(f"{path}: {family}" for family, path in families.items())
            raise Failure(f"{held}: registers of one family of protocols make a profile; draft one at a time", USAGE)
        protocols[dissector.name] = None
        survey(Watched(capture), session, series.of(dissector), reference=args.reference)
        say_incomplete(path, capture)
    found = [one for one in guessed(series.blocks(), series.written) if args.table in (None, one.space)]
    stations = sorted({one.device for one in found})
    if args.station is None and len(stations) > 1:
        raise Failure(f"stations {', '.join(map(str, stations))} answered registers: name one with --station", USAGE)
    chosen = [one for one in found if args.station in (None, one.device)]
    if not chosen:
        raise Failure(f"{', '.join(args.files)}: {_nothing_to_draft(args, series, stations)}", UNREADABLE)
    document = drafted(args.name, next(iter(families)), list(protocols), chosen)
    register_maps.write_document(args, document)
    if args.write is not None:
        sure = sum(one.sure is GuessSureness.SURE for one in chosen)
        print(
            f"sniff485: {len(chosen)} values drafted to {sanitized(args.write)}, {sure} of them sure", file=sys.stderr
        )
    if len({one.space for one in chosen}) > 1:
        print("sniff485: holding and input registers were read; each is described by itself", file=sys.stderr)
    return 0


def _nothing_to_draft(args: argparse.Namespace, series: RegisterSeries, stations: Sequence[int]) -> str:
    """Why there is no register to describe."""
    of = "registers" if args.table is None else f"{args.table} registers"
    objects = {kind for station, kinds in series.objects.items() if args.station in (None, station) for kind in kinds}
    if objects and not stations:
        said = f"nobody answered {of}" if args.station is None else f"station {args.station} answered no {of}"
        kinds = ", ".join(sorted(objects)[:4])
        return f"{said}, only other things ({kinds}); `sniff485 points` shows their values"
    if not stations:
        return f"nobody answered a read of {of}; a draft is made of answers"
    others = f"station{'s' * (len(stations) > 1)} {', '.join(map(str, stations))} did"
    return f"station {args.station} answered no read of {of}; {others}"


def _say_ties(guesses: Sequence[Guess]) -> None:
    """Where the best profile of a station is hardly better than the next, the capture cannot decide."""
    best: dict[int, list[Guess]] = {}
    for guess in guesses:
        best.setdefault(guess.station, []).append(guess)
    for station, fitting in best.items():
        alike = [guess.profile.name for guess in fitting if fitting[0].score - guess.score <= TIE]
        if len(alike) > 1:
            names = " and ".join(alike)
            print(f"sniff485: station {station}: {names} fit alike; the type plate decides", file=sys.stderr)
