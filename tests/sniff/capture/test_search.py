"""A capture whose settings are searched for: one opening, one file, every octet with the settings it was heard with."""

from __future__ import annotations

import os
import signal
import socket
from pathlib import Path

from dissectors.frame import Chunk
from dissectors.line import LineSettings
from sniff.capture.config import RecordSpec, SourceSpec
from sniff.capture.ipc import ReceivedMessage
from sniff.capture.link import CaptureLink
from sniff.engine.event_texts import SettingsChange
from sniff.engine.session import LineEvent, LineEventKind
from sniff.formats import read
from tests.e2e.recording_bus import octets_of, wait_until

FIRST, SECOND = LineSettings.parse("9600,8N1"), LineSettings.parse("19200,8E1")
UNKNOWN = ("line", "protocol")


def changes(items) -> list[str]:
    return [item.text for item in items if isinstance(item, LineEvent) and item.kind is LineEventKind.SETTINGS]


def seen(messages) -> list:
    return [message.item for message in messages if isinstance(message, ReceivedMessage)]


def parts(items) -> list[bytes | str]:
    """Octets between the changes, and the changes."""
    result: list[bytes | str] = []
    for item in items:
        if isinstance(item, Chunk):
            if result and isinstance(result[-1], bytes):
                result[-1] += item.octets
            else:
                result.append(item.octets)
        elif item.kind is LineEventKind.SETTINGS:
            result.append(item.text)
    return result


def test_what_is_heard_while_searching_is_in_the_file_with_its_settings(pty, collect, octets, tmp_path: Path) -> None:
    path = tmp_path / "found.mcap"
    with CaptureLink.start([SourceSpec(pty.path, FIRST, "n2", unknown=UNKNOWN)], RecordSpec(str(path))) as link:
        assert link.paths == [str(path)]
        assert link.session(0).unknown == UNKNOWN
        pty.feed(b"before")
        messages = collect(link, lambda got: len(octets(got)) >= 6)
        link.reconfigure(0, SECOND)
        messages += collect(link, lambda got: changes(seen(got)))
        pty.feed(b"while")
        messages += collect(link, lambda got: len(octets(got)) >= 5)
        link.found(0, SECOND, "modbus-ascii")
        messages += collect(link, lambda got: changes(seen(got)))
        pty.feed(b"after")
        messages += collect(link, lambda got: len(octets(got)) >= 5)
    expected = [
        "line=9600,8N1 searching", b"before", "line=19200,8E1", b"while",
        "line=19200,8E1 protocol=modbus-ascii found", b"after",
    ]  # fmt: skip
    assert parts(seen(messages)) == expected
    capture = read(path)
    assert parts(capture.items()) == expected
    assert (capture.session.protocol, capture.session.line, capture.session.unknown) == ("modbus-ascii", SECOND, ())
    assert capture.completeness().whole


def test_octets_that_wait_in_the_port_belong_to_the_settings_before(pty, collect, octets, tmp_path: Path) -> None:
    path = tmp_path / "waiting.mcap"
    with CaptureLink.start([SourceSpec(pty.path, FIRST, unknown=UNKNOWN)], RecordSpec(str(path))) as link:
        os.kill(link.pid, signal.SIGSTOP)
        pty.feed(b"old")
        link.reconfigure(0, SECOND)
        os.kill(link.pid, signal.SIGCONT)
        collect(link, lambda got: octets(got) == b"old" and len(changes(seen(got))) == 2)
    assert parts(read(path).items()) == ["line=9600,8N1 searching", b"old", "line=19200,8E1"]


def test_every_part_of_a_rotation_says_the_settings_it_begins_with(pty, collect, octets, tmp_path: Path) -> None:
    path = tmp_path / "r.mcap"
    heard = []
    with CaptureLink.start([SourceSpec(pty.path, FIRST, unknown=UNKNOWN)], RecordSpec(str(path), "count:1")) as link:
        for number in range(6):
            pty.feed(b"%d" % number)
            heard += seen(collect(link, lambda got: octets(got)))
            recorded = b"".join(b"%d" % one for one in range(number + 1))  # a batch is never torn: wait for its end
            wait_until(lambda due=recorded: b"".join(map(octets_of, sorted(tmp_path.iterdir()))) == due, "not recorded")
            if number == 1:
                link.reconfigure(0, SECOND)
            elif number == 3:
                link.found(0, SECOND, "modbus-ascii")
    found = sorted(tmp_path.iterdir())
    assert len(found) > 2
    items = [item for part in found for item in read(part).items()]
    assert b"".join(item.octets for item in items if isinstance(item, Chunk)) == b"012345"
    in_force = None
    for part in found:  # each alone: whatever it holds, its beginning is known
        capture = read(part)
        for item in capture.items():
            change = SettingsChange.parse(item.text) if isinstance(item, LineEvent) else None
            if change is not None:
                in_force = change
            elif item.octets in (b"0", b"1"):
                assert (in_force.line, in_force.searching) == (FIRST, True)
        in_force = None
    assert [read(part).session.unknown for part in found] == sorted(
        (read(part).session.unknown for part in found), reverse=True
    ), "unknown first, known from some part on"
    last = read(found[-1]).session
    assert (last.line, last.protocol, last.unknown) == (SECOND, "modbus-ascii", ())


def test_without_a_main_process_nobody_searches_so_it_ends_whole(pty, collect, octets, tmp_path: Path) -> None:
    path = tmp_path / "left.mcap"
    link = CaptureLink.start([SourceSpec(pty.path, FIRST, unknown=UNKNOWN)], RecordSpec(str(path)))
    pty.feed(b"heard")
    collect(link, lambda got: len(octets(got)) >= 5)
    link._connection.close()
    assert link._process.wait(10) == 0
    link._kill()
    capture = read(path)
    assert parts(capture.items()) == ["line=9600,8N1 searching", b"heard"]
    assert capture.completeness().whole
    assert capture.session.unknown == UNKNOWN


def test_with_the_line_known_it_goes_on_recording(pty, collect, octets, tmp_path: Path) -> None:
    path = tmp_path / "known.mcap"
    link = CaptureLink.start([SourceSpec(pty.path, FIRST, unknown=("protocol",))], RecordSpec(str(path)))
    link._connection.close()
    pty.feed(b"heard")
    wait_until(lambda: octets_of(path) == b"heard", "not recorded")
    assert link._process.poll() is None
    link._process.terminate()
    assert link._process.wait(10) == 0
    link._kill()
    assert parts(read(path).items()) == ["line=9600,8N1 searching", b"heard"]


def test_a_refusal_is_in_the_file(tmp_path: Path, collect) -> None:
    path = tmp_path / "refused.mcap"
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = f"socket://127.0.0.1:{server.getsockname()[1]}"
        with CaptureLink.start([SourceSpec(port, FIRST, unknown=UNKNOWN)], RecordSpec(str(path))) as link:
            link.reconfigure(0, SECOND)
            collect(link, lambda got: any(getattr(item, "kind", None) is LineEventKind.REFUSED for item in seen(got)))
    notes = [item.text for item in read(path).items() if item.kind is LineEventKind.REFUSED]
    assert "sets its own line (19200,8E1 was asked for)" in notes[0]
