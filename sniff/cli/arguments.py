"""Arguments that several commands share, and how they become values."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Mapping, Sequence
from contextvars import ContextVar
from dataclasses import replace
from typing import TYPE_CHECKING

from dissectors import registry
from dissectors.line import LineSettings
from dissectors.profiles import Devices, ProfileError
from sniff.analysis.sanitizing import sanitized
from sniff.cli import UNREADABLE, USAGE, Failure
from sniff.engine.capture import Capture, CaptureError
from sniff.engine.session import ASSUMED, AUTO, DEVICES_NOTE, LINE_NOTE, OPTIONS, PROTOCOL_NOTE, Session
from sniff.formats import read
from sniff.formats.several_buses import SeveralBuses, buses_in

if TYPE_CHECKING:
    from dissectors.profiles.model import Profile


def add_line(parser: argparse.ArgumentParser, auto: bool = True) -> None:
    """-s and -p, the same everywhere. `auto`: whether this command can find them itself."""
    kinds = (_or_auto(line_settings), _or_auto(protocol)) if auto else (line_settings, protocol)
    also = "; auto: found by listening, or in the octets of a file" if auto else ""
    parser.add_argument(
        "-s", "--line", type=kinds[0], metavar="LINE", help=f"line settings, for instance 19200,8E1 or 9600,8N1{also}"
    )
    parser.add_argument(
        "-p",
        "--protocol",
        type=kinds[1],
        metavar="PROTOCOL",
        help=f"one of {', '.join(registry.BUILT_IN)}, a plug-in's{also}",
    )


def _or_auto(kind: Callable[[str], object]) -> Callable[[str], object]:
    return lambda token: AUTO if token == AUTO else kind(token)


def add_reference(parser: argparse.ArgumentParser) -> None:
    """For those who compare: the same result, row by row and much slower."""
    parser.add_argument("--reference", action="store_true", help=argparse.SUPPRESS)


def add_files(parser: argparse.ArgumentParser) -> None:
    """One or more captures."""
    parser.add_argument(
        "files",
        nargs="+",
        metavar="FILE",
        help="capture: .mcap .cap.txt .pcap .pcapng .sr .vcd .log .hex .csv .txt; - for standard input",
    )
    add_bus(parser)


def add_bus(parser: argparse.ArgumentParser) -> None:
    """--bus, of commands that read captures."""
    parser.add_argument(
        "--bus", metavar="NAME", help="of a file with several buses (channels of an analyser, connections): this one"
    )


def add_devices(parser: argparse.ArgumentParser) -> None:
    """-d: which station is which device."""
    parser.add_argument(
        "-d",
        "--device",
        dest="devices",
        type=device,
        action="append",
        default=[],
        metavar="ADDRESS=PROFILE",
        help="a station's device profile, for instance 3=teco-e510; * for every station; repeatable",
    )


def device(token: str) -> tuple[str, str]:
    """argparse type for -d."""
    from sniff.devices import assignment

    try:
        return assignment(token)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def devices_of(args: argparse.Namespace, configured: Mapping[str, str] | None = None) -> Devices:
    """What -d says, and behind it what is `configured`; ends with exit code 2 for a profile that cannot be used."""
    said = dict(getattr(args, "devices", ()))
    if not said and not configured:  # nearly always: nothing of profiles is needed
        return Devices()
    from sniff.devices import EVERY, UnknownProfile, devices

    behind = {} if EVERY in said else configured or {}
    try:
        return devices({**behind, **said})
    except (UnknownProfile, ProfileError, ValueError) as error:
        raise Failure(str(error), USAGE) from None


def noted_devices(args: argparse.Namespace, session: Session) -> Devices:
    """What -d says, and behind it what the capture says, as far as it holds such profiles or they are known here."""
    if not getattr(args, "devices", ()) and DEVICES_NOTE not in session.notes:
        return Devices()
    from sniff.devices import EVERY, noted, noted_devices

    _, unknown = noted(session)
    if unknown and EVERY not in dict(args.devices):
        names = ascii(", ".join(unknown)[:200])
        print(f"sniff485: {names}: a device of the capture that is not known here; say which with -d", file=sys.stderr)
    found = devices_of(args).over(noted_devices(session))
    for profile in found.profiles:
        _say_what_it_is_for(profile, session.protocol)
    return found


def _say_what_it_is_for(profile: Profile, protocol: str) -> None:
    """Say where a profile is of little or no use on a bus of that protocol."""
    from sniff.devices import made_for, says_of

    other = made_for(profile, protocol)
    if not says_of(profile, protocol):
        print(f"sniff485: {profile.name} says nothing of {protocol}: {', '.join(profile.protocols)}", file=sys.stderr)
    elif other is not None:
        print(
            f"sniff485: {profile.name} has the register numbers of {', '.join(profile.protocols)}, as behind a "
            f"gateway; for a device that speaks {protocol} itself take {other.name}",
            file=sys.stderr,
        )


def line_settings(token: str) -> LineSettings:
    """argparse type for -s."""
    try:
        return LineSettings.parse(token)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def protocol(name: str) -> str:
    """argparse type for -p."""
    if not registry.is_known(name):
        raise argparse.ArgumentTypeError(f"unknown protocol {name!r}; expected one of {', '.join(registry.known())}")
    return name


def duration(text: str) -> float:
    """argparse type for a duration in seconds: "90", "90s", "5m", "5 min", "2h", "500ms"."""
    seconds = _seconds(text)
    if not seconds:
        raise argparse.ArgumentTypeError(f"duration {text!r}: expected more than nothing")
    return seconds


def margin(text: str) -> float:
    """argparse type for a duration that may be none."""
    return _seconds(text)


_SECONDS = {"": 1.0, "ms": 0.001, "s": 1.0, "m": 60.0, "min": 60.0, "h": 3600.0, "d": 86400.0}


def _seconds(text: str) -> float:
    number = text.rstrip("dhimns ")
    factor = _SECONDS.get(text[len(number) :].strip(), 0.0)
    try:
        seconds = float(number) * factor if factor else -1.0
    except ValueError:
        seconds = -1.0
    if not 0 <= seconds < 10 * 365 * 86400:
        raise argparse.ArgumentTypeError(
            f"duration {text!r}: expected seconds, or a number with ms, s, m (min), h or d"
        )
    return seconds


def tcp_port(text: str) -> int:
    """argparse type for a TCP port; 0 is any free one."""
    if not (text.isascii() and text.isdigit() and len(text) < 6 and int(text) < 1 << 16):
        raise argparse.ArgumentTypeError(f"{text!r}: expected a port, 0 to 65535")
    return int(text)


def positive(text: str) -> int:
    """argparse type for how many."""
    if not (text.isascii() and text.isdigit() and int(text) > 0):
        raise argparse.ArgumentTypeError(f"{text!r}: expected a whole number from 1 on")
    return int(text)


def whole(text: str) -> int:
    """argparse type for a number that may be 0."""
    if not (text.isascii() and text.isdigit()):
        raise argparse.ArgumentTypeError(f"{text!r}: expected a whole number, 0 or more")
    return int(text)


def octets(text: str) -> int:
    """argparse type for a size: "1GB", "500MB"."""
    from sniff.recording.rotation import octets_of

    try:
        return octets_of(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def rotation(text: str) -> str:
    """argparse type for --rotate."""
    from sniff.recording.rotation import Rotation

    try:
        Rotation.parse(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None
    return text


def add_recording(parser: argparse.ArgumentParser, what: str) -> None:
    """-w, and -o as where a capture is written from another one."""
    parser.add_argument("-w", "--write", metavar="FILE", help=what)
    parser.add_argument(
        "-o", "--output", dest="write", metavar="FILE", default=argparse.SUPPRESS, help=argparse.SUPPRESS
    )


def open_capture(path: str) -> Capture:
    """Open a capture of one bus, or end with exit code 3 (2 for an unknown suffix, and where --bus must choose)."""
    capture = _opened(path)
    if isinstance(capture, SeveralBuses):
        raise Failure(capture.refusal, USAGE)
    return capture


def _opened(path: str) -> Capture:
    try:
        capture = read(path)
        capture.session = _as_it_tells(capture.session)
        return capture
    except CaptureError as error:
        raise Failure(str(error), USAGE if "unknown suffix" in str(error) else UNREADABLE) from None


def _as_it_tells(session: Session) -> Session:
    """The session with what its octets say, where nobody else says it."""
    if not (session.protocol_is_assumed or session.line_is_assumed):
        return session
    from sniff.analysis.told_protocol import detected  # most captures say what they are

    return detected(session)


def open_buses(path: str) -> list[tuple[str, Capture]]:
    """Open the buses of a file by name, each as a capture of its own; ends as `open_capture` does."""
    capture = _opened(path)
    buses = buses_in(capture, path)
    if len(buses) < 2:
        return [(path, capture)]
    for one in buses:
        one.session = _as_it_tells(one.session)
    return [(f"{path} [{one.session.bus}]", one) for one in buses]


def open_captures(paths: Sequence[str]) -> list[tuple[str, Capture]]:
    """Open captures by name, the parts of one recording as one; ends as `open_capture` does."""
    return _joined([one for path in paths for one in open_buses(path)])


def open_parts(paths: Sequence[str]) -> list[tuple[str, Capture]]:
    """The same where all are of one bus: of a file with several, --bus must choose."""
    return _joined([(path, open_capture(path)) for path in paths])


def _joined(opened: list[tuple[str, Capture]]) -> list[tuple[str, Capture]]:
    if len(opened) > 1:
        from sniff.recording.rotated import joined

        opened = joined(opened)
    _opened_last.set(len(opened))
    return opened


_opened_last: ContextVar[int] = ContextVar("_opened_last", default=1)


def captures_open() -> int:
    """How many captures this command reads."""
    return _opened_last.get()


def settings_of(args: argparse.Namespace, session: Session, path: str) -> Session:
    """The session of a file with -s and -p applied; says when protocol or line settings are not the file's.

    Ends with exit code 2 when its protocol is unknown here.
    """
    from sniff.engine.follow_settings import dissector_for
    from sniff.engine.session import with_settings

    try:
        protocol, line = (None if said == AUTO else said for said in (args.protocol, args.line))
        session = with_settings(_searched(args, session), protocol, line)
        dissector_for(session)
    except registry.BrokenPlugin:
        raise
    except registry.UnknownProtocol as error:
        raise Failure(f"{error}; say which with -p", USAGE) from None
    say_assumed(session, path, "; -s names them")
    return session


def _searched(args: argparse.Namespace, session: Session) -> Session:
    """The session with what -p auto and -s auto ask its octets for."""
    asked = {PROTOCOL_NOTE: args.protocol == AUTO, LINE_NOTE: args.line == AUTO}
    if not any(asked.values()) or session.unknown:
        return session
    notes = {**session.notes, **{note: ASSUMED for note, wanted in asked.items() if wanted}}
    return _as_it_tells(replace(session, notes=notes))


def say_assumed(session: Session, path: str, way_out: str = "") -> None:
    """Say on standard error what of protocol and line settings is not a file's own, and where it is from."""
    told = session.notes.get(PROTOCOL_NOTE)
    if told is not None:
        title = registry.get(session.protocol).title
        print(
            f"sniff485: {sanitized(path)}: reading it as {title} ({sanitized(told)}); -p names another", file=sys.stderr
        )
    if session.line_is_assumed and session.protocol not in registry.RELATIVES:
        said = f"no line settings in {sanitized(path)}: assuming {session.line} for {session.protocol}{way_out}"
        print(f"sniff485: {said}", file=sys.stderr)


def options(session: Session) -> list[str]:
    """The options that name what is not known of a session."""
    return [OPTIONS[name] for name in session.unknown]


def colour() -> bool:
    """Whether standard output takes colour: a terminal, and NO_COLOR is not set."""
    import os

    return sys.stdout.isatty() and "NO_COLOR" not in os.environ


def on_terminal() -> bool:
    """Whether there is a whole terminal for the terminal UI, which draws through standard error; or a browser."""
    import os

    if os.environ.get("TEXTUAL_DRIVER", "").endswith(":WebDriver"):  # `serve` starts us so
        return True
    return sys.stdin.isatty() and sys.stdout.isatty() and sys.stderr.isatty()
