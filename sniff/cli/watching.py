"""`points PORT`, `stats PORT`: a table of a bus that is listened to, drawn each second, and once more at the end."""

from __future__ import annotations

import argparse
import contextlib
import io
import shutil
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from sniff.analysis.sanitizing import sanitized
from sniff.cli import arguments
from sniff.formats.table import is_named_so

if TYPE_CHECKING:
    from sniff.analysis.point_reader import Sample
    from sniff.bus.live import LiveBus, LiveItem, LiveTables
    from sniff.engine.session import LineEvent
    from sniff.recording.derived_message import DerivedMessage

OTHER_SCREEN, THIS_SCREEN = "\x1b[?1049h\x1b[?7l", "\x1b[?7h\x1b[?1049l"
"""A terminal's second screen, with lines that end where it does; and back."""


def add_duration(parser: argparse.ArgumentParser) -> None:
    """--duration, of a command that takes files or a port."""
    parser.add_argument(
        "--duration", type=arguments.duration, metavar="TIME", help="a port: how long to listen (default: until Ctrl-C)"
    )


def refuse_duration(args: argparse.Namespace) -> None:
    """Of files: end with exit code 2 where --duration is given."""
    from sniff.cli import USAGE, Failure

    if args.duration is not None:
        raise Failure("--duration is for a port; `cut` takes a stretch out of a capture", USAGE)


def port_of(sources: Sequence[str]) -> str | None:
    """The port or configured bus that is meant; None where files are. Ends with exit code 2 for both at once."""
    ports = [source for source in sources if not is_file(source)]
    if not ports:
        return None
    from sniff.cli import USAGE, Failure, targets

    named = [one for one in ports if is_port(one) or one in targets.configured().buses]
    if not named:
        return None
    if len(sources) > 1:
        raise Failure(f"{sanitized(named[0])}: a port is listened to alone", USAGE)
    return named[0]


def is_file(source: str) -> bool:
    """Whether it is what captures are read from."""
    path = Path(source)
    return source == "-" or is_named_so(source) or path.is_file() or path.is_fifo()


def is_port(source: str) -> bool:
    """Whether it names a port by its form."""
    return source.startswith(("/dev/", "COM", "\\\\")) or "://" in source or Path(source).is_char_device()


def start(args: argparse.Namespace, port: str) -> LiveBus:
    """Begin to listen; nothing is recorded."""
    from sniff.cli import listening, targets

    args.port = port
    target = targets.target_of(args)
    return listening.start(target.source, None, args.duration, target.devices, target.search, watched=False)


class Listener:
    """A `BusListener` that hears nothing; for those who want some of it."""

    def on_samples(self, live: LiveBus, samples: Sequence[Sample]) -> None:
        """Values were read."""

    def on_derived(self, live: LiveBus, messages: list[DerivedMessage]) -> None:
        """Statistics."""

    def on_event(self, live: LiveBus, event: LineEvent) -> None:
        """Something happened to the line."""

    def on_time(self, live: LiveBus, now: int) -> None:
        """It is later."""

    def on_end(self, live: LiveBus) -> None:
        """The capture is over."""


def follow(
    live: LiveBus,
    listener: Listener,
    show: Callable[[], None] | None,
    style: str = "text",
    take: Callable[[object], None] = lambda item: None,
) -> int:
    """Listen until the end. `show`: prints the table; on a terminal each second, and in any case once at the end; None
    where the listener prints as it hears. `take`: gets all rows and exchanges. Gives the exit code."""
    from sniff.cli import listening, printing

    class Printer(printing.Printer):
        def take(self, items: list[LiveItem] | list[LiveTables]) -> None:
            for item in items:
                take(item)
            super().take(items)
            sys.stdout.flush()

    live.tell(listener)
    printer = Printer(live, quiet=True)
    drawn = show is not None and style == "text" and sys.stdout.isatty()
    with _other_screen() if drawn else contextlib.nullcontext():
        if drawn and show is not None:
            printer.every_second = lambda: _draw(live, show)
        code = listening.run([printer], progress=not drawn)
    if show is not None:
        show()
    if live.unseen:
        print(f"sniff485: {live.unseen} octets not looked at: this host did not keep up", file=sys.stderr)
    return code


@contextlib.contextmanager
def _other_screen() -> Iterator[None]:
    sys.stdout.write(OTHER_SCREEN)
    try:
        yield
    finally:
        sys.stdout.write(THIS_SCREEN)
        sys.stdout.flush()


class _Page(io.StringIO):
    """What is printed, for a terminal."""

    def isatty(self) -> bool:
        return True


def _draw(live: LiveBus, show: Callable[[], None]) -> None:
    """The table as it is now, as much of it as there is room for."""
    page = _Page()
    with contextlib.redirect_stdout(page):
        show()
    lines = page.getvalue().splitlines()
    room = shutil.get_terminal_size().lines - 2
    if len(lines) > room:
        lines[room - 1 :] = [f"and {len(lines) - room + 1} lines more"]
    drawn = "".join(f"\x1b[K{line}\n" for line in [_headline(live), *lines])
    sys.stdout.write(f"\x1b[H{drawn}\x1b[J")
    sys.stdout.flush()


def _headline(live: LiveBus) -> str:
    summary, session = live.model.summary, live.session
    what = "searching for settings" if live.searching is not None else f"{session.line_words} {session.protocol_words}"
    return (
        f"{sanitized(session.port)} {what}: {summary.frames} frames ({summary.damaged} damaged), load "
        f"{summary.load.share(now=live.now):.0%}; Ctrl-C ends"
    )
