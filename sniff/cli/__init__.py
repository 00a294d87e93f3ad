"""The command line: one command, one file a subcommand. Only the chosen subcommand is imported.

Exit codes: 0 fine · 1 findings at or above --fail-on · 2 usage · 3 unreadable or cut input, or output not written ·
4 port trouble · 70 a defect of this program · 130 interrupted.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import sys
from collections.abc import Iterable
from importlib import import_module
from types import ModuleType
from typing import cast

from dissectors import registry
from sniff.cli import standard_streams
from sniff.cli.command_parser import CommandParser
from sniff.engine.capture_error import CaptureError
from sniff.version import __version__

COMMANDS: dict[str, str] = {
    "ports": "serial ports: adapter, driver, latency, what line errors they can report, who holds them",
    "detect": "baud rate, format and protocol of a bus, by listening only",
    "live": "listen to a port: terminal UI (frames as lines where there is no terminal); records",
    "record": "listen to a port and record, without a UI",
    "box": "unattended: records all configured buses for ever, says how it stands; systemd unit, udev rules",
    "open": "terminal UI on captures",
    "show": "frames of captures, one line each, or JSON, tree, hex, fields",
    "info": "what is in a capture: times, counts, nodes, settings, completeness",
    "stats": "tables: nodes, transactions, latency, load, ring, stations, polls, health",
    "points": "values by name: registers and objects of every station, scaled, with unit and quality",
    "profile": "device profiles: list, show, check; guess and draft from a capture, import of register maps",
    "check": "what is wrong with a bus, where, and what to do next: findings with evidence",
    "rule": "explain the rules behind the findings of check, or list them",
    "report": "a page to hand on: verdict, findings, stations, load, values, times, ring; HTML that stands alone",
    "convert": "one capture format into another, by suffix",
    "cut": "a stretch of a capture: by time, by frames, around a finding",
    "merge": "captures of one bus into one, by time",
    "diff": "what differs between two captures: stations, answers, times, findings",
    "fleet": "a whole archive: every bus, every day, health, findings, and what changed",
    "taps": "two captures of one line at two places: what is lost or damaged between them, and on which side",
    "anonymise": "a capture without names: other addresses, no texts, right checksums",
    "redissect": "finds frames anew, with other settings if need be, and keeps them: read in a fraction of the time",
    "recover": "makes a whole file of one that was cut off or damaged",
    "replay": "plays a capture to a pseudo-terminal or a TCP port of this machine",
    "extcap": "lets Wireshark capture from a port through this program",
    "snapshot": "writes or compares the expectations of captures that are tests",
    "config": "where the configured buses and their values come from",
    "serve": "the terminal UI in a browser, on a capture or on a port that it records",
    "mcp": "answers assistants' questions about captures (Model Context Protocol), reading only",
    "completion": "what teaches a shell to complete commands, options and files",
    "demo": "a virtual RS-485 bus with simulated drives, through the real capture path",
}
"""Name → what it does, in the order of the help. Each is `sniff/cli/<name>.py`: `configure(parser)`, `run(args)`."""

DESCRIPTION = """Passive RS-485 fieldbus sniffer and protocol analyzer. It listens; it never writes to a port."""

EPILOG = """Start with `sniff485 demo`, then `sniff485 ports` and `sniff485 live PORT -s 19200,8E1 -p PROTOCOL`.
Exit codes: 0 fine, 1 findings, 2 usage, 3 unreadable input or output not written, 4 port trouble, 70 internal error
(--traceback says where), 130 interrupted."""


class Failure(Exception):
    """A command ends: one line for the user and an exit code."""

    def __init__(self, message: str, code: int) -> None:
        super().__init__(message)
        self.code = code


FOUND, USAGE, UNREADABLE, PORT_TROUBLE, INTERNAL, INTERRUPTED = 1, 2, 3, 4, 70, 130

TRACEBACK = "--traceback"
"""For developers, anywhere on the command line: where an internal error came from."""

_OURS = ("sniff", "dissectors")

_NO_MATRICES = ("OPENBLAS_NUM_THREADS", "1")
"""What numpy multiplies matrices with starts a thread a core when it is loaded. Nothing here has a matrix, and to start
them costs an eighth of a short command."""


def main(argv: list[str] | None = None) -> int:
    """Run one command; give its exit code. No exception leaves here but argparse's SystemExit."""
    arguments = sys.argv[1:] if argv is None else list(argv)
    traced = TRACEBACK in arguments
    arguments = [word for word in arguments if word != TRACEBACK]
    standard_streams.prepare()
    os.environ.setdefault(*_NO_MATRICES)
    try:
        return _run(arguments)
    except SystemExit:  # argparse, after --help, --version or a line of its own
        broken = standard_streams.output_error()
        if broken is None:
            raise
        return _failed(broken, traced)
    except KeyboardInterrupt:
        return INTERRUPTED
    except BrokenPipeError:  # the reader of our output went away (`| head`)
        standard_streams.give_output_up()
        return 0
    except Exception as error:
        return _failed(error, traced)


def _failed(error: Exception, traced: bool) -> int:
    """What ended a command, as one line; the exit code."""
    from sniff.formats.files import explain

    broken = standard_streams.output_error()
    if isinstance(
        error, Failure | CaptureError | registry.UnknownProtocol
    ):  # a damaged file is found out while it is read
        standard_streams.say(_plain(error))
        return getattr(error, "code", USAGE if isinstance(error, registry.UnknownProtocol) else UNREADABLE)
    if broken is not None or (isinstance(error, OSError) and error.filename is not None):
        cause = broken or cast("OSError", error)
        where = "standard output" if cause.filename is None else os.fsdecode(cause.filename)
        standard_streams.say(_plain(explain(where, cause)))
        return UNREADABLE
    if isinstance(error, MemoryError):
        standard_streams.say("not enough memory for that")
        return UNREADABLE
    if traced:
        import traceback

        with contextlib.suppress(OSError, ValueError):
            traceback.print_exception(error)
    what, (place, plugin) = f"{type(error).__name__}: {error}", _place(error)
    whose, whom = ("internal error", "") if plugin is None else (f"{plugin} failed", " to whoever made it")
    standard_streams.say(
        f"{whose}: {_plain(what)} ({_plain(place)}); please report it{whom}, with what {TRACEBACK} says"
    )
    return INTERNAL


def _place(error: Exception) -> tuple[str, str | None]:
    """Where it happened: file and line of the innermost frame of our own or of a plug-in, and which plug-in that is."""
    import traceback

    elsewhere = getattr(error, "places_elsewhere", ())  # in the process that read a capture (bus/reading_process.py)
    frames = [
        *traceback.extract_tb(error.__traceback__),
        *(traceback.FrameSummary(file, line, "") for file, line in elsewhere),
    ]
    frame, plugin = frames[-1], None
    for known in reversed(frames):
        plugin = registry.plugin_at(known.filename)
        if plugin is not None or any(f"{os.sep}{name}{os.sep}" in known.filename for name in _OURS):
            frame = known
            break
    return (
        f"{os.path.basename(os.path.dirname(frame.filename))}/{os.path.basename(frame.filename)}:{frame.lineno}",
        plugin,
    )


def _run(arguments: list[str]) -> int:
    name = next((word for word in arguments if not word.startswith("-")), None)
    asked = name is None and {"-h", "--help"} & {*arguments}  # all protocols are imported only then
    if name is not None and name not in COMMANDS:
        raise Failure(_no_such_command(name), USAGE)
    epilog = f"{_protocols()}\n\n{EPILOG}" if asked else EPILOG
    chosen_alone = name is not None and arguments[0] == name  # no word before it asks for the help of all
    wanted = [name] if name is not None else []
    parser, imported = command_line(wanted, epilog, wanted if chosen_alone else COMMANDS)
    chosen = imported.get(name or "")
    args, unknown = parser.parse_known_args(arguments)
    if unknown and not getattr(chosen, "TOLERANT", False):
        options = [word for word in unknown if word.startswith("-")]  # what stands behind one may be its value
        said = " ".join(options or unknown)
        raise Failure(f"{name}: does not know {said}; `sniff485 {name} --help` says what it knows", USAGE)
    assert chosen is not None  # argparse has refused anything else
    return _carried_out(chosen, args)


def _carried_out(command: ModuleType, args: argparse.Namespace) -> int:
    """The exit code of a command that was understood; a file that was cut counts."""
    from sniff.formats import cut_capture  # with all that a capture is: nothing for whoever asks for help or version
    from sniff.formats.several_buses import chosen as bus_chosen

    cut_capture.forget()
    with bus_chosen(getattr(args, "bus", None)):
        code = int(command.run(args))
    sys.stdout.flush()
    for path, damage in cut_capture.unsaid():
        standard_streams.say(_plain(f"{path}: {damage}; all before it was read"))
    return UNREADABLE if code in (0, FOUND) and cut_capture.was_cut() else code


def command_line(
    configured: Iterable[str] = COMMANDS, epilog: str = EPILOG, named: Iterable[str] = COMMANDS
) -> tuple[argparse.ArgumentParser, dict[str, ModuleType]]:
    """The parser of all commands, and the modules of those whose options it knows; the others are only names, and those
    that are not even `named` it refuses.

    What is generated from the command line (manual pages, completion, pages of the documentation) is made from it.
    """
    parser = CommandParser(
        prog="sniff485",
        description=DESCRIPTION,
        epilog=epilog,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"sniff485 {__version__}")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", required=True)
    wanted, imported = set(configured), {}
    for command in named:
        text = COMMANDS[command]
        sub = commands.add_parser(
            command,
            help=text,
            description=text[0].upper() + text[1:] + ".",
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        if command in wanted:
            imported[command] = module = import_module(f"sniff.cli.{command}")
            sub.epilog = module.__doc__
            module.configure(sub)
    return parser, imported


def _protocols() -> str:
    """The protocols that there are, plug-ins too: what `-p` takes, and what it is."""
    known = registry.usable()
    width = max(len(one.name) for one in known)
    return "\n".join(("protocols:", *(f"  {one.name:<{width}}  {one.title}" for one in known)))


def _no_such_command(word: str) -> str:
    import shlex
    from difflib import get_close_matches

    close = get_close_matches(word, COMMANDS, 1)
    if close:
        return f"{word!r}: no such command; did you mean {close[0]!r}?"
    if os.path.exists(word):
        a = "live" if word.startswith("/dev/") else "open"
        return f"{word!r}: no such command; did you mean `sniff485 {a} {shlex.quote(word)}`?"
    return f"{word!r}: no such command; `sniff485 --help` lists them"


def _plain(error: Exception | str) -> str:
    """A message may quote a hostile file."""
    from sniff.analysis.sanitizing import sanitized

    return sanitized(error)
