"""The RTU kernel held against the reference framer and peek: captures, buses, noise, any cut, any times."""

from __future__ import annotations

import random
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dissectors.columns import Reads
from dissectors.frame import Chunk, LineError, Mark
from dissectors.line import LineSettings, Timing
from dissectors.modbus import RTU
from dissectors.modbus.candidates import octet_bits, readings
from dissectors.modbus.kernel import kernel
from dissectors.modbus.length_columns import PADDING, RARE, lengths, predicting, shapes, unit_bits
from dissectors.modbus.lengths import MAX_FRAME, MORE
from sniff import formats
from tests.bench import bulk_rtu
from tests.bus_delivery import FTDI_LATENCY, MS, ftdi, laid_out, stalled, with_noise
from tests.captures_shared import listed, timed
from tests.property.kernel_equality import assert_equal, reads_of
from tests.property.modbus_adus import rtu, rtu_frames
from tests.seeds import IS_SEARCH, examples, in_turn, seeds

EXACT = Timing(LineSettings.parse("19200,8E1"))
FAST = Timing(LineSettings.parse("115200,8N1"))
HELD_BACK = replace(EXACT, latency=FTDI_LATENCY)
TIMINGS = (EXACT, FAST, HELD_BACK, replace(FAST, latency=FTDI_LATENCY), replace(EXACT, latency=MS))

_OWN = Path(__file__).parents[2] / "captures"


OURS = sorted(_OWN.rglob("*rtu*.cap.txt"))


@pytest.mark.parametrize("path", OURS, ids=lambda path: path.name)
def test_of_our_captures(path: Path) -> None:
    capture = formats.read(path)
    chunks = [item for item in capture.items() if isinstance(item, Chunk)]
    others = in_turn((FTDI_LATENCY, 0), OURS.index(path), 2)  # the pairing is tried at the other
    for latency in {capture.session.timing.latency, *others}:
        assert_equal(RTU, chunks, replace(capture.session.timing, latency=latency))


_OF_OTHERS = (
    "modbus-rtu-daly-ble-responses",
    "modbus-rtu-daly-ess",
    "modbus-rtu-delta-dtb4824",
    "modbus-rtu-omega-cn7500",
    "sigrok-brainchild-io16do",
    "sigrok-flowmeter-graph_tool",
    "sigrok-flowmeter-target_0liter_per_min",
    "sigrok-flowmeter-target_20liter_per_min",
    "vectors-minimalmodbus-rtu",
    "vectors-modbus-suites",
)


@pytest.mark.parametrize("name", _OF_OTHERS)
def test_of_captures_of_others(name: str) -> None:
    frames = [frame.octets for frame in listed(name) if frame.octets]
    dice = random.Random(name)
    for timing in TIMINGS:
        assert_equal(RTU, _apart(frames, timing), timing)
        assert_equal(RTU, _glued(frames, timing, dice), timing)
        assert_equal(RTU, ftdi(laid_out(frames, timing, MS)), timing)


@pytest.mark.parametrize("name", [name for name in _OF_OTHERS if name.startswith("sigrok")])
def test_of_octets_as_an_analyser_saw_them(name: str) -> None:
    chunks = [Chunk(octet.end, bytes([octet.octet])) for octet in timed(name)]
    for timing in (Timing(LineSettings.parse("19200,8N1")), *TIMINGS):
        assert_equal(RTU, chunks, timing)


# --- buses -----------------------------------------------------------------------------------------------------------

_VENDOR = (0x41, 0x64, 0x2A)


def _exchange(dice: random.Random, codes: tuple[int, ...]) -> list[bytes]:
    """A request and its answer; one of a hundred is refused."""
    unit, code = dice.randint(1, 8), dice.choice(codes)
    address = dice.randrange(0x300) if dice.random() < 0.9 else dice.randrange(0x10000)
    at = address.to_bytes(2, "big")
    head = bytes((unit, code))
    if code in (1, 2):
        count = dice.randint(1, 64)
        asked, answered = at + count.to_bytes(2, "big"), bytes([(count + 7) // 8]) + dice.randbytes((count + 7) // 8)
    elif code in (3, 4):
        count = dice.choice((1, 2, 4, 10, 12, 40, 125))
        asked, answered = at + count.to_bytes(2, "big"), bytes([2 * count]) + dice.randbytes(2 * count)
    elif code == 5:
        asked = answered = at + dice.choice((b"\xff\0", b"\0\0"))
    elif code == 6:
        asked = answered = at + dice.randbytes(2)
    elif code == 15:
        count = dice.randint(1, 200)
        size = (count + 7) // 8
        asked, answered = at + count.to_bytes(2, "big") + bytes([size]) + dice.randbytes(size), at + bytes((0, count))
    elif code == 16:
        count = dice.choice((1, 2, 8, 20, 60, 123))
        asked = at + bytes((0, count, 2 * count)) + dice.randbytes(2 * count)
        answered = at + bytes((0, count))
    elif code == 23:
        count, written = dice.randint(1, 40), dice.randint(1, 40)
        asked = at + bytes((0, count)) + at + bytes((0, written, 2 * written)) + dice.randbytes(2 * written)
        answered = bytes([2 * count]) + dice.randbytes(2 * count)
    else:
        asked, answered = dice.randbytes(dice.randint(2, 40)), dice.randbytes(dice.randint(2, 40))
    if dice.random() < 0.01:
        return [rtu(head + asked), rtu(bytes((unit, code | 0x80, dice.choice((1, 2, 4, 0x52)))))]
    return [rtu(head + asked), rtu(head + answered)]


def reads_at(high: int, seed: int, count: int) -> list[bytes]:
    """Reads of registers whose address could be the byte count of an answer."""
    dice, said = random.Random(seed), []
    for _ in range(count):
        head, registers = bytes((dice.randint(1, 8), 3)), dice.choice((1, 2, 10, 40, 120))
        said.append(rtu(head + bytes((high, dice.randrange(50), 0, registers))))
        said.append(rtu(head + bytes([2 * registers]) + dice.randbytes(2 * registers)))
        if dice.random() < 0.05:
            said[-1] = rtu(bytes((head[0], 0x83, 2)))
    return said


def bus(seed: int, count: int, codes: tuple[int, ...]) -> list[bytes]:
    """Exchanges of a master with eight stations."""
    dice = random.Random(seed)
    return [frame for _ in range(count) for frame in _exchange(dice, codes)]


def _glued(frames: list[bytes], timing: Timing, dice: random.Random) -> list[Chunk]:
    """Reads of one to three frames, with silence between."""
    chunks, now, at = [], 0, 0
    while at < len(frames):
        octets = b"".join(frames[at : at + dice.choice((1, 1, 2, 3))])
        at += max(1, sum(octets.startswith(b"".join(frames[at : at + n])) for n in (1, 2, 3)))
        now += timing.latency + timing.t35 + len(octets) * timing.char + dice.randint(0, 20 * MS)
        chunks.append(Chunk(now, octets))
    return chunks


def _apart(frames: list[bytes], timing: Timing, pause: int = 6 * MS) -> list[Chunk]:
    chunks, now = [], 0
    for frame in frames:
        now += pause + timing.latency + len(frame) * timing.char
        chunks.append(Chunk(now, frame))
    return chunks


@pytest.mark.parametrize(
    ("codes", "least"),
    [((3, 6, 16), 0.99), ((1, 2, 3, 4, 5, 6, 15, 16, 23), 0.99), ((3, 6, *_VENDOR), 0.3)],
    ids=["usual", "all", "vendor"],
)
def test_of_buses_with_silences(codes: tuple[int, ...], least: float) -> None:
    for seed in seeds(2):
        for timing in TIMINGS:
            by_columns, total = assert_equal(RTU, _apart(bus(seed, 300, codes), timing), timing)
            assert by_columns >= least * total


@pytest.mark.parametrize(
    ("codes", "least"),
    [((3, 6, 16), 0.95), ((1, 2, 3, 4, 5, 6, 15, 16, 23), 0.8), ((3, 6, *_VENDOR), 0.2)],
    ids=["usual", "all", "vendor"],
)
def test_of_buses_behind_a_slow_adapter(codes: tuple[int, ...], least: float) -> None:
    for seed in seeds(3):
        for timing in (HELD_BACK, replace(FAST, latency=FTDI_LATENCY)):
            wire = laid_out(bus(seed, 400, codes), timing, 3 * MS)
            by_columns, total = assert_equal(RTU, ftdi(wire), timing)
            assert by_columns >= least * total


@pytest.mark.parametrize("high", [0x14, 0x26, 0x9C])
def test_of_addresses_like_byte_counts(high: int) -> None:
    frames = reads_at(high, high, 250 if IS_SEARCH else 150)
    dice = random.Random(high)
    for timing in (HELD_BACK, replace(FAST, latency=FTDI_LATENCY)):
        by_columns, total = assert_equal(RTU, ftdi(laid_out(frames, timing, 3 * MS)), timing)
        assert by_columns >= 0.9 * total
        assert_equal(RTU, _glued(frames, timing, dice), timing)
        for share in (0.02, 0.1, 0.3):
            disturbed = _disturbed(frames, dice, share)
            assert_equal(RTU, ftdi(laid_out(disturbed, timing, 3 * MS)), timing)
            assert_equal(RTU, _glued(disturbed, timing, dice), timing)


@pytest.mark.parametrize(("timing", "least"), [(bulk_rtu.TIMING, 0.99), (bulk_rtu.HELD_BACK, 0.95)])
def test_of_the_bulk_bus(timing: Timing, least: float) -> None:
    table, length = bulk_rtu.frames(3000)
    for share in (0.0, 0.005, 0.1):
        spoilt = bulk_rtu.damaged(table, length, share)
        by_columns, total = assert_equal(RTU, _chunks(bulk_rtu.bus(spoilt, length, timing)), timing)
        if not share:
            assert by_columns >= least * total


def _chunks(reads: Reads) -> list[Chunk]:
    octets, begins = reads.octets.tobytes(), reads.begins.tolist()
    return [Chunk(time, octets[a:b]) for time, a, b in zip(reads.times.tolist(), begins[:-1], begins[1:], strict=True)]


# --- disturbance -----------------------------------------------------------------------------------------------------


def _disturbed(frames: list[bytes], dice: random.Random, share: float) -> list[bytes]:
    """Some frames spoilt, cut, doubled, lengthened, glued to zeros, swapped, sealed anew with another check."""
    said: list[bytes] = []
    for frame in frames:
        if dice.random() >= share:
            said.append(frame)
            continue
        at = dice.randrange(len(frame))
        said.extend(
            dice.choice(
                (
                    [frame[:at] + bytes([frame[at] ^ dice.randint(1, 255)]) + frame[at + 1 :]],
                    [frame[:at]],
                    [frame[at:]],
                    [frame, frame],
                    [frame + bytes(dice.randint(1, 3))],
                    [bytes(dice.randint(1, 3)) + frame],
                    [frame + dice.randbytes(dice.randint(1, 4))],
                    [dice.randbytes(dice.randint(1, 30))],
                    [frame[:-2] + frame[:-3:-1]],
                    [frame[:-1] + bytes([dice.randrange(256)])],
                    [frame[1:]],
                    [frame[:-2]],
                    [bytes([dice.randrange(256)]) + frame[1:]],
                    [rtu(frame[:-1])],
                    [],
                )
            )
        )
    return [frame for frame in said if frame]


_ALL = (1, 2, 3, 4, 5, 6, 15, 16, 23, *_VENDOR)
_RARE = (3, 7, 8, 11, 12, 17, 20, 22, 24, 43)


@pytest.mark.parametrize("seed", seeds(3))
@pytest.mark.parametrize("timing", TIMINGS, ids=str)
def test_of_disturbed_buses(seed: int, timing: Timing) -> None:
    dice = random.Random(seed)
    for place, codes in enumerate(((3, 6, 16), _ALL, _RARE), TIMINGS.index(timing)):
        for share in in_turn((0.02, 0.3), place, 2):
            frames = _disturbed(bus(seed, 150 if IS_SEARCH else 100, codes), dice, share)
            assert_equal(RTU, _apart(frames, timing), timing)
            assert_equal(RTU, _glued(frames, timing, dice), timing)
            wire = laid_out(frames, timing, dice.choice((0, timing.t15, timing.t35, 4 * MS)))
            assert_equal(RTU, ftdi(wire), timing)
            noisy, _ = with_noise(wire, timing, dice, timing.t35)
            assert_equal(RTU, ftdi(noisy, timer=MS), timing)
            chunks = stalled(_apart(frames, timing), dice, 0.1, 30 * MS)
            assert_equal(RTU, chunks, timing)
            assert_equal(RTU, [replace(c, time=c.time + dice.randint(-9, 9) * MS) for c in chunks], timing)


def test_of_frames_whose_check_ends_with_zeros() -> None:
    frames = [
        frame
        for value in range(0x10000)
        for frame in (
            rtu(bytes((1, 6, 0, 7)) + value.to_bytes(2, "big")),
            rtu(bytes((1, 3, 2)) + value.to_bytes(2, "big")),
        )
        if not frame[-1] or (not frame[-2] and value % 7 == 0)
    ]
    frames += [rtu(frame) for frame in frames[::5]]  # good, with two zeros behind
    for timing in TIMINGS:
        assert_equal(RTU, _apart(frames, timing), timing)
        assert_equal(RTU, _glued(frames, timing, random.Random(1)), timing)


def test_of_a_lost_answer_before_one_that_fits_an_earlier_request() -> None:
    """Behind noise the best segmentation may rather leave out a request than the answer to the one before it."""
    said = bus(8, 8, (3,))
    write, other = rtu(bytes((4, 6, 0, 50, 1, 7))), rtu(bytes((4, 6, 1, 42, 1, 9)))
    for lost in range(4):
        rubbish = random.Random(lost).randbytes(40)
        said += [rubbish, write, rtu(bytes((3, 3, 2, 0xDA, 0, 2))), rubbish[:8], other, *bus(lost, 8, (3, 6))]
    for timing in TIMINGS:
        assert_equal(RTU, ftdi(laid_out(said, timing, MS)), timing)
        assert_equal(RTU, ftdi(laid_out(said, timing, 0)), timing)


def test_of_frames_inside_frames() -> None:
    dice = random.Random(4)
    inner = bus(1, 60, (3, 6, 16))
    frames = []
    for frame in inner:
        data = dice.randbytes(2 * dice.randint(0, 45))
        body = data + frame + dice.randbytes(2 * dice.randint(0, 45)) + (b"\0" if len(frame) % 2 else b"")
        body = body[: 240 - len(body) % 2]
        frames += [rtu(bytes((3, 3, len(body))) + body), *bus(len(body), 1, (3, 6))]
    for timing in TIMINGS:
        assert_equal(RTU, _apart(frames, timing), timing)
        assert_equal(RTU, ftdi(laid_out(frames, timing, MS)), timing)


def test_of_line_errors() -> None:
    dice = random.Random(5)
    chunks = [
        replace(chunk, marks=(Mark(0, LineError.FRAMING),)) if dice.random() < 0.1 else chunk
        for chunk in _apart(bus(5, 200, (3, 6)), EXACT)
    ]
    assert_equal(RTU, chunks, EXACT)
    assert_equal(RTU, chunks, HELD_BACK)


@pytest.mark.slow
@pytest.mark.parametrize("seed", seeds(2))
def test_of_random_octets(seed: int) -> None:
    dice = random.Random(seed)
    for timing in TIMINGS:
        chunks, now = [], 0
        for _ in range(1500):
            octets = dice.randbytes(dice.choice((1, 4, 5, 8, 9, 30, 200)))
            if dice.random() < 0.6:
                head = bytes((dice.randint(0, 255), dice.choice((*_ALL, 0x83, 0x86, 0x07, 0x11, 0x14, 0x18, 0x2B))))
                octets = rtu(head + octets)
            if len(octets) <= 256 and octets[-1]:
                now += dice.choice((0, MS, 3 * MS, 40 * MS))
                chunks.append(Chunk(now, octets))
        assert_equal(RTU, chunks, timing)


# --- any cut, any frames ---------------------------------------------------------------------------------------------

_pieces = st.one_of(
    rtu_frames,
    rtu_frames,
    st.binary(min_size=1, max_size=12),
    st.integers(0, 999).map(lambda seed: b"".join(_exchange(random.Random(seed), (3, 6, 16)))),
    st.integers(0, 999).map(lambda seed: b"".join(_exchange(random.Random(seed), _ALL))),
)
_pauses = st.sampled_from((0, 0, MS, 2 * MS, 5 * MS, 19 * MS, 50 * MS, -3 * MS))


@settings(max_examples=examples(100), deadline=None)
@given(st.lists(st.tuples(_pieces, _pauses, st.integers(0, 30)), max_size=30), st.sampled_from(TIMINGS))
def test_of_any_cut(said: list[tuple[bytes, int, int]], timing: Timing) -> None:
    chunks, now = [], 10**9
    for octets, pause, cut in said:
        for piece in (octets[:cut], octets[cut:]):
            if piece:
                now += len(piece) * timing.char
                chunks.append(Chunk(now, piece))
        now += pause
    assert_equal(RTU, chunks, timing)


@settings(max_examples=30, deadline=None)
@given(st.data(), st.sampled_from(TIMINGS))
def test_no_cut_of_blocks_matters_to_what_is_said(data: st.DataObject, timing: Timing) -> None:
    chunks = _apart(bus(data.draw(st.integers(0, 99)), 60, (3, 6, 16)), timing)
    where = data.draw(st.integers(1, len(chunks) - 1))
    before, after = reads_of(chunks[:where]), reads_of(chunks[where:])
    after = replace(after, before=int(before.times.max()))
    whole, parts = kernel(reads_of(chunks), timing), [kernel(before, timing), kernel(after, timing)]
    told = {offset: (start, end) for offset, start, end in zip(whole.offset, whole.start, whole.end, strict=True)}
    for base, part in zip((0, len(before.octets)), parts, strict=True):
        for offset, start, end in zip(part.offset, part.start, part.end, strict=True):
            assert told[offset + base] == (start, end)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 99), st.integers(8, 40), st.sampled_from((HELD_BACK, replace(FAST, latency=FTDI_LATENCY))))
def test_blocks_that_begin_behind_the_last_frame_told(seed: int, size: int, timing: Timing) -> None:
    """As whoever reads a capture in blocks: what a block left over goes before the next, perhaps from within a read."""
    whole_reads = reads_of(ftdi(laid_out(bus(seed, 60, (3, 6, 16)), timing, 3 * MS)))
    whole = kernel(whole_reads, timing)
    told = dict(zip(whole.offset.tolist(), zip(whole.start.tolist(), whole.end.tolist(), strict=True), strict=True))
    begins, base, before, frames = whole_reads.begins, 0, None, 0
    for end in [*range(size, len(whole_reads), size), len(whole_reads)]:
        first = int(np.searchsorted(begins, base, side="right")) - 1
        lengths_left = whole_reads.lengths[first:end].copy()
        lengths_left[0] -= base - begins[first]
        block = Reads(
            whole_reads.octets[base : begins[end]],
            whole_reads.times[first:end],
            lengths_left,
            whole_reads.marked[first:end],
            before,
        )
        part = kernel(block, timing)
        for offset, start, stop in zip(part.offset.tolist(), part.start.tolist(), part.end.tolist(), strict=True):
            assert told[offset + base] == (start, stop)
        frames += len(part)
        if len(part) and part.offset[-1] + part.length[-1] < len(block.octets):
            base, before = base + int(part.offset[-1] + part.length[-1]), int(part.end[-1])
    assert frames >= 0.7 * len(whole)


# --- tables ----------------------------------------------------------------------------------------------------------


@settings(max_examples=examples(100), deadline=None)
@given(
    st.lists(st.one_of(rtu_frames, st.binary(min_size=4, max_size=40)), min_size=1, max_size=10), st.integers(2, 300)
)
def test_lengths_and_shapes_are_those_of_the_reference(pieces: list[bytes], room: int) -> None:
    octets = b"".join(pieces)
    padded = np.frombuffer(octets + bytes(MAX_FRAME + PADDING), np.uint8)
    places = np.array([at for at in range(len(octets) - 1) if predicting()[octets[at + 1]]], np.int64)
    rooms = np.minimum(len(octets) - places, room)
    codes = padded[places + 1]
    request, response = lengths(padded, places, codes, rooms)
    as_request, as_response = shapes(padded, places, codes)
    for row, at in enumerate(places.tolist()):
        end = at + int(rooms[row])
        asked = {r.length for r in readings(octets, at, end) if r.request}
        answered = {r.length for r in readings(octets, at, end) if r.response}
        assert asked == ({int(request[row])} if request[row] >= MORE else set())
        assert answered == ({int(response[row])} if response[row] >= MORE else set())
        for reading in readings(octets, at, end):
            if MORE < reading.length <= end - at:
                bits = max(
                    int(as_request[row]) if reading.request else RARE,
                    int(as_response[row]) if reading.response else RARE,
                )
                if bits > RARE // 2:
                    assert bits + int(unit_bits(padded[places[row : row + 1]])[0]) == octet_bits(octets, at, reading)


def test_nothing_gives_nothing() -> None:
    assert len(kernel(reads_of([]), EXACT)) == 0
    assert len(kernel(reads_of([Chunk(0, b"\1")]), EXACT)) == 0
