from __future__ import annotations

import os
import signal
import subprocess
import sys
import time

import pytest

from dissectors.frame import Chunk
from dissectors.line import LineSettings
from sniff.capture.config import RecordSpec, SourceSpec
from sniff.capture.ipc import Ended, ReceivedMessage, Status, Tick
from sniff.capture.link import CaptureLink
from sniff.engine.capture import CaptureError
from sniff.engine.session import LineEvent, LineEventKind
from sniff.recording.derived_message import DerivedMessage
from sniff.sources import PortError
from tests.e2e.recording_bus import octets_of

LINE = LineSettings.parse("19200,8E1")


def test_octets_and_times_arrive_and_every_bus_keeps_its_own(make_pty, collect, octets) -> None:
    buses = [make_pty() for _ in range(3)]
    specs = [SourceSpec(pty.path, LINE, bus=f"bus{number}") for number, pty in enumerate(buses)]
    with CaptureLink.start(specs) as link:
        assert [link.session(number).bus for number in range(3)] == ["bus0", "bus1", "bus2"]
        assert link.session(1).started == link.clock.wall
        begun = link.clock.now()
        for number, pty in enumerate(buses):
            pty.feed(bytes([number]) * 100 + b"\xff\x00")
        messages = collect(link, lambda got: all(len(octets(got, number)) >= 102 for number in range(3)))
        done = link.clock.now()
    for number in range(3):
        assert octets(messages, number) == bytes([number]) * 100 + b"\xff\x00"
    times = [message.item.time for message in messages if isinstance(message, ReceivedMessage)]
    assert times == sorted(times)
    assert begun < times[0]
    assert times[-1] < done


def test_a_tick_vouches_for_all_that_came_before(pty, collect) -> None:
    with CaptureLink.start([SourceSpec(pty.path, LINE)]) as link:
        messages = []
        for _ in range(20):
            pty.feed(b"\x01\x02\x03")
            messages += collect(link, lambda got: any(isinstance(message, ReceivedMessage) for message in got))
        messages += collect(link, lambda got: sum(isinstance(message, Tick) for message in got) >= 3)
        messages += link.stop()
    told = 0
    for message in messages:
        if isinstance(message, Tick):
            assert message.now >= told
            told = message.now
        elif isinstance(message, ReceivedMessage):
            assert message.item.time >= told


def test_stopping_gives_the_rest_and_the_end(pty, octets) -> None:
    link = CaptureLink.start([SourceSpec(pty.path, LINE)])
    pty.feed(b"last")
    messages = link.stop()
    assert messages[-1] == Ended("stopped")
    assert octets(messages) == b"last"
    assert link.receive() == []
    assert not link.look()  # who shares it may look once more
    with pytest.raises(ProcessLookupError):
        os.kill(link.pid, 0)


def test_errors_of_opening_reach_the_caller_in_words(tmp_path, pty) -> None:
    with pytest.raises(PortError, match=r"^/dev/ttyNONE: no such port; "):
        CaptureLink.start([SourceSpec("/dev/ttyNONE", LINE)])
    taken = tmp_path / "taken.mcap"
    taken.write_bytes(b"precious")
    with pytest.raises(CaptureError, match=r"taken\.mcap"):
        CaptureLink.start([SourceSpec(pty.path, LINE)], RecordSpec(str(taken)))
    assert taken.read_bytes() == b"precious"
    with pytest.raises(CaptureError, match="rotation"):
        CaptureLink.start([SourceSpec(pty.path, LINE)], RecordSpec(str(tmp_path / "a.mcap"), "often"))


def test_a_second_capture_is_told_who_holds_the_port(pty, tmp_path) -> None:
    file = str(tmp_path / "night.mcap")
    with CaptureLink.start([SourceSpec(pty.path, LINE)], RecordSpec(file)) as link:
        with pytest.raises(PortError) as caught:
            CaptureLink.start([SourceSpec(pty.path, LINE)])
        assert f"pid {link.pid} (sniff485 {pty.path} {file})" in str(caught.value)
        assert f"kill {link.pid}" in str(caught.value)


def test_status_says_what_is_known(pty, tmp_path, collect) -> None:
    file = str(tmp_path / "night.mcap")
    with CaptureLink.start([SourceSpec(pty.path, LINE)], RecordSpec(file)) as link:
        assert link.paths == [file]
        pty.feed(bytes(1000))
        messages = collect(link, lambda got: any(isinstance(m, Status) and m.octets == 1000 for m in got))
        status = [message for message in messages if isinstance(message, Status)][-1]
    assert (status.bus, status.path, status.octets, status.dropped, status.lost, status.error) == (
        0,
        file,
        1000,
        0,
        0,
        "",
    )
    assert status.priority == link.priority != ""
    assert status.size > 0


def test_unplugged_port_ends_the_capture(pty, collect) -> None:
    link = CaptureLink.start([SourceSpec(pty.path, LINE)])
    pty.unplug()
    messages = []
    while link.ended is None:
        messages += link.receive(1)
    assert [m.item.kind for m in messages if isinstance(m, ReceivedMessage)] == [LineEventKind.UNPLUGGED]
    assert link.ended == Ended("nothing more to read", at_end=True)
    link.stop()


def test_one_of_two_ports_gone_is_no_end(make_pty, collect, octets) -> None:
    gone, stays = make_pty(), make_pty()
    with CaptureLink.start([SourceSpec(gone.path, LINE, bus="a"), SourceSpec(stays.path, LINE, bus="b")]) as link:
        gone.unplug()
        messages = collect(link, lambda got: any(isinstance(message, ReceivedMessage) for message in got))
        assert [m.bus for m in messages if isinstance(m, ReceivedMessage)] == [0]
        stays.feed(b"still here")
        collect(link, lambda got: octets(got, 1) == b"still here")


def test_settings_change_without_closing(pty, collect, octets) -> None:
    with CaptureLink.start([SourceSpec(pty.path, LINE)]) as link:
        link.reconfigure(0, LineSettings.parse("76800,8N1"))
        messages = collect(link, lambda got: any(isinstance(message, ReceivedMessage) for message in got))
        events = [message.item for message in messages if isinstance(message, ReceivedMessage)]
        assert [(event.kind, event.text) for event in events] == [(LineEventKind.SETTINGS, "line=76800,8N1")]
        pty.feed(b"\xff\x01")
        collect(link, lambda got: octets(got) == b"\xff\x01")


def test_a_duration_ends_it(pty) -> None:
    link = CaptureLink.start([SourceSpec(pty.path, LINE)], duration=0.2)
    while link.ended is None:
        link.receive(1)
    assert link.ended == Ended("the time asked for is over")
    link.stop()


def test_sigterm_ends_it_with_a_reason(pty) -> None:
    link = CaptureLink.start([SourceSpec(pty.path, LINE)])
    os.kill(link.pid, signal.SIGTERM)
    while link.ended is None:
        link.receive(1)
    assert link.ended == Ended("stopped by SIGTERM")
    link.stop()


def test_a_crash_of_the_capture_process_is_an_end_that_is_not_clean(pty) -> None:
    link = CaptureLink.start([SourceSpec(pty.path, LINE)])
    os.kill(link.pid, signal.SIGKILL)
    while link.ended is None:
        link.receive(1)
    assert link.ended == Ended("capture process was ended by SIGKILL", clean=False)
    link.stop()


def test_without_a_recording_it_ends_with_its_main_process(pty) -> None:
    code = (
        "import sys, time\n"
        "from sniff.capture.link import CaptureLink, SourceSpec\n"
        f"link = CaptureLink.start([SourceSpec({pty.path!r})])\n"
        "print(link.pid, flush=True)\n"
        "time.sleep(60)\n"
    )
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE) as main:
        assert main.stdout is not None
        pid = int(main.stdout.readline())
        main.kill()
    wait_until_gone(pid)


def wait_until_gone(pid: int, seconds: float = 10.0) -> None:
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        try:
            with open(f"/proc/{pid}/stat", encoding="ascii") as stat:
                if stat.read().rsplit(")", 1)[1].split()[0] == "Z":
                    return  # ended; whoever inherited it has not looked yet
        except FileNotFoundError:
            return
        time.sleep(0.02)
    os.kill(pid, signal.SIGKILL)
    pytest.fail(f"process {pid} did not end")


def test_where_no_socket_can_be_inherited(pty, tmp_path, monkeypatch, collect, octets) -> None:
    """As on Windows: the capture process connects to the main process and proves who it is."""
    import tempfile

    from sniff.capture import link, spawn

    def over_the_network(words):
        errors = tempfile.TemporaryFile()  # noqa: SIM115 (closed by the link)
        command = [sys.executable, "-P", "-m", "sniff.capture.process", *words]
        return spawn._spawn_and_listen(command, {"stdout": errors, "stderr": errors}, errors)

    monkeypatch.setattr(link, "spawn", over_the_network)
    file = str(tmp_path / "x.mcap")
    with CaptureLink.start([SourceSpec(pty.path, LINE)], RecordSpec(file)) as running:
        pty.feed(b"\x01\xff")
        collect(running, lambda got: octets(got) == b"\x01\xff")
        assert running.derived(0, DerivedMessage("/bus/bus", "sniff485.Bus", 1, 1, b"{}"))


def test_nothing_in_the_current_folder_is_imported(pty, tmp_path, monkeypatch) -> None:
    (tmp_path / "serial.py").write_text("raise SystemExit('hostile')")
    (tmp_path / "mcap.py").write_text("raise SystemExit('hostile')")
    monkeypatch.chdir(tmp_path)
    with CaptureLink.start([SourceSpec(pty.path, LINE)], RecordSpec("here.mcap")) as link:
        assert os.path.samefile(link.paths[0], tmp_path / "here.mcap")


def test_a_capture_as_a_bus(tmp_path, collect) -> None:
    file = tmp_path / "poll.cap.txt"
    file.write_text("#!sniff-capture 1\n# line: 19200,8E1\n# start: 2026-03-01T10:00:00Z\n+0 01 02\n+30 03\n+5 04\n")
    link = CaptureLink.start([SourceSpec(str(file), LINE)])
    assert link.session(0).started == 1_772_359_200_000_000_000
    messages = []
    while link.ended is None:
        messages += link.receive(1)
    link.stop()
    chunks = [message.item for message in messages if isinstance(message, ReceivedMessage)]
    assert [chunk.octets for chunk in chunks if isinstance(chunk, Chunk)] == [b"\x01\x02", b"\x03", b"\x04"]
    ticks = [message.now for message in messages if isinstance(message, Tick)]
    assert ticks == sorted(ticks)
    assert ticks[-1] == chunks[-1].time


def test_results_find_their_way_into_the_file(pty, tmp_path) -> None:
    from mcap.reader import make_reader

    file = tmp_path / "night.mcap"
    link = CaptureLink.start([SourceSpec(pty.path, LINE)], RecordSpec(str(file)))
    assert link.derived(0, DerivedMessage("/bus/bus", "sniff485.Bus", 2_000, 1_000, b'{"load": 0.5}'))
    link.stop()
    with file.open("rb") as stream:
        results = [
            (channel.topic, message.log_time, message.data)
            for _, channel, message in make_reader(stream).iter_messages(topics=["/bus/bus"])
        ]
    assert results == [("/bus/bus", 2_000, b'{"load": 0.5}')]
    assert not link.derived(0, DerivedMessage("/bus/bus", "sniff485.Bus", 2_000, 1_000, b"{}"))
    assert link.derived_dropped == 1


def test_a_file_that_is_removed_at_the_very_end_is_told(pty, tmp_path) -> None:
    path = tmp_path / "a.mcap"
    with CaptureLink.start([SourceSpec(pty.path, LINE)], RecordSpec(str(path))) as link:
        pty.feed(b"gone")
        while not octets_of(path):
            link.receive(0.1)
        path.unlink()
        messages = link.stop()
    notes = [one.item.text for one in messages if isinstance(one, ReceivedMessage) and isinstance(one.item, LineEvent)]
    assert any("was removed while it was recorded" in note for note in notes)
    status = [one for one in messages if isinstance(one, Status)][-1]
    assert status.taken_away == status.lost == 4


def test_a_clock_step_is_told(monkeypatch) -> None:
    from sniff.capture.ipc_sender import IpcSender
    from sniff.capture.loop import CaptureLoop
    from sniff.sources.clock import Clock

    class Stepping(Clock):
        steps = (0, 400_000, 1_500_000, 1_600_000, -3_000_000_000)

        def drift(self) -> int:
            type(self).steps, step = self.steps[1:], self.steps[0]
            return step

    class Silent:
        ended = False

        def fileno(self):
            return None

        def deadline(self):
            return None

        def read(self):
            return []

        def now(self):
            return 0

    import socket

    here, there = socket.socketpair()
    with here, there:
        kept: list[LineEvent] = []
        outlet = IpcSender(here, 1)
        monkeypatch.setattr(outlet, "item", lambda bus, item: kept.append(item))
        loop = CaptureLoop(Stepping(0, 0), [Silent()], [], outlet)
        monkeypatch.setattr("sniff.capture.loop.STATUS_EVERY", 0)
        monkeypatch.setattr("sniff.capture.loop.IDLE_BEAT", 0)
        step = loop._check_clock

        def until_all_are_taken():
            step()
            if not Stepping.steps:
                loop.stop("enough")
                monkeypatch.setattr(loop, "_check_clock", lambda: None)

        monkeypatch.setattr(loop, "_check_clock", until_all_are_taken)
        loop.run()
        outlet.close()
    assert [(event.kind, event.count) for event in kept] == [
        (LineEventKind.CLOCK, 1_500_000),
        (LineEventKind.CLOCK, -3_000_000_000),
    ]
    assert {event.time for event in kept} == {Silent().now()}, "a capture that is played has times of its own"
