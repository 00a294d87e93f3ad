"""What `live`, `record` and `demo` share: which bus is meant, how frames are printed as they come, how a run ends."""

from __future__ import annotations

import argparse
import contextlib
import os
import re
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

from dissectors import registry
from dissectors.line import LineSettings
from dissectors.profiles import Devices
from dissectors.words import milliseconds
from sniff.analysis.plain import plain
from sniff.analysis.summary import Summary
from sniff.bus.live import LiveBus, LiveItem, LiveTables
from sniff.bus.router import Router
from sniff.bus.triggers import Fired, Triggers
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
from sniff.engine.table import Table
from sniff.engine.verdict_join import Settled, Settling
from sniff.filter import Scope
from sniff.formats.table import suffixes
from sniff.sources import PortError

if TYPE_CHECKING:
    from sniff.outlets.alerts import Alerts
    from sniff.outlets.news import NewsDesk


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
    config = _configured()
    return _target(args, config, args.port or _only_port(config))


def targets_of(args: argparse.Namespace) -> list[Target]:
    """The same for any number of `args.ports`, or with `args.all` every bus of the configuration; no two buses have one
    name. Ends with exit code 2."""
    config = _configured()
    wanted = list(args.ports)
    if args.all:
        if wanted:
            raise Failure("--all: every configured bus; name no port beside it", USAGE)
        wanted = [name for name, bus in config.buses.items() if bus.port]
        if not wanted:
            raise Failure(f"--all: no bus with a port is configured; name some in {FILE}", USAGE)
    targets = [_target(args, config, port) for port in wanted or [_only_port(config)]]
    twice = next((port for port, count in Counter(one.source.spec for one in targets).items() if count > 1), None)
    if twice is not None:
        raise Failure(f"{plain(twice)}: named twice; a port is listened to once", USAGE)
    return _with_names_of_their_own(targets)


def _with_names_of_their_own(targets: list[Target]) -> list[Target]:
    taken: set[str] = set()
    named = []
    for target in targets:
        name, number = target.source.bus, 2
        while name in taken:
            name, number = f"{target.source.bus}-{number}", number + 1
        taken.add(name)
        named.append(replace(target, source=replace(target.source, bus=name)))
    return named


def _configured() -> Config:
    try:
        return load()
    except ConfigError as error:
        raise Failure(str(error), USAGE) from None


def _target(args: argparse.Namespace, config: Config, wanted: str) -> Target:
    bus = config.buses.get(wanted)
    if bus is None:
        _refuse_unknown(wanted, config)
    port = (bus.port or wanted) if bus is not None else wanted
    if not (args.port if "port" in args else args.ports or args.all):
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
    return start_all([Target(source, None, devices or Devices(), search)], record, duration, count, watched)[0]


def start_all(
    targets: Sequence[Target],
    record: RecordSpec | None,
    duration: float | None = None,
    count: int | None = None,
    watched: bool = True,
) -> list[LiveBus]:
    """The same for several buses: one capture process, one clock, one file. `count`: frames of all together."""
    link = start_link([target.source for target in targets], record, duration, count, watched)
    try:
        router = Router(link)
        return [_live(link, router, bus, target, watched) for bus, target in enumerate(targets)]
    except BaseException:
        link.stop()  # a capture outlives its starter unless it is told to end
        raise


def _live(link: CaptureLink, router: Router, bus: int, target: Target, watched: bool) -> LiveBus:
    adapter, search = link.session(bus).adapter, target.search
    detecting = search.detecting(adapter.latency, adapter.reports) if search is not None else None
    return LiveBus(link, bus, target.devices, detecting, router, watched)


def start_link(
    sources: Sequence[SourceSpec],
    record: RecordSpec | None,
    duration: float | None = None,
    count: int | None = None,
    watched: bool = True,
) -> CaptureLink:
    """Start the capture process without an engine. Ends with exit code 4 for the port, 3 for the file."""
    try:
        return CaptureLink.start(sources, record, duration, count, watched)
    except PortError as error:
        raise Failure(str(error), PORT_TROUBLE) from None
    except CaptureError as error:
        raise Failure(str(error), UNREADABLE) from None


def add_triggers(printers: Sequence[Printer], words: Sequence[str]) -> None:
    """Watch every bus for what `--on` names; ends with exit code 2 for what cannot be understood."""
    for printer in printers if words else ():
        live = printer.live
        try:
            printer.triggers = Triggers(words, live.dissector, Scope(live.session.started, live.devices))
        except ValueError as error:
            live.link.stop()
            raise Failure(f"--on: {error}", USAGE) from None


@contextlib.contextmanager
def alerting(printers: Sequence[Printer]) -> Iterator[None]:
    """Meanwhile whoever the configuration names is told what is new about the buses."""
    settings = _configured().alert
    if settings is None:
        yield
        return
    from sniff.outlets.alerts import Alerts
    from sniff.outlets.news import NewsDesk

    alerts = Alerts(settings, lambda text: print(f"sniff485: {plain(text)}", file=sys.stderr))
    for printer in printers:
        printer.alerts = alerts, NewsDesk(settings.least, int(settings.every * 1e9))
    try:
        yield
    finally:
        alerts.close()
        if alerts.dropped:
            print(f"sniff485: {alerts.dropped} alerts dropped: nobody took them in time", file=sys.stderr)


@contextlib.contextmanager
def serving_metrics(printers: Sequence[Printer], port: int | None) -> Iterator[None]:
    """Meanwhile /metrics is served on the loopback at a port; None: it is not. Ends with exit code 2 where it can't."""
    if port is None:
        yield
        return
    from sniff.outlets.metrics import Told, exposition
    from sniff.outlets.metrics_server import HOST, MetricsServer

    try:
        server = MetricsServer(port)
    except OSError as error:
        printers[0].live.stop()
        raise Failure(f"--metrics {port}: {error.strerror}", USAGE) from None
    print(f"sniff485: http://{HOST}:{server.port}/metrics", file=sys.stderr)

    def publish() -> None:
        server.page = exposition(
            [Told(each.live.model, each.live.status.lost, each.live.ended is None) for each in printers]
        )

    printers[0].every_second = publish
    try:
        yield
    finally:
        server.close()


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


JUDGED_EVERY = 1.0
"""Seconds between looks at findings, for triggers and alerts."""


class Printer:
    """Frames as lines (or JSON), each with its verdict, as they come; counts them all. `before_saying`: called before
    anything is said on standard error."""

    def __init__(self, live: LiveBus, as_json: bool = False, quiet: bool = False, colour: bool = False) -> None:
        self.live = live
        self.as_json = as_json
        self.quiet = quiet
        self.colour = colour
        self.before_saying: Callable[[], None] = lambda: None
        self.triggers: Triggers | None = None
        self.alerts: tuple[Alerts, NewsDesk] | None = None
        self.every_second: Callable[[], None] | None = None
        self._judge_at = 0.0
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
            if self.triggers is not None and isinstance(item, Table | Output):
                self._fire(self.triggers.see(item))
            if isinstance(item, Output):
                self._take_output(item)
            elif isinstance(item, LineEvent):
                self._say_event(item)
            elif isinstance(item, Status):
                self._say_status(item)
            elif isinstance(item, Ended) and not item.clean:
                self._say(item.reason)
        asked = self.triggers is not None or self.alerts is not None or self.every_second is not None
        if asked and time.monotonic() >= self._judge_at:
            self._judge_at = time.monotonic() + JUDGED_EVERY
            self._judge()
        if not self.quiet:
            sys.stdout.flush()

    def _judge(self) -> None:
        """Look at what the rules have found, and tell others how the bus is."""
        if self.every_second is not None:
            self.every_second()
        if self.triggers is None and self.alerts is None:
            return
        findings = self.live.model.findings()
        if self.triggers is not None:
            self._fire(self.triggers.judge(findings))
        if self.alerts is not None:
            alerts, desk = self.alerts
            for news in desk.look(findings, self.live.link.clock.now()):
                alerts.tell(self.live.session.bus, self.live.session.port, news)

    def _fire(self, fired: Iterable[Fired]) -> None:
        for one in fired:
            self.live.link.trigger(self.live.bus, one.time, one.text)

    def _say_status(self, status: Status) -> None:
        if status.error != self._trouble:
            self._trouble = status.error
            self._say(f"recording: {status.error or 'goes on'}")
        if status.closing and status.unwritten and not self._waited:
            self._waited = True
            self._say(waiting_words(status))

    def _say_event(self, event: LineEvent) -> None:
        if event.kind in (LineEventKind.UNPLUGGED, LineEventKind.REPLUGGED):
            self.before_saying()
            print(f"sniff485: {plain(event.text)}", file=sys.stderr)  # names the port
        elif event.kind in (LineEventKind.NOTE, LineEventKind.REFUSED):
            self._say(event.text)
        elif event.kind is LineEventKind.TRIGGER:
            self._say(f"triggered by {event.text}")
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
        self.before_saying()
        print(f"sniff485: {self.live.session.port}: {plain(text)}", file=sys.stderr)


def waiting_words(status: Status) -> str:
    """What is said while a slow disk gets time for what it did not take yet."""
    return (
        f"the disk is slow: waiting for the last {status.unwritten} octets to be written; "
        "end that, and lose them, with Ctrl-C"
    )


def run(printers: Sequence[Printer], progress: bool = True) -> int:
    """Listen to the buses of a capture until something ends it: a signal, its limits, the ports. Gives the exit code.

    A signal more ends the waiting for a slow disk, too. `progress`: say on standard error how searches for settings
    go, and how they ended.
    """
    lives = [printer.live for printer in printers]
    meter = _Meter(printers) if progress and printers[0].quiet and sys.stderr.isatty() else None
    if meter is not None:
        for printer in printers:
            printer.before_saying = meter.clear
    search_meters = {live.bus: searching.Meter() for live in lives if progress and live.searching is not None}
    heeded = 0
    with until_interrupted() as caught, _stopped_by_its_reader(lives[0]):
        while any(live.ended is None for live in lives):
            for number, printer in enumerate(printers):
                _turn(printer, 0.0 if number else 0.1, search_meters)
            if meter is not None and not search_meters:
                meter.show()
            if len(caught) > heeded:
                heeded = len(caught)
                lives[0].end()
        for printer in printers:
            printer.finish()
    for shown in (meter, *search_meters.values()):
        if shown is not None:
            shown.clear()
    return max(_code(live, bool(caught)) for live in lives)


def _turn(printer: Printer, timeout: float, search_meters: dict[int, searching.Meter]) -> None:
    """Take what has come of a bus; waits up to `timeout` seconds for something of any."""
    live = printer.live
    items = printer.poll(timeout)
    search_meter = search_meters.get(live.bus)
    if search_meter is not None:
        search_meter.follow(live)
        if live.searching is None:
            del search_meters[live.bus]
    printer.take(items)


def _code(live: LiveBus, interrupted: bool) -> int:
    """The exit code as far as one bus is concerned; says what went wrong with it."""
    if lost_something(live):
        return UNREADABLE  # what was asked for is not all in the file
    if live.ended is not None and not live.ended.clean:
        return PORT_TROUBLE
    if _gone_for_good(live):
        print(f"sniff485: {plain(live.session.port)}: gone for good; nothing more can be heard", file=sys.stderr)
        return PORT_TROUBLE
    if live.engine.searching:
        say_not_found(live, "interrupted" if interrupted else "ended")
        return INTERRUPTED if interrupted else PORT_TROUBLE
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


def say_end(printers: Sequence[Printer]) -> None:
    """The closing lines on standard error: what was heard, what was lost, where it is."""
    alone = len(printers) == 1
    for number, printer in enumerate(printers, 1):
        bus = "" if alone else f"{plain(printer.live.session.bus)}: "
        _say_counts(printer, bus)
        say_recorded(printer.live, number == len(printers), bus)


def _say_counts(printer: Printer, bus: str) -> None:
    summary = printer.summary
    noise = f", {summary.noise} octets of noise" if summary.noise else ""
    searched = f", {summary.searched} octets heard while searching" if summary.searched else ""
    print(
        f"sniff485: {bus}{summary.frames} frames ({summary.damaged} damaged), {summary.octets} octets{noise}"
        f"{searched}, bus load {summary.load.overall():.1%}",
        file=sys.stderr,
    )
    if summary.latency.count:
        middle, most = summary.latency.quantile(0.5), summary.latency.most
        assert middle is not None
        assert most is not None
        bound = milliseconds(printer.live.session.adapter.latency)
        print(
            f"sniff485: {bus}response time p50 {milliseconds(middle)}, max {milliseconds(most)} (each ±{bound})",
            file=sys.stderr,
        )


def say_recorded(live: LiveBus, where: bool = True, bus: str = "") -> None:
    """The last lines on standard error: what was not looked at, what was lost, where the recording is (unless said).
    `bus`: what the lines about octets begin with."""
    status, ended = live.status, live.ended
    if live.unseen:
        kept = "; the recording has them" if live.link.paths else ""
        print(f"sniff485: {bus}{live.unseen} octets not looked at: this host did not keep up{kept}", file=sys.stderr)
    if ended is not None and ended.unheard:
        what = "the last octets were not looked at, nobody knows how many: this host was too slow for them"
        print(f"sniff485: {what}{'; the recording has them' if live.link.paths else ''}", file=sys.stderr)
    if status.omitted:
        print(f"sniff485: {bus}{status.omitted} octets not kept: no trigger asked for them", file=sys.stderr)
    lost = status.lost
    if ended is not None and not ended.clean and status.unwritten:
        lost += status.unwritten
        print(f"sniff485: {bus}about {lost} octets NOT RECORDED: the capture process was ended", file=sys.stderr)
    elif lost:
        why = "" if status.error else ": the disk did not keep up"
        print(f"sniff485: {bus}{lost} octets NOT RECORDED{why}", file=sys.stderr)
    if live.file_is_gone:
        print(f"sniff485: {plain(status.path or live.link.paths[0])} is not there any more", file=sys.stderr)
    elif status.path and where:
        cut = "" if ended is None or ended.clean else ", cut where the capture was ended"
        print(f"sniff485: recorded to {plain(status.path)}{cut}", file=sys.stderr)


class _Meter:
    """A line a bus on the terminal, twice a second."""

    def __init__(self, printers: Sequence[Printer]) -> None:
        self.printers = printers
        self.began = time.monotonic()
        self.next = self.began
        self._shown = 0

    def show(self) -> None:
        now = time.monotonic()
        if now < self.next:
            return
        self.next = now + 0.5
        lines = [self._line(printer, now) for printer in self.printers]
        print(self._up() + "\n".join(f"\r\x1b[K{line}" for line in lines), end="", file=sys.stderr, flush=True)
        self._shown = len(lines)

    def _line(self, printer: Printer, now: float) -> str:
        summary, status = printer.summary, printer.live.status
        bus = "" if len(self.printers) == 1 else f"{plain(printer.live.session.bus)}  "
        text = (
            f"{bus}{now - self.began:.0f} s  {summary.frames} frames  {summary.damaged} damaged  {status.size} octets"
        )
        return text + (f"  disk slow: {status.behind:.0f} s behind" if status.behind else "")

    def _up(self) -> str:
        return f"\x1b[{self._shown - 1}A" if self._shown > 1 else ""

    def clear(self) -> None:
        """Take it off the screen."""
        if self._shown:
            print(f"{self._up()}\r\x1b[J", end="", file=sys.stderr, flush=True)
        self._shown = 0
