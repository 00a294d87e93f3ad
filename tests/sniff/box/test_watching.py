"""What befell a bus, and whether its capture goes on."""

from __future__ import annotations

from sniff.box.progress import SILENCE, STUCK, Progress
from sniff.box.status import State
from sniff.box.watch import QUIET, BusWatch
from sniff.capture.ipc import Ended, Status
from sniff.engine.event_texts import gone
from sniff.engine.session import LineEvent, LineEventKind

S = 1_000_000_000


def test_a_bus_is_what_was_last_proved() -> None:
    watch = BusWatch(0)
    assert watch.state(S)[0] is State.OVER
    watch.begin(S)
    assert watch.state(2 * S) == (State.SILENT, S, "nothing came yet")
    watch.see(Status(0, octets=5), 0, 3 * S)
    assert watch.state(4 * S)[0] is State.HEARD
    assert watch.state(3 * S + QUIET + 1) == (State.SILENT, 3 * S, "nothing comes any more")
    watch.event(LineEvent(5 * S, LineEventKind.UNPLUGGED, gone("/dev/x", "No such device")))
    assert watch.state(6 * S) == (State.DOWN, 5 * S, "No such device")
    assert watch.time_away(7 * S) == 2 * S
    watch.event(LineEvent(8 * S, LineEventKind.REPLUGGED, "/dev/x is back"))
    assert watch.state(9 * S) == (State.SILENT, 8 * S, "nothing came yet")
    assert (watch.downs, watch.away) == (1, 3 * S)


def test_what_was_heard_stays_counted() -> None:
    watch = BusWatch(0)
    watch.begin(0)
    watch.see(Status(0, octets=100, lost=3, unwritten=4), 2, S)
    watch.end(2 * S, Ended("capture process was ended by SIGKILL", clean=False), Status(0, unwritten=4))
    assert watch.state(3 * S) == (State.OVER, 2 * S, "capture process was ended by SIGKILL")
    watch.begin(3 * S)
    watch.see(Status(0, octets=10), 0, 4 * S)
    assert (watch.octets, watch.lost, watch.unseen) == (110, 7, 2)


def test_the_first_reason_for_hearing_nothing_stands() -> None:
    watch = BusWatch(0)
    watch.over(S, "no space left")
    watch.over(9 * S, "still no space left")
    assert watch.state(10 * S) == (State.OVER, S, "no space left")


def fed(*reports: Status, every: int = S) -> str | None:
    progress = Progress(0)
    for number, report in enumerate(reports, 1):
        progress.see(report, number * every)
    return progress.trouble(len(reports) * every)


def test_a_capture_that_says_nothing_hangs() -> None:
    progress = Progress(0)
    assert progress.trouble(SILENCE) is None
    assert "said nothing" in str(progress.trouble(SILENCE + S))
    progress.hear(SILENCE + S)
    assert progress.trouble(SILENCE + S) is None


def test_silence_on_the_bus_is_progress() -> None:
    assert fed(*[Status(0, octets=5)] * 300) is None


def test_what_is_not_written_for_long() -> None:
    heard = [Status(0, octets=5 * n, unwritten=5 * n) for n in range(1, 2 + STUCK // S)]
    assert "nothing was written" in str(fed(*heard, Status(0, octets=9999, unwritten=9999)))
    assert fed(*heard[:30]) is None


def test_a_full_disk_is_said_and_starting_anew_makes_no_room() -> None:
    heard = [Status(0, octets=9 * n, unwritten=5 * n, lost=4 * n, error="disk full") for n in range(1, 300)]
    assert fed(*heard) is None


def test_a_disk_that_hangs_until_octets_are_lost() -> None:
    heard = [Status(0, octets=9 * n, unwritten=100, lost=9 * n - 100, behind=n) for n in range(12, 40)]
    assert "octets are lost" in str(fed(*heard))
