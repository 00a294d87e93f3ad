"""Octets that make no frames: the settings that fit them are named, and none where none fits."""

from __future__ import annotations

import random
from collections.abc import Iterable

import pytest

from dissectors.frame import Chunk
from dissectors.line import LineSettings
from dissectors.modbus.envelope import seal_ascii, seal_rtu
from dissectors.n2.envelope import make_command
from dissectors.profibus.telegram import telegram
from sniff.analysis.other_settings import Fit, lacking_bits, other_protocol, what_fits
from sniff.analysis.slower_bus import slower_by
from sniff.simulation.collision import low_times, receive

LINE = LineSettings.parse("9600,8N1")
MS = 1_000_000


def chunks(bursts: Iterable[bytes], line: LineSettings = LINE, gap: int = 50 * MS) -> list[Chunk]:
    made, now = [], 0
    for burst in bursts:
        now += gap + len(burst) * line.char
        made.append(Chunk(now, burst))
    return made


def fit(bursts: Iterable[bytes], protocol: str = "n2", line: LineSettings = LINE) -> Fit | None:
    return what_fits(chunks(bursts, line), line, 0, protocol)


def polls(count: int = 12, seed: int = 1) -> list[bytes]:
    dice = random.Random(seed)
    made = []
    for number in range(count):
        made.append(seal_rtu(bytes((number % 3 + 1, 3, 0, number, 0, 4))))
        made.append(seal_rtu(bytes((number % 3 + 1, 3, 8)) + dice.randbytes(8)))
    return made


def heard(frames: Iterable[bytes], sent: str, listening: str) -> list[bytes]:
    """The same frames by a UART with other settings."""
    lines = LineSettings.parse(sent), LineSettings.parse(listening)
    return [receive(lines[1], low_times(lines[0], 0, frame, {})).octets for frame in frames]


def test_another_protocol_is_named() -> None:
    told = fit(polls())
    assert told is not None
    assert "these octets read as modbus-rtu with good checks (24 frames hold 100%" in told.seen
    assert told.next == "read it with -p modbus-rtu"
    assert fit(polls(), "modbus-rtu") is None  # it is this one, whatever is wrong


def test_seven_bits_and_parity_read_as_eight() -> None:
    frames = [seal_ascii(frame[:-2]) for frame in polls()]
    told = fit(heard(frames, "9600,7E1", "9600,8N1"), "modbus-rtu")
    assert told is not None
    assert "with 7 data bits and even parity these octets read as modbus-ascii" in told.seen
    assert told.means == "the bus has 9600,7E1"


@pytest.mark.parametrize("port", ["19200,8O1", "19200,8N1"])
def test_another_parity_than_the_bus_has_is_named(port: str) -> None:
    """The octets are right, each with its line error, and a protocol that needs its parity makes no frames of them."""
    sent, listening = LineSettings.parse("19200,8E1"), LineSettings.parse(port)
    sample, now = [], 0
    for turn in range(40):
        asked, answered = bytes((turn, 0, 23, 112)), bytes((0, turn, 23, 112))
        for octets in (telegram(8, 2, 0x5D, asked), telegram(2, 8, 0x08, answered)):
            got = receive(listening, low_times(sent, 0, octets, {}))
            now += 10 * MS
            sample.append(Chunk(now, got.octets, got.marks))
    told = what_fits(sample, listening, 0, "profibus")
    assert told is not None
    assert told.is_parity
    assert "but for their line errors these octets read as profibus" in told.seen
    assert told.means == f"the bus has 19200,8E1, and the port {port}"


def test_inverted_octets() -> None:
    told = fit([bytes(octet ^ 0xFF for octet in frame) for frame in polls()], "modbus-rtu")
    assert told is not None
    assert told.seen.startswith("inverted, these octets read as modbus-rtu")
    assert "A and B are swapped" in told.means


@pytest.mark.parametrize(("mask", "words"), [(0x7F, "7 data bits"), (0x3F, "6 data bits"), (0x1F, "5 data bits")])
def test_data_bits_that_the_port_lacks(mask: int, words: str) -> None:
    told = fit([bytes(octet & mask for octet in frame) for frame in polls()], "modbus-rtu")
    assert told is not None
    assert f"is above {mask:02X}" in told.seen
    assert words in told.seen


def test_text_of_an_unknown_protocol_has_no_eighth_bit_and_that_is_all() -> None:
    assert fit([b"*IDN?\r\n", b"ACME,4711,1.0\r\n", b"READ:VOLT?\r\n", b"+1.2345E+01\r\n"] * 4) is None


@pytest.mark.parametrize("data", ["8N1", "8E1", "8N2"])
@pytest.mark.parametrize("factor", [2, 3, 4, 6, 8])
def test_a_slower_bus(factor: int, data: str) -> None:
    sent, listening = f"2400,{data}", f"{2400 * factor},{data}"
    bursts = heard(polls(4), sent, listening)
    assert slower_by(bursts, LineSettings.parse(listening)) == factor
    told = what_fits(chunks(bursts, gap=200 * MS), LineSettings.parse(listening), 0, "modbus-rtu")
    assert told is not None
    assert f"the bus is {factor} times slower, about 2400 Bd" in told.seen
    told = what_fits(chunks(bursts, gap=200 * MS), LineSettings.parse(listening), 0, "modbus-rtu", has_rate=False)
    assert told is not None
    assert f"1/{factor} of that rate" in told.next


def test_a_much_faster_bus() -> None:
    bursts = heard([polls(1)[0], seal_rtu(bytes.fromhex("010306000102030405"))] * 12, "57600,8N1", "9600,8N1")
    told = fit(bursts, "modbus-rtu")
    assert told is not None
    assert "wrong baud rate: the bus is faster than 9600 Bd" in told.seen


@pytest.mark.parametrize(("bus", "port"), [("115200", "19200"), ("38400", "4800"), ("57600", "9600")])
def test_a_much_faster_bus_whose_answers_differ(bus: str, port: str) -> None:
    answers = [seal_rtu(bytes((1, 3, 4, 0, turn * 7, 0, 1))) for turn in range(14)]
    sent = [one for answer in answers for one in (polls(1)[0], answer)]
    told = fit(heard(sent, f"{bus},8N1", f"{port},8N1"), "modbus-rtu", LineSettings.parse(f"{port},8N1"))
    assert told is not None
    assert f"wrong baud rate: the bus is faster than {port} Bd" in told.seen


@pytest.mark.parametrize("seed", range(20))
def test_of_noise_of_one_or_two_octets_nothing_is_said(seed: int) -> None:
    """Half of it always the same, as a driver rings."""
    dice = random.Random(seed)
    rest = [dice.randbytes(dice.randrange(1, 3)) for _ in range(20)]
    assert fit([one for other in rest for one in (b"\xfe\xff", other)], "modbus-rtu") is None


@pytest.mark.parametrize("seed", range(20))
def test_of_noise_nothing_is_said(seed: int) -> None:
    dice = random.Random(seed)
    assert fit([dice.randbytes(dice.randrange(1, 12)) for _ in range(40)], "modbus-rtu") is None


@pytest.mark.parametrize("ringing", [b"\x00", b"\xff", b"\xfe\xff", b"\x00\x00"])
def test_ringing_is_no_faster_bus(ringing: bytes) -> None:
    assert fit([ringing] * 60, "modbus-rtu") is None


def test_the_bus_itself_is_not_slower() -> None:
    assert slower_by(polls(), LINE) == 0
    assert slower_by([b"\x00" * 3], LINE) == 0


def test_octets_without_their_upper_bit_spoil_frames_and_leave_others_good() -> None:
    line = LineSettings.parse("9600,8N1")
    sample = [Chunk(MS * number, bytes([1, 3, number, number * 5 % 128, 9, 117])) for number in range(1, 13)]
    values = {value for chunk in sample for value in chunk.octets}
    told = lacking_bits(sample, line, values, damaged=4, rows=12)
    assert told is not None
    assert "no octet of 72 is above 7F" in told.seen
    assert lacking_bits(sample, line, {*values, 0x80}, damaged=4, rows=12) is None
    assert lacking_bits(sample, line, values, damaged=1, rows=12) is None  # noise
    assert lacking_bits(sample[:4] * 3, line, values, damaged=4, rows=12) is None  # the same few frames, by chance so


def _texts() -> list[bytes]:
    return [seal_ascii(frame[:-2]) for frame in polls()]


@pytest.mark.parametrize("in_one", [True, False])
@pytest.mark.parametrize(
    ("changed", "how", "why"),
    [
        ((b"\r", b"\n"), "with CR LF for each LF LF these octets read as modbus-ascii", "icrnl"),
        ((b"\r", b""), "with CR LF for each LF these octets read as modbus-ascii", "igncr"),
    ],
)
def test_line_ends_that_a_terminal_changed(changed: tuple[bytes, bytes], how: str, why: str, in_one: bool) -> None:
    """As `cat` saves them from a port that nobody set raw."""
    texts = [text.replace(*changed) for text in _texts()]
    bursts = texts if in_one else [bytes((octet,)) for text in texts for octet in text]
    told = what_fits(chunks(bursts, gap=50 * MS if in_one else MS // 10), LINE, 0, "modbus-ascii")
    assert told is not None
    assert told.seen.startswith(how)
    assert why in told.means
    assert "stty raw" in told.next


def test_a_protocol_that_ends_with_cr_alone() -> None:
    commands = [make_command(f"{at % 5 + 1:02X}1109{at:02X}") for at in range(24)]
    told = what_fits(chunks(command.replace(b"\r", b"\n") for command in commands), LINE, 0, "n2")
    assert told is not None
    assert told.seen.startswith("with CR for each LF these octets read as n2 with good checks (24 frames hold 100%")


def test_lines_of_text_are_no_protocol_whatever_ends_them() -> None:
    lines = [f"temperature {at * 7 % 50} C, all is well\n".encode() for at in range(40)]
    assert fit(lines) is None


def of_tcp(number: int, unit: int, pdu: str) -> bytes:
    body = bytes.fromhex(pdu)
    return number.to_bytes(2, "big") + bytes((0, 0, 0, 1 + len(body), unit)) + body


def test_frames_of_a_network_on_a_line_are_told_as_such() -> None:
    asked = [of_tcp(number, 1 + number % 2, "03 00 10 00 04") for number in range(8)]
    told = fit(asked, "modbus-rtu")
    assert told is not None
    assert told.of_network
    assert "frames of Modbus TCP, header and all (8 frames hold 100%" in told.seen
    found = other_protocol(chunks(asked), LINE, 0, "modbus-rtu")
    assert found is not None
    assert found.of_network


def test_small_numbers_without_a_check_lack_no_bits() -> None:
    asked = [bytes((1 + number % 9, 3 + number % 2, 0, 5 + number, 0, 1 + number % 4)) for number in range(16)]
    assert fit(asked, "modbus-rtu") is None
    masked = [bytes(octet & 0x1F for octet in frame) for frame in polls()]
    lacking = fit(masked, "modbus-rtu")
    assert lacking is not None
    assert lacking.lacks_bits
