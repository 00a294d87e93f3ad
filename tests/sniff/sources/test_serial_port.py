from __future__ import annotations

import os
import time

import pytest

from dissectors.frame import Chunk, LineError, Mark
from dissectors.line import LineSettings
from sniff.engine.session import Item, LineEvent, LineEventKind
from sniff.sources import PortError, open_source, serial_port, tty
from sniff.sources.clock import Clock
from sniff.sources.serial_port import SerialSource

LINE = LineSettings.parse("19200,8E1")


def gather(source: SerialSource, enough, seconds: float = 5.0) -> list[Item]:
    """Read until `enough(items)`; fails the test when that never comes."""
    items: list[Item] = []
    until = time.monotonic() + seconds
    while not enough(items):
        assert time.monotonic() < until, f"only {items}"
        items += source.read()
        time.sleep(0.002)
    return items


def octets(items: list[Item]) -> bytes:
    return b"".join(item.octets for item in items if isinstance(item, Chunk))


def kinds(items: list[Item]) -> list[LineEventKind]:
    return [item.kind for item in items if isinstance(item, LineEvent)]


@pytest.fixture
def source(pty):
    source = SerialSource(pty.path, LINE, Clock.start())
    yield source
    source.close()


def test_every_octet_value_arrives_once(pty, source) -> None:
    everything = bytes(range(256)) + b"\xff" * 9 + b"\x00" * 3
    pty.feed(everything)
    assert octets(gather(source, lambda items: len(octets(items)) >= len(everything))) == everything
    assert source.read() == []
    assert pty.heard() == b""


def test_time_is_between_feeding_and_reading(pty) -> None:
    clock = Clock.start()
    source = SerialSource(pty.path, LINE, clock)
    before = clock.now()
    pty.feed(b"\x01")
    (chunk,) = gather(source, bool)
    assert before < chunk.time <= clock.now()
    source.close()


@pytest.mark.parametrize("token", ["300,7E1", "9600,8N2", "76800,8N1", "250000,8O1", "19200,8N1.5"])
def test_any_line_settings_are_marked_for_errors(pty, token) -> None:
    import termios

    source = SerialSource(pty.path, LineSettings.parse(token), Clock.start())
    attributes = termios.tcgetattr(source.fileno())
    assert attributes[0] & termios.PARMRK
    assert attributes[0] & termios.INPCK
    assert not attributes[0] & (termios.IGNPAR | termios.IGNBRK | termios.BRKINT | termios.ISTRIP | termios.IXOFF)
    assert not attributes[3] & (termios.ECHO | termios.ICANON | termios.ISIG)
    source.close()


def test_settings_change_in_place_and_marks_stay(pty, source) -> None:
    import termios

    before = source.fileno()
    for token in ("76800,8N1", "9600,8O1"):
        source.reconfigure(LineSettings.parse(token))
        assert source.fileno() == before
        assert termios.tcgetattr(before)[0] & termios.PARMRK
        (event,) = source.read()
        assert (event.kind, event.text) == (LineEventKind.SETTINGS, f"line={token}")
    pty.feed(b"\xff\x01")
    assert octets(gather(source, lambda items: len(octets(items)) >= 2)) == b"\xff\x01"


def test_rts_and_dtr_are_cleared_before_anything_else(pty, monkeypatch) -> None:
    import fcntl
    import struct
    import termios

    calls: list[str] = []
    lines = struct.pack("I", termios.TIOCM_RTS | termios.TIOCM_DTR)
    real_ioctl, real_set = fcntl.ioctl, termios.tcsetattr

    def ioctl(fd, request, *arguments):
        if request in (termios.TIOCMBIC, termios.TIOCMBIS, termios.TIOCMSET):
            calls.append("clear" if (request, arguments[0]) == (termios.TIOCMBIC, lines) else "other")
        return real_ioctl(fd, request, *arguments)

    def tcsetattr(*arguments):
        calls.append("configure")
        return real_set(*arguments)

    monkeypatch.setattr(fcntl, "ioctl", ioctl)
    monkeypatch.setattr(termios, "tcsetattr", tcsetattr)
    SerialSource(pty.path, LINE, Clock.start()).close()
    assert calls[:2] == ["clear", "configure"]
    assert termios.TIOCMBIS not in calls


def test_modem_lines_are_never_raised(pty, source) -> None:
    port = source._port
    for name in ("rts", "dtr"):
        with pytest.raises(PermissionError):
            setattr(port, name, True)


@pytest.mark.parametrize(
    "send",
    [
        lambda port: port.write(b"x"),
        lambda port: port.writelines([b"x"]),
        lambda port: port.send_break(),
        lambda port: port.sendBreak(),
        lambda port: setattr(port, "break_condition", True),
        lambda port: port.set_input_flow_control(False),
        lambda port: port.set_output_flow_control(False),
    ],
)
def test_nothing_can_be_sent(pty, source, send) -> None:
    with pytest.raises(PermissionError):
        send(source._port)
    assert pty.heard() == b""


def test_the_source_has_no_way_to_send() -> None:
    assert not [name for name in dir(SerialSource) if "write" in name or "send" in name]


def test_a_second_listener_is_refused_and_told_who(pty, source) -> None:
    with pytest.raises(PortError) as caught:
        SerialSource(pty.path, LINE, Clock.start())
    assert f"{pty.path}: held by" in str(caught.value)
    assert f"pid {os.getpid()}" in str(caught.value)


@pytest.mark.parametrize("real", [True, False])
def test_others_are_kept_out_of_a_real_port(pty, monkeypatch, real) -> None:
    import fcntl
    import termios

    requests = []
    ioctl = fcntl.ioctl
    monkeypatch.setattr(
        fcntl, "ioctl", lambda fd, request, *rest: requests.append(request) or ioctl(fd, request, *rest)
    )
    monkeypatch.setattr(tty, "is_pty", lambda device: not real)
    SerialSource(pty.path, LINE, Clock.start()).close()
    assert (termios.TIOCEXCL in requests) is real


def test_free_again_after_closing(pty, source) -> None:
    source.close()
    assert source.ended
    assert source.read() == []
    SerialSource(pty.path, LINE, Clock.start()).close()


def test_marked_errors_are_taken_out_of_the_stream(pty, source, monkeypatch) -> None:
    """A pseudo-terminal has no errors, so the read itself is replaced by what a UART's tty would give."""
    stream = [b"\x01\xff\x00\x41\xff", b"\xff\xff\x00\x00"]
    monkeypatch.setattr(serial_port.os, "read", lambda fd, size: stream.pop(0))
    first, second = source.read() + source.read()
    both = LineError.PARITY | LineError.FRAMING
    assert (first.octets, first.marks) == (b"\x01\x41", (Mark(1, both),))
    assert (second.octets, second.marks) == (b"\xff\x00", (Mark(1, LineError.BREAK),))


def test_errors_that_the_driver_only_counted(pty, monkeypatch) -> None:
    counters = {"framing": 5, "parity": 0, "overrun": 1, "break": 0, "buffer overrun": 0}
    monkeypatch.setattr(serial_port, "error_counters", lambda fd: dict(counters))
    monkeypatch.setattr(serial_port, "COUNTERS_EVERY", 0)
    source = SerialSource(pty.path, LINE, Clock.start())
    assert source.read() == []
    counters.update(framing=8, overrun=2)
    events = source.read()
    assert {(event.kind, event.text, event.count) for event in events} == {
        (LineEventKind.ERRORS, "framing", 3),
        (LineEventKind.ERRORS, "overrun", 1),
    }
    assert source.read() == []
    source.close()


def test_counted_errors_that_were_marked_are_not_told_twice(pty, monkeypatch) -> None:
    counters = {"framing": 0, "parity": 0, "overrun": 0, "break": 0, "buffer overrun": 0}
    monkeypatch.setattr(serial_port, "error_counters", lambda fd: dict(counters))
    monkeypatch.setattr(serial_port, "COUNTERS_EVERY", 0)
    source = SerialSource(pty.path, LINE, Clock.start())
    monkeypatch.setattr(serial_port.os, "read", lambda fd, size: b"\xff\x00\x41")
    counters.update(parity=1, overrun=4)
    assert kinds(source.read()) == [LineEventKind.ERRORS]  # the overrun: no octet can carry it
    monkeypatch.undo()
    source.close()


def test_unplugged_pseudo_terminal_is_gone_for_good(pty, source) -> None:
    pty.unplug()
    (event,) = gather(source, bool)
    assert event.kind is LineEventKind.UNPLUGGED
    assert pty.path in event.text
    assert source.fileno() is None
    assert source.ended
    assert source.deadline() is None


def test_unplugged_in_the_middle_of_an_escape(pty, source, monkeypatch) -> None:
    reads = [b"\x01\xff", b""]
    monkeypatch.setattr(serial_port.os, "read", lambda fd, size: reads.pop(0))
    items = source.read() + source.read()
    assert octets(items) == b"\x01\xff"
    assert kinds(items) == [LineEventKind.UNPLUGGED]
    assert isinstance(items[-1], LineEvent)


def test_a_link_made_anew_is_followed(pty, tmp_path, monkeypatch) -> None:
    import tty as raw

    monkeypatch.setattr(serial_port, "RETRY_EVERY", 20_000_000)
    link = tmp_path / "boiler"
    link.symlink_to(pty.path)
    source = SerialSource(str(link), LINE, Clock.start())
    pty.unplug()
    items = gather(source, bool)
    assert not source.ended
    master, slave = os.openpty()
    raw.setraw(slave)
    for _ in range(20):  # the old link may lead to somebody else's terminal now: it stays alone
        items += source.read()
        time.sleep(0.005)
    assert kinds(items) == [LineEventKind.UNPLUGGED]
    link.unlink()
    link.symlink_to(os.ttyname(slave))
    items += gather(source, bool)
    assert kinds(items) == [LineEventKind.UNPLUGGED, LineEventKind.REPLUGGED]
    os.write(master, b"\xff\x42")
    assert octets(gather(source, lambda items: len(octets(items)) >= 2)) == b"\xff\x42"
    source.close()
    os.close(slave)
    os.close(master)


# -- what a person sees ----------------------------------------------------------------------------------------


def test_no_such_port_lists_those_there_are(monkeypatch) -> None:
    monkeypatch.setattr(serial_port, "list_ports", lambda: [serial_port_info("/dev/ttyUSB1")])
    with pytest.raises(PortError, match=r"^/dev/ttyUSB9: no such port; ports here: /dev/ttyUSB1$"):
        open_source("/dev/ttyUSB9", LINE)


def serial_port_info(device: str):
    from sniff.engine.session import Adapter
    from sniff.sources.ports import PortInfo

    return PortInfo(device, Adapter())


def test_a_folder_and_a_file_are_no_ports(tmp_path) -> None:
    with pytest.raises(PortError, match="a folder, not a serial port"):
        open_source(str(tmp_path), LINE)
    file = tmp_path / "notes"
    file.write_text("hello")
    with pytest.raises(PortError, match="a file, not a serial port"):
        open_source(str(file), LINE)


def test_a_device_that_is_no_tty() -> None:
    with pytest.raises(PortError, match="not a serial port"):
        open_source("/dev/null", LINE)


def test_permission_denied_names_the_group(pty, monkeypatch) -> None:
    import errno

    def refuse(device, line):
        raise PermissionError(errno.EACCES, "Permission denied")

    monkeypatch.setattr(serial_port, "open_listening", refuse)
    monkeypatch.setattr(serial_port, "_group", lambda device: "dialout")
    with pytest.raises(PortError) as caught:
        open_source(pty.path, LINE)
    assert str(caught.value) == f"{pty.path}: permission denied; add yourself to group dialout"


def test_messages_are_one_line(pty, monkeypatch) -> None:
    def refuse(device, line):
        raise ValueError("bad\nthing\x1b[31m")

    monkeypatch.setattr(serial_port, "open_listening", refuse)
    with pytest.raises(PortError) as caught:
        open_source(pty.path, LINE)
    assert "\n" not in str(caught.value)


def test_a_system_without_descriptors_is_polled(pty, monkeypatch) -> None:
    """As on Windows: no descriptor to wait on, no marks; octets come through pyserial."""
    source = SerialSource(pty.path, LineSettings.parse("9600,8N1"), Clock.start())
    source._fd = None
    source._decoder = None
    assert source.deadline() is not None
    pty.feed(b"\x01\x02")
    assert octets(gather(source, lambda items: len(octets(items)) >= 2)) == b"\x01\x02"
    source.close()


def test_no_locks_where_there_are_none(monkeypatch) -> None:
    monkeypatch.setattr(tty.importlib.util, "find_spec", lambda name: None)
    assert tty._can_lock() is False


def test_a_port_that_goes_while_it_is_set_is_trouble_not_a_crash(source, monkeypatch) -> None:
    """termios has errors of a kind of its own, which pyserial lets through."""
    import termios

    def gone(*_: object) -> None:
        raise termios.error(5, "Input/output error")

    for name in ("tcgetattr", "tcsetattr"):
        with monkeypatch.context() as patched:
            patched.setattr(termios, name, gone)
            with pytest.raises(PortError, match="Input/output error"):
                source.reconfigure(LineSettings.parse("9600,8N1"))
    source.close()
    with monkeypatch.context() as patched:
        patched.setattr(termios, "tcflush", gone)
        with pytest.raises(PortError, match="Input/output error"):
            SerialSource(source.device, LINE, Clock.start())


@pytest.mark.parametrize(
    ("settings", "told"),
    [("9600,7E1", (9600, 7, "E", 1)), ("19200,8O2", (19200, 8, "O", 2)), ("38400,8N1", (38400, 8, "N", 1))],
)
def test_all_of_the_line_settings_are_the_ports(settings: str, told: tuple[int, int, str, int]) -> None:
    """A pseudo-terminal has eight bits and no parity whatever is asked for."""
    port = tty.ListeningPort()
    port.apply(LineSettings.parse("1200,8N1"))
    port.apply(LineSettings.parse(settings))
    assert (port.baudrate, port.bytesize, port.parity, port.stopbits) == told
