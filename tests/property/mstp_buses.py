"""MS/TP traffic for tests of what works on many frames at once: frames, buses of any kind, captures that lie here."""

from __future__ import annotations

import random
from collections.abc import Sequence
from pathlib import Path

import pytest
from hypothesis import strategies as st

from dissectors.bacnet.envelope import frame
from dissectors.bacnet.frame_types import HEADER, PREAMBLE
from dissectors.checksums import crc8_mstp
from dissectors.columns import Reads
from dissectors.frame import Chunk, LineError, Mark
from dissectors.line import LineSettings, Timing
from sniff.engine.event_texts import SettingsChange
from sniff.formats import read

MS = 1_000_000
START = 10**18
LINE = LineSettings(38400)

OURS = sorted(path for path in Path("captures").rglob("*.cap.txt") if "protocol: mstp" in path.read_text("utf-8")[:400])
OTHERS = Path(__file__).parents[2] / "../shared/captures"
THEIRS = (
    "mstp-kargs-2009/mstp_20090227094623.pcap",
    "mstp-md5-2018-good1/mstp_2018_Good1.cap",
    "mstp-cimetrics-snap-mixed/derived_linktype165.pcap",
    "mstp-chipkin-cas-log/frames.txt",
    "vectors-mstp-misc/frames.txt",
)


def others(name: str) -> Path:
    """A capture that others made; skips the test where there is none."""
    path = OTHERS / name
    if not path.is_file():
        pytest.skip(f"the shared captures are not here ({name})")
    return path


def chunks_of(path: Path, most: int = 1_000_000) -> tuple[list[Chunk], Timing]:
    """The reads of a capture before its settings change, at most so many, and its timing."""
    if path.name == "frames.txt":
        return _listed(path), Timing(LINE)
    capture, chunks = read(path), []
    for item in capture.items():
        if isinstance(item, SettingsChange) or len(chunks) >= most:
            break
        if isinstance(item, Chunk):
            chunks.append(item)
    return chunks, capture.session.timing


def _listed(path: Path) -> list[Chunk]:
    """Lines of an index or seconds, and octets."""
    lines = [line.partition(";")[0].split(None, 1) for line in path.read_text().splitlines() if line[:1].isdigit()]
    return [Chunk(START + int(float(when) * 1e9), bytes.fromhex(octets)) for when, octets in lines]


def chunks_of_reads(reads: Reads) -> list[Chunk]:
    """Columns of reads as chunks."""
    octets, ends = reads.octets.tobytes(), reads.begins[1:].tolist()
    cut = zip([0, *ends[:-1]], ends, reads.times.tolist(), strict=True)
    return [Chunk(time, octets[begin:end]) for begin, end, time in cut]


addresses = st.one_of(st.sampled_from([0, 1, 2, 3, 127, 255]), st.integers(0, 255))
invokes = st.integers(0, 3)


def _object(tag: int, instance: int) -> bytes:
    return bytes((tag,)) + (0x00C00000 | instance).to_bytes(4, "big")


objects = st.builds(_object, st.sampled_from([0x0C, 0xC4, 0x1C, 0x2C]), st.integers(0, 0x3FFFFF))
_process = st.sampled_from([b"\x09\x07", b"\x0a\x01\x00", b"\x0c\x00\x00\x00\x01", b"\x0d\x01\x01"])
_errors = st.sampled_from(
    [b"\x91\x01\x91\x1f", b"\x91\x02\x91\x20", b"\x91\xc8\x91\xff", b"\x91\x01\x92\x01\x00", b"\x0e"]
)
parameters = st.lists(st.one_of(objects, _process, _errors, st.binary(max_size=6)), max_size=4).map(b"".join)
_services = st.one_of(st.sampled_from([0, 1, 2, 5, 7, 8, 12, 14, 15, 31]), st.integers(0, 255))


def _apdu(first: int, middle: bytes, service: int, rest: bytes, cut: int) -> bytes:
    whole = bytes((first,)) + middle + bytes((service,)) + rest
    return whole[: len(whole) - cut]


apdus = st.one_of(
    st.builds(_apdu, st.just(0x00), invokes.map(lambda i: bytes((0x75, i))), _services, parameters, st.just(0)),
    st.builds(_apdu, st.just(0x30), invokes.map(lambda i: bytes((i,))), _services, parameters, st.just(0)),
    st.builds(_apdu, st.just(0x20), invokes.map(lambda i: bytes((i,))), _services, st.just(b""), st.just(0)),
    st.builds(_apdu, st.just(0x50), invokes.map(lambda i: bytes((i,))), _services, _errors, st.just(0)),
    st.builds(
        _apdu,
        st.sampled_from([0x60, 0x70, 0x71, 0x40]),
        invokes.map(lambda i: bytes((i,))),
        _services,
        st.just(b""),
        st.just(0),
    ),
    st.builds(_apdu, st.just(0x10), st.just(b""), _services, parameters, st.just(0)),
    st.builds(_apdu, st.integers(0, 255), st.binary(max_size=4), _services, parameters, st.integers(0, 4)),
)
_station = st.binary(max_size=3).map(lambda address: b"\x00\x05" + bytes((len(address),)) + address)
npdus = st.one_of(
    apdus.map(lambda apdu: b"\x01\x04" + apdu),
    apdus.map(lambda apdu: b"\x01\x00" + apdu),
    st.builds(lambda to, apdu: b"\x01\x24" + to + b"\xff" + apdu, _station, apdus),
    st.builds(lambda by, apdu: b"\x01\x08" + by + apdu, _station, apdus),
    st.builds(lambda to, by, apdu: b"\x01\x2c" + to + by + b"\xfe" + apdu, _station, _station, apdus),
    st.builds(lambda control, rest: b"\x01" + bytes((control,)) + rest, st.integers(0, 255), st.binary(max_size=12)),
    st.builds(lambda message, rest: b"\x01\x80" + bytes((message,)) + rest, st.integers(0, 255), st.binary(max_size=4)),
    st.binary(max_size=3),
)
TOKEN = frame(0, 5, 2)
_tricky = st.lists(
    st.sampled_from([TOKEN, PREAMBLE, b"\x55", b"\xff", b"\x00", frame(6, 1, 2, b"\x01\x00\x10\x08")]),
    min_size=1,
    max_size=8,
).map(b"".join)


def _with_bad_header(octets: bytes, at: int, flip: int) -> bytes:
    return octets[:at] + bytes((octets[at] ^ flip,)) + octets[at + 1 :]


def _too_long(length: int) -> bytes:
    header = bytes((6, 1, 2, length >> 8, length & 255))
    return PREAMBLE + header + bytes((crc8_mstp(header),))


plain_frames = st.one_of(
    st.builds(frame, st.sampled_from([0, 0, 0, 1, 2, 7]), addresses, addresses),
    st.builds(frame, st.sampled_from([5, 6]), addresses, addresses, npdus),
)
good_frames = st.one_of(
    plain_frames,
    st.builds(frame, st.integers(0, 255), addresses, addresses, st.one_of(st.just(b""), npdus, _tricky)),
    st.builds(frame, st.sampled_from([32, 33, 34]), addresses, addresses, st.one_of(npdus, _tricky)),
    st.binary(min_size=490, max_size=510).map(lambda data: frame(6, 1, 2, data)),
)
damaged_frames = st.one_of(
    st.builds(_with_bad_header, good_frames, st.integers(0, 7), st.integers(1, 255)),
    st.builds(lambda octets, flip: octets[:-1] + bytes((octets[-1] ^ flip,)), good_frames, st.integers(1, 255)),
    good_frames.map(lambda octets: octets[:-2] + octets[-1:] + octets[-2:-1]),
    st.builds(lambda octets, cut: octets[: max(1, len(octets) - cut)], good_frames, st.integers(1, 9)),
    st.builds(_too_long, st.integers(500, 65535)),
)
streams = st.lists(
    st.one_of(good_frames, good_frames, damaged_frames, _tricky, st.binary(max_size=6)), min_size=1, max_size=14
)
timings = st.builds(
    Timing,
    st.sampled_from([LineSettings.parse(line) for line in ("300", "9600,8E1", "38400", "115200,8N2")]),
    st.sampled_from([0, 1 * MS, 16 * MS]),
)


@st.composite
def captures(draw: st.DrawFn, timing: Timing, pieces: st.SearchStrategy[list[bytes]] = streams) -> list[Chunk]:
    """Pieces on a wire with silences of every size between and inside, read in lumps; times may run backwards."""
    pause = timing.line.bits(60)
    gaps = (0, 0, 0, pause // 3, pause - 1, pause, pause + 1, 5 * MS, 20 * MS, 99 * MS, 100 * MS, 130 * MS, 600 * MS)
    chunks, now, backwards = [], START, draw(st.booleans())
    dice = draw(st.randoms(use_true_random=False))
    held = b""
    for piece in draw(pieces):
        cuts = sorted({dice.randrange(len(piece) + 1) for _ in range(dice.choice((0, 0, 0, 1, 2)))})
        for begin, end in zip([0, *cuts], [*cuts, len(piece)], strict=True):
            held += piece[begin:end]
            now += (end - begin) * timing.char + dice.choice(gaps[: dice.choice((3, 8, len(gaps)))])
            if held and dice.random() < 0.8:
                marks = (Mark(dice.randrange(len(held)), LineError.FRAMING),) if dice.random() < 0.03 else ()
                late = dice.choice((0, 0, timing.latency, dice.randrange(timing.latency + 1)))
                chunks.append(Chunk(now + late - (dice.randrange(40 * MS) if backwards else 0), held, marks))
                held = b""
    if held:
        chunks.append(Chunk(now, held))
    return chunks


def recut(chunks: Sequence[Chunk], char: int, dice: random.Random) -> list[Chunk]:
    """The same octets at the same times in other reads: some cut, others put together."""
    given: list[Chunk] = []
    for chunk in chunks:
        if len(chunk.octets) > 1 and not chunk.marks and dice.random() < 0.4:
            at = dice.randrange(1, len(chunk.octets))
            left = len(chunk.octets) - at
            given += [Chunk(chunk.time - left * char, chunk.octets[:at]), Chunk(chunk.time, chunk.octets[at:])]
        elif given and not chunk.marks and not given[-1].marks and dice.random() < 0.2:
            given[-1] = Chunk(chunk.time, given[-1].octets + chunk.octets)
        else:
            given.append(chunk)
    return given


def conversation(dice: random.Random, frames: int) -> list[Chunk]:
    """Stations that ask, answer, repeat, postpone, pass tokens and fall silent in any order, some behind a router."""
    now, chunks = START, []
    asked: list[tuple[int, int, int, bytes, bytes]] = []
    stations = dice.choice(((1, 2), (1, 2, 3, 9)))
    pauses = (0, 1, 2, 3, 5, 10, 20, 30)
    odd_pauses = (300, 499, 500, 501, 900, 2_500, 11_000, 61_000)

    def request(client: int, server: int) -> bytes:
        invoke, service = dice.randrange(4), dice.choice((12, 15))
        there = dice.choice((b"", b"", b"\x00\x07\x01\x63"))
        apdu = bytes((0, 5, invoke, service)) + dice.choice((b"", _object(0x0C, 7) + b"\x19\x55"))
        asked.append((client, server, invoke, bytes((service,)), there))
        control = 0x0C if there else 0x04
        return frame(dice.choice((5, 5, 5, 5, 6)), server, client, bytes((1, control)) + there + apdu)

    def answer(which: tuple[int, int, int, bytes, bytes]) -> bytes:
        client, server, invoke, service, there = which
        kind = dice.randrange(12)
        apdu = bytes((0x30, invoke)) + service + _object(0x0C, 7)
        if kind == 0:
            apdu = bytes((0x50, invoke)) + service + b"\x91\x01\x91\x1f"
        elif kind == 1:
            apdu = bytes((dice.choice((0x60, 0x70, 0x71)), invoke, 2))
        elif kind == 2:
            apdu = bytes((0x20, invoke)) + service
        elif kind == 3:
            return frame(7, client, server)
        elif kind == 4:
            more = dice.choice((0x3C, 0x38))
            apdu = bytes((more, invoke, dice.randrange(3), 2)) + service + b"\x11\x22"
        elif kind == 5:
            apdu = bytes((0x40 | dice.randrange(2), invoke, dice.randrange(3), 2))
        control = b"\x20" + there + b"\xff" if there else b"\x00"
        return frame(dice.choice((6, 6, 6, 5)), client, server, b"\x01" + control + apdu)

    said = frame(0, 1, 2)
    while len(chunks) < frames:
        station, other = dice.sample(stations, 2)
        choice = dice.randrange(20)
        if choice < 5:
            said = frame(0, other, station)
        elif choice < 7:
            said = frame(1, other, station)
        elif choice == 7:
            said = frame(2, other, station)
        elif choice < 11:
            said = request(station, other)
        elif choice < 15 and asked:
            said = answer(asked[-1] if dice.random() < 0.85 else dice.choice(asked[-6:]))
        elif choice == 15:
            said = frame(dice.choice((5, 6, 6)), dice.choice((255, other)), station, b"\x01\x00\x10\x08")
        elif choice == 16:
            said = frame(dice.choice((3, 4, 7, 130)), other, station, b"\x01\x02")
        elif choice == 17:
            pass  # the same again
        elif choice == 18:
            said = frame(1, 1, 2) if dice.random() < 0.5 else frame(2, 2, 1)
        octets = said
        if dice.random() < 0.04:
            at = dice.randrange(len(octets))
            octets = _with_bad_header(octets, at, 1 << dice.randrange(8))
        pause = dice.choice(odd_pauses if dice.random() < 0.06 else pauses)
        now += pause * MS + len(octets) * Timing(LINE).char
        chunks.append(Chunk(now, octets))
    return chunks


def data_of_any_form(dice: random.Random, count: int) -> list[bytes]:
    """Good frames whose NPDUs are as they should be, cut anywhere, or a little off; every head of an APDU abounds."""
    errors = (
        b"\x91\x01\x91\x1f",
        b"\x91\x02\x91\x20",
        b"\x91\xc8\x91\xff",
        b"\x91\x01\x92\x01\x00",
        b"\x0e\x91\x01\x91\x02",
    )
    processes = (
        b"\x09\x07",
        b"\x0a\x01\x00",
        b"\x0c\x00\x00\x00\x01",
        b"\x0d\x01\x01",
        b"\x0d\x01\x01\x02\x03\x04",
        b"\x08",
    )
    addresses_there = (b"\x00\x05\x00", b"\x00\x05\x01\x09", b"\xff\xff\x00", b"\x00\x05\x06\x01\x02\x03\x04\x05\x06")

    def parts() -> bytes:
        made = b""
        for _ in range(dice.randrange(4)):
            kind = dice.randrange(4)
            if kind == 0:
                made += _object(dice.choice((0x0C, 0xC4, 0x1C, 0x2C)), dice.randrange(1 << 22))
            elif kind == 1:
                made += dice.choice(processes) + _object(dice.choice((0x1C, 0x2C)), dice.randrange(1 << 22))
            else:
                made += dice.choice((errors, processes, (dice.randbytes(3),))[kind - 1])
        return made

    frames = []
    for _ in range(count):
        pdu = dice.choice((0, 0, 1, 1, 2, 3, 3, 4, 5, 5, 5, 6, 7, dice.randrange(16)))
        first = pdu << 4 | (dice.randrange(16) if dice.random() < 0.4 else 0)
        middle = {0: 2, 1: 0}.get(pdu, 1) + (2 if pdu in (0, 3) and first & 8 else 0)
        services = (0, 1, 2, 5, 8, 12, 14, 15, 31, dice.randrange(256))
        between = bytes(dice.choice((0, 0, 1, dice.randrange(256))) for _ in range(middle))
        apdu = bytes((first,)) + between + bytes((dice.choice(services),)) + parts()
        control, routed = dice.choice((0, 4)), b""
        for flag in (0x20, 0x08):
            if dice.random() < 0.15:
                control, routed = control | flag, routed + dice.choice(addresses_there)
        routed += b"\xff" if control & 0x20 else b""
        if dice.random() < 0.05:
            control |= dice.choice((0x80, dice.randrange(256)))
        npdu = bytes((1 if dice.random() < 0.98 else dice.randrange(3), control)) + routed + apdu
        if dice.random() < 0.4:
            npdu = npdu[: len(npdu) - min(dice.choice((1, 1, 2, dice.randrange(len(npdu) + 1))), len(npdu))]
        kind = dice.choice((5, 5, 6, 6, 6, 32, 33, dice.randrange(256)))
        frames.append(frame(kind, dice.choice((255, dice.randrange(256))), dice.randrange(256), npdu))
    return frames


def spoilt_bus(dice: random.Random, frames: int) -> list[Chunk]:
    """Frames of any form, one in six of them damaged in some way, with silences and merged reads as they come."""
    char, pause = Timing(LINE).char, LINE.bits(60)
    chunks: list[Chunk] = []
    now, held = START, b""
    for octets in data_of_any_form(dice, frames):
        said = octets if dice.random() < 0.5 else frame(dice.choice((0, 0, 1, 2)), dice.randrange(9), dice.randrange(9))
        if dice.random() < 0.17:
            said = _damaged(dice, said)
        gaps = (0, 0, 1, pause - 1, pause, pause + 1, 5 * MS, 20 * MS, 90 * MS, 100 * MS, 499 * MS, 600 * MS)
        cut = dice.randrange(len(said) + 1) if dice.random() < 0.1 else len(said)
        for piece in (said[:cut], said[cut:]):
            held += piece
            now += len(piece) * char + dice.choice(gaps[: dice.choice((4, 9, 12))])
            if held and dice.random() < 0.8:
                chunks.append(Chunk(now, held))
                held = b""
    return [*chunks, Chunk(now + MS, TOKEN)]


def _damaged(dice: random.Random, octets: bytes) -> bytes:
    way = dice.randrange(8)
    if way < 3:
        at = dice.randrange(min(len(octets), HEADER))
        return _with_bad_header(octets, at, 1 << dice.randrange(8))
    if way == 3:
        return octets[: dice.randrange(len(octets))]
    if way == 4:
        return octets[:-2] + octets[-1:] + octets[-2:-1]
    if way == 5:
        return octets + dice.choice((b"\xff", b"\x00", b"\x55", PREAMBLE))
    if way == 6:
        return frame(6, 1, 2, b"\x01\x00" + dice.choice((TOKEN, PREAMBLE, b"\x55\x55\xff")) + dice.randbytes(3))[
            : dice.choice((-1, None, -3))
        ]
    return _with_bad_header(octets, dice.randrange(len(octets)), 1 << dice.randrange(8))
