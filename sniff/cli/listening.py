"""What `live`, `record` and `demo` share: which bus is meant, how frames are printed as they come, how a run ends."""

from __future__ import annotations

import argparse
import contextlib
import os
import re
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from dissectors import registry
from dissectors.line import LineSettings
from dissectors.profiles import Devices
from dissectors.words import milliseconds
from sniff.analysis.plain import plain
from sniff.analysis.summary import Summary
from sniff.bus.live import LiveBus, LiveItem, LiveTables
from sniff.capture.config import RecordSpec, SourceSpec
from sniff.capture.link import CaptureLink
from sniff.capture.wire import Ended, Status
from sniff.cli import INTERRUPTED, PORT_TROUBLE, UNREADABLE, USAGE, Failure, arguments, rows, searching
from sniff.cli.interruption import until_interrupted
from sniff.cli.searching import Unknowns
from sniff.config import AUTO, FILE, Config, ConfigError, load
from sniff.engine.capture import CaptureError
from sniff.engine.engine import Output
from sniff.engine.session import DEVICES_NOTE, LineEvent, LineEventKind
from sniff.engine.verdict_join import Settled, Settling
from sniff.formats.table import suffixes
from sniff.sources import PortError


@dataclass(frozen=True, slots=True)
class Target:
    """The bus to listen to, where its recording goes by configuration (None: not said), and who is on it."""

    source: SourceSpec
    record: str | None = None
    devices: Devices = field(default_factory=Devices)
    search: Unknowns | None = None
    """What is to be found by listening (`auto`); None when everything is given."""


def target_of(args: argparse.Namespace) -> Target:
    """What PORT, -s and -p mean, with the configuration behind them; flags win. Ends with exit code 2."""
    try:
        config = load()
    except ConfigError as error:
        raise Failure(str(error), USAGE) from None
    wanted = args.port or _only_port(config)
    bus = config.buses.get(wanted)
    if bus is None:
        _refuse_unknown(wanted, config)
    port = (bus.port or wanted) if bus is not None else wanted
    if not args.port:
        print(f"sniff485: no port named: listening to {plain(port)}, the only one there is", file=sys.stderr)
    configured = args.protocol or (bus.protocol if bus is not None else None)
    said: LineSettings | str | None = args.line or (bus.line if bus is not None else None)
    auto = AUTO in (said, configured)
    line = said if isinstance(said, LineSettings) else None
    protocol = configured or (AUTO if auto else registry.DEFAULT)
    search = None
    if auto:
        search = Unknowns(line, None if protocol == AUTO else protocol)
        trying = search.detecting()
        line, protocol = trying.wanted, trying.protocols[0]
    if line is None:
        line = LineSettings.parse(registry.get(protocol).default_line)
        print(f"sniff485: no line settings given (-s): assuming {line} for {protocol}", file=sys.stderr)
    name = bus.name if bus is not None else re.sub(r"[^A-Za-z0-9_-]+", "-", _short(port)).strip("-") or "bus"
    devices = arguments.devices_of(args, bus.devices if bus is not None else None)
    unknown = search.names if search is not None else ()
    source = SourceSpec(port, line, protocol, name, notes_of(devices), unknown, devices.documents)
    return Target(source, bus.record if bus is not None else None, devices, search)


def _short(port: str) -> str:
    """What names a port in the name of a file: the last part of its path, "pts-0" of a pseudo-terminal."""
    path = Path(port)
    return f"pts-{path.name}" if path.parent.name == "pts" else path.name


def _refuse_unknown(word: str, config: Config) -> None:
    """End with exit code 2 for a plain word that is neither a file nor a configured bus: it can be no port."""
    if not re.fullmatch(r"[A-Za-z0-9_-]+", word) or re.fullmatch(r"COM\d+", word, re.IGNORECASE) or Path(word).exists():
        return
    device = Path("/dev") / word
    if device.is_char_device():
        raise Failure(f"{word}: no such port or configured bus; did you mean {device}?", USAGE)
    if config.path is None:
        looked = f"there is no {FILE} in this folder, in one above it, or in the user's configuration"
    else:
        looked = f"{config.path} has {', '.join(config.buses) or 'none'}"
    raise Failure(f"{plain(word)}: no such bus is configured: {looked}", USAGE)


def _only_port(config: Config) -> str:
    """The bus or port that can only be meant when none is named. Ends with exit code 2 where there is a choice."""
    if len(config.buses) == 1:
        return next(iter(config.buses))
    from sniff.sources.ports import list_ports

    there = [*config.buses] or [port.device for port in list_ports()]
    if len(there) == 1:
        return there[0]
    found = f"there are: {', '.join(there)}" if there else "there are no serial ports here; try `sniff485 demo`"
    raise Failure(f"which port? {found}", USAGE)


def notes_of(devices: Devices) -> dict[str, str]:
    """What a recording says of its devices."""
    return {DEVICES_NOTE: devices.text()} if devices else {}


def start(
    source: SourceSpec,
    record: RecordSpec | None,
    duration: float | None = None,
    devices: Devices | None = None,
    search: Unknowns | None = None,
    count: int | None = None,
    watched: bool = True,
) -> LiveBus:
    """Start the capture process. Ends with exit code 4 for the port, 3 for the file. `watched`: as `LiveBus` has it.

    Recording and `duration` begin at once, also with something to `search` for; `LiveBus.searching` says how far it is.
    `duration` (seconds) and `count` (frames) are limits of the capture process, whatever becomes of this one.
    """
    link = start_link(source, record, duration, count, watched)
    try:
        adapter = link.session(0).adapter
        detecting = search.detecting(adapter.latency, adapter.reports) if search is not None else None
        return LiveBus(link, devices=devices, detecting=detecting, watched=watched)
    except BaseException:
        link.stop()  # a capture outlives its starter unless it is told to end
        raise


def start_link(
    source: SourceSpec,
    record: RecordSpec | None,
    duration: float | None = None,
    count: int | None = None,
    watched: bool = True,
) -> CaptureLink:
    """Start the capture process without an engine. Ends with exit code 4 for the port, 3 for the file."""
    try:
        return CaptureLink.start([source], record, duration, count, watched)
    except PortError as error:
        raise Failure(str(error), PORT_TROUBLE) from None
    except CaptureError as error:
        raise Failure(str(error), UNREADABLE) from None


def refuse_recording(path: str) -> None:
    """Refuse what cannot be a recording before the port is opened. Ends with exit code 2, 3 for a directory."""
    if path == "-":
        raise Failure("-w -: a recording needs a file; `sniff485 live PORT --json` gives frames as they come", USAGE)
    if path.endswith(("/", os.sep)) or Path(path).is_dir():
        raise Failure(f"{path}: a directory; name a file in it", UNREADABLE)
    if not path.lower().endswith(".mcap"):
        raise Failure(f"{path}: recordings are .mcap; convert it afterwards with `sniff485 convert`", USAGE)


def new_recording(bus: str) -> str:
    """A name in this folder that no file has: sniff485-<bus>-<date>-<time>.mcap."""
    stem = f"sniff485-{bus}-{time.strftime('%Y%m%d-%H%M%S')}"
    path, number = Path(f"{stem}.mcap"), 2
    while path.exists():
        path, number = Path(f"{stem}-{number}.mcap"), number + 1
    return str(path)


class Printer:
    """Frames as lines (or JSON), each with its verdict, as they come; counts them all."""

    def __init__(self, live: LiveBus, as_json: bool = False, quiet: bool = False, colour: bool = False) -> None:
        self.live = live
        self.as_json = as_json
        self.quiet = quiet
        self.colour = colour
        self._session = live.session
        self._trouble = ""
        self._waited = False
        self._settling = Settling(live.points)

    @property
    def summary(self) -> Summary:
        """What was counted."""
        return self.live.model.summary

    def poll(self, timeout: float) -> list[LiveItem] | list[LiveTables]:
        """What has come; waits up to `timeout` seconds."""
        return self.live.poll_tables(timeout) if self.quiet else self.live.poll(timeout)

    def take(self, items: list[LiveItem] | list[LiveTables]) -> None:
        """Print what has come."""
        if self.live.session is not self._session:
            self._settle()
        for item in items:
            if isinstance(item, Output):
                self._take_output(item)
            elif isinstance(item, LineEvent):
                self._say_event(item)
            elif isinstance(item, Status):
                self._say_status(item)
            elif isinstance(item, Ended) and not item.clean:
                self._say(item.reason)
        if not self.quiet:
            sys.stdout.flush()

    def _say_status(self, status: Status) -> None:
        if status.error != self._trouble:
            self._trouble = status.error
            self._say(f"recording: {status.error or 'goes on'}")
        if status.closing and status.unwritten and not self._waited:
            self._waited = True
            self._say(waiting_words(status))

    def _say_event(self, event: LineEvent) -> None:
        if event.kind in (LineEventKind.UNPLUGGED, LineEventKind.REPLUGGED):
            print(f"sniff485: {plain(event.text)}", file=sys.stderr)  # names the port
        elif event.kind in (LineEventKind.NOTE, LineEventKind.REFUSED):
            self._say(event.text)
        elif event.kind is not LineEventKind.SETTINGS:  # those of a search are said where it is shown
            self._say(f"{event.kind.value} {event.text}".strip())

    def _settle(self) -> None:
        """A search has ended: go on with what it found."""
        self._session = self.live.session
        self._settling = Settling(self.live.points)  # what came before belongs to no transaction

    def finish(self) -> None:
        """Print what still waits for a verdict."""
        for settled in self._settling.flush():
            self._print(settled)
        sys.stdout.flush()

    def _take_output(self, output: Output) -> None:
        for settled in self._settling.add(output):
            self._print(settled)

    def _print(self, settled: Settled) -> None:
        if self.quiet:
            return
        if self.as_json:
            print(rows.json_line(settled, self.live.dissector, self.live.session))
        else:
            print(rows.text_line(settled, self.live.dissector, self.live.session, self.colour))

    def _say(self, text: str) -> None:
        print(f"sniff485: {self.live.session.port}: {plain(text)}", file=sys.stderr)


def waiting_words(status: Status) -> str:
    """What is said while a slow disk gets time for what it did not take yet."""
    return (
        f"the disk is slow: waiting for the last {status.unwritten} octets to be written; "
        "end that, and lose them, with Ctrl-C"
    )


def run(printer: Printer, progress: bool = True) -> int:
    """Listen until something ends it: a signal, the capture's limits, the port. Gives the exit code.

    A signal more ends the waiting for a slow disk, too. `progress`: say on standard error how a search for settings
    goes, and how it ended.
    """
    live = printer.live
    meter = _Meter(printer) if progress and printer.quiet and sys.stderr.isatty() else None
    search_meter = searching.Meter() if progress and live.searching is not None else None
    heeded = 0
    with until_interrupted() as caught, _stopped_by_its_reader(live):
        while live.ended is None:
            items = printer.poll(0.1)
            if search_meter is not None:
                search_meter.follow(live)
                search_meter = None if live.searching is None else search_meter
            elif meter is not None:
                meter.show()
            printer.take(items)
            if len(caught) > heeded:
                heeded = len(caught)
                live.end()
        printer.finish()
    for shown in (meter, search_meter):
        if shown is not None:
            shown.clear()
    if lost_something(live):
        return UNREADABLE  # what was asked for is not all in the file
    if live.ended is not None and not live.ended.clean:
        return PORT_TROUBLE
    if _gone_for_good(live):
        print(f"sniff485: {plain(live.session.port)}: gone for good; nothing more can be heard", file=sys.stderr)
        return PORT_TROUBLE
    if live.engine.searching:
        say_not_found(live, "interrupted" if caught else "ended")
        return INTERRUPTED if caught else PORT_TROUBLE
    return 0


def lost_something(live: LiveBus) -> bool:
    """Whether octets that were heard are not in the recording, or nobody knows."""
    status, ended = live.status, live.ended
    if not live.link.paths:
        return False
    late = status.closing or status.behind  # else it lacks the last second, as a killed process may
    killed = ended is not None and not ended.clean and late and status.unwritten > 0
    return bool(status.error or status.lost or killed or (ended is not None and ended.lossy) or live.file_is_gone)


def _gone_for_good(live: LiveBus) -> bool:
    """Whether the port ended the capture. A capture file that stands in for one simply ends."""
    ended = live.ended is not None and live.ended.at_end
    return ended and not live.session.port.lower().endswith(suffixes())


@contextlib.contextmanager
def _stopped_by_its_reader(live: LiveBus) -> Iterator[None]:
    """End the capture when nobody takes our output any more (`| head`, a full disk): it would go on for ever."""
    try:
        yield
    except OSError:
        live.stop()
        raise


def say_not_found(live: LiveBus, how: str) -> None:
    """Say that a capture ended before its settings were found, and what can be done with its recording."""
    if live.search is None:
        return
    said = searching.sentence(live.search.outcome(), "a longer capture may find them")
    print(f"sniff485: {plain(live.session.port)}: {how} while searching, no settings found: {said}", file=sys.stderr)
    if live.status.path:
        print("sniff485: the recording has every octet; read it with -s and -p once they are known", file=sys.stderr)


def say_end(printer: Printer) -> None:
    """The closing lines on standard error: what was heard, what was lost, where it is."""
    summary = printer.summary
    noise = f", {summary.noise} octets of noise" if summary.noise else ""
    searched = f", {summary.searched} octets heard while searching" if summary.searched else ""
    print(
        f"sniff485: {summary.frames} frames ({summary.damaged} damaged), {summary.octets} octets{noise}{searched}, "
        f"bus load {summary.load.overall():.1%}",
        file=sys.stderr,
    )
    if summary.latency.count:
        middle, most = summary.latency.quantile(0.5), summary.latency.most
        assert middle is not None
        assert most is not None
        bound = milliseconds(printer.live.session.adapter.latency)
        print(
            f"sniff485: response time p50 {milliseconds(middle)}, max {milliseconds(most)} (each ±{bound})",
            file=sys.stderr,
        )
    say_recorded(printer.live)


def say_recorded(live: LiveBus, where: bool = True) -> None:
    """The last lines on standard error: what was not looked at, what was lost, where the recording is (unless said)."""
    status, ended = live.status, live.ended
    if live.unseen:
        kept = "; the recording has them" if live.link.paths else ""
        print(f"sniff485: {live.unseen} octets not looked at: this host did not keep up{kept}", file=sys.stderr)
    if ended is not None and ended.unheard:
        what = "the last octets were not looked at, nobody knows how many: this host was too slow for them"
        print(f"sniff485: {what}{'; the recording has them' if live.link.paths else ''}", file=sys.stderr)
    lost = status.lost
    if ended is not None and not ended.clean and status.unwritten:
        lost += status.unwritten
        print(f"sniff485: about {lost} octets NOT RECORDED: the capture process was ended", file=sys.stderr)
    elif lost:
        why = "" if status.error else ": the disk did not keep up"
        print(f"sniff485: {lost} octets NOT RECORDED{why}", file=sys.stderr)
    if live.file_is_gone:
        print(f"sniff485: {plain(status.path or live.link.paths[0])} is not there any more", file=sys.stderr)
    elif status.path and where:
        cut = "" if ended is None or ended.clean else ", cut where the capture was ended"
        print(f"sniff485: recorded to {plain(status.path)}{cut}", file=sys.stderr)


class _Meter:
    """One line on the terminal, twice a second."""

    def __init__(self, printer: Printer) -> None:
        self.printer = printer
        self.began = time.monotonic()
        self.next = self.began

    def show(self) -> None:
        now = time.monotonic()
        if now < self.next:
            return
        self.next = now + 0.5
        summary, status = self.printer.summary, self.printer.live.status
        text = f"{now - self.began:.0f} s  {summary.frames} frames  {summary.damaged} damaged  {status.size} octets"
        text += f"  disk slow: {status.behind:.0f} s behind" if status.behind else ""
        print(f"\r\x1b[K{text}", end="", file=sys.stderr, flush=True)

    def clear(self) -> None:
        print("\r\x1b[K", end="", file=sys.stderr)
