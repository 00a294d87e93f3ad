"""Listening, as `live`, `record` and `demo` share it: how a capture is started, run and ended."""

from __future__ import annotations

import contextlib
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from functools import partial

from dissectors.findings import counted
from dissectors.profiles import Devices
from dissectors.words import milliseconds, percent
from sniff.analysis.sanitizing import sanitized
from sniff.bus.live import LiveBus
from sniff.bus.router import Router
from sniff.capture.config import RecordSpec, SourceSpec
from sniff.capture.ipc import Status
from sniff.capture.link import CaptureLink
from sniff.cli import INTERRUPTED, PORT_TROUBLE, UNREADABLE, Failure, searching, standard_streams
from sniff.cli.interruption import is_interrupted, until_interrupted
from sniff.cli.printing import Printer
from sniff.cli.searching import Unknowns
from sniff.cli.targets import Target
from sniff.engine.capture import CaptureError
from sniff.formats.table import suffixes
from sniff.sources import PortError


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
        lives = [_live(link, router, bus, target, watched) for bus, target in enumerate(targets)]
        for live in lives:
            live.beside_others = len(lives) > 1
        return lives
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
        return CaptureLink.start(sources, record, duration, count, watched, is_interrupted)
    except PortError as error:
        raise Failure(str(error), PORT_TROUBLE) from None
    except CaptureError as error:
        raise Failure(str(error), UNREADABLE) from None


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
    with until_interrupted() as caught, _stopped_by_its_reader(lives[0]):
        ending = _Ending(lives[0], caught)
        with standard_streams.abandoned_once(ending.is_asked_for):
            while any(live.ended is None for live in lives):
                for number, printer in enumerate(printers):
                    _without_waiting_for_its_reader(partial(_turn, printer, 0.0 if number else 0.1, search_meters))
                if meter is not None and not search_meters:
                    meter.show()
                ending.heed()
            for printer in printers:
                _without_waiting_for_its_reader(printer.finish)
    for shown in (meter, *search_meters.values()):
        if shown is not None:
            shown.clear()
    return max(_code(live, bool(caught)) for live in lives)


class _Ending:
    """Signals, and what they ask of a capture: its end, and again no patience with the disk."""

    def __init__(self, live: LiveBus, caught: list[int]) -> None:
        self._live, self._caught = live, caught
        self._heeded = 0

    def heed(self) -> None:
        """Hand on what came since."""
        if len(self._caught) > self._heeded:
            self._heeded = len(self._caught)
            self._live.end()

    def is_asked_for(self) -> bool:
        """Whether it is over, as far as can be seen by somebody who waits for something else."""
        self.heed()
        self._live.link.look()
        return bool(self._heeded) or self._live.link.closing


def _without_waiting_for_its_reader(step: Callable[[], None]) -> None:
    """Do what prints; from where nobody takes it any more it is printed to nowhere."""
    try:
        step()
    except standard_streams.NotTaken as error:
        standard_streams.give_output_up()
        standard_streams.say(f"{error.filename}: {error.strerror}; what came last is not in it")


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
        print(f"sniff485: {sanitized(live.session.port)}: gone for good; nothing more can be heard", file=sys.stderr)
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
    print(
        f"sniff485: {sanitized(live.session.port)}: {how} while searching, no settings found: {said}", file=sys.stderr
    )
    if live.status.path:
        print("sniff485: the recording has every octet; read it with -s and -p once they are known", file=sys.stderr)


def say_end(printers: Sequence[Printer]) -> None:
    """The closing lines on standard error: what was heard, what was lost, where it is."""
    alone = len(printers) == 1
    for number, printer in enumerate(printers, 1):
        bus = "" if alone else f"{sanitized(printer.live.session.bus)}: "
        _say_counts(printer, bus)
        say_recorded(printer.live, number == len(printers), bus)


def _say_counts(printer: Printer, bus: str) -> None:
    summary = printer.summary
    noise = f", {counted(summary.noise, 'octet')} of noise" if summary.noise else ""
    searched = f", {counted(summary.searched, 'octet')} heard while searching" if summary.searched else ""
    has_times = printer.live.session.has_times  # a file that stands in for a port may have none
    load = f", bus load {percent(summary.load.overall())}" if has_times else ""
    print(
        f"sniff485: {bus}{counted(summary.frames, 'frame')} ({summary.damaged} damaged), "
        f"{counted(summary.octets, 'octet')}{noise}{searched}{load}",
        file=sys.stderr,
    )
    if summary.latency.count and has_times:
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
        print(
            f"sniff485: {bus}{counted(live.unseen, 'octet')} not looked at: this host did not keep up{kept}",
            file=sys.stderr,
        )
    if ended is not None and ended.unheard:
        what = "the last octets were not looked at, nobody knows how many: this host was too slow for them"
        print(f"sniff485: {what}{'; the recording has them' if live.link.paths else ''}", file=sys.stderr)
    if status.omitted:
        print(f"sniff485: {bus}{counted(status.omitted, 'octet')} not kept: no trigger asked for them", file=sys.stderr)
    say_lost(live, bus)
    if live.file_is_gone:
        print(f"sniff485: {sanitized(status.path or live.link.paths[0])} is not there any more", file=sys.stderr)
    elif status.path and where:
        cut = "" if ended is None or ended.clean else ", cut where the capture was ended"
        print(f"sniff485: recorded to {sanitized(status.path)}{cut}", file=sys.stderr)


def say_lost(live: LiveBus, bus: str = "") -> None:
    """What is not in the recording, on standard error; nothing where all is. `bus`: what the line begins with."""
    status, ended = live.status, live.ended
    lost = status.lost
    if ended is not None and not ended.clean and status.unwritten:
        lost += status.unwritten
        print(
            f"sniff485: {bus}about {counted(lost, 'octet')} NOT RECORDED: the capture process was ended",
            file=sys.stderr,
        )
    elif lost:
        why = "" if status.error else _why_lost(status)
        print(f"sniff485: {bus}{counted(lost, 'octet')} NOT RECORDED{why}", file=sys.stderr)


def _why_lost(status: Status) -> str:
    """Where octets went that were heard and are in no file."""
    if status.taken_away < status.lost:
        too = f", and {status.taken_away} of them were in files that were taken away" if status.taken_away else ""
        return f": the disk did not keep up{too}"
    return ": they were in files that were taken away"


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
        told = self.printers[0].telling
        if told is not None and told.counted:
            lines[0] += f"  {sanitized(told.counted)}"
        print(self._up() + "\n".join(f"\r\x1b[K{line}" for line in lines), end="", file=sys.stderr, flush=True)
        self._shown = len(lines)

    def _line(self, printer: Printer, now: float) -> str:
        summary, status = printer.summary, printer.live.status
        bus = "" if len(self.printers) == 1 else f"{sanitized(printer.live.session.bus)}  "
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
