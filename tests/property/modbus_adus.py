"""Strategies of well-formed Modbus messages: unit, function and data, without the check."""

from __future__ import annotations

import struct

from hypothesis import strategies as st

from dissectors.checksums import crc16_modbus, lrc
from dissectors.modbus.functions import DIAGNOSTICS, EXCEPTIONS, FUNCTIONS, VENDOR_EXCEPTIONS

units = st.integers(1, 247)
words = st.integers(0, 0xFFFF)


def _join(*parts: st.SearchStrategy[bytes]) -> st.SearchStrategy[bytes]:
    return st.tuples(*parts).map(b"".join)


def _words(*values: st.SearchStrategy[int]) -> st.SearchStrategy[bytes]:
    return st.tuples(*values).map(lambda v: struct.pack(f">{len(v)}H", *v))


def _code(code: int) -> st.SearchStrategy[bytes]:
    return st.just(bytes([code]))


def _counted(least: int, most: int, step: int = 1) -> st.SearchStrategy[bytes]:
    counts = st.integers(least // step, most // step).map(lambda n: n * step)
    return counts.flatmap(lambda n: st.binary(min_size=n, max_size=n).map(lambda b: bytes([n]) + b))


def _write_bits(quantity: int) -> st.SearchStrategy[bytes]:
    size = (quantity + 7) // 8
    return st.binary(min_size=size, max_size=size).map(lambda b: struct.pack(">HB", quantity, size) + b)


def _write_words(quantity: int) -> st.SearchStrategy[bytes]:
    size = 2 * quantity
    return st.binary(min_size=size, max_size=size).map(lambda b: struct.pack(">HB", quantity, size) + b)


def _identification(values: list[bytes]) -> bytes:
    body = b"".join(bytes([number, len(value)]) + value for number, value in enumerate(values))
    return bytes([0x0E, 1, 0x81, 0, 0, len(values)]) + body


def _file_read(groups: list[tuple[int, int, int]]) -> bytes:
    body = b"".join(struct.pack(">BHHH", 6, *group) for group in groups)
    return bytes([len(body)]) + body


def _file_write(records: list[tuple[int, int, list[int]]]) -> bytes:
    body = b"".join(struct.pack(f">BHHH{len(data)}H", 6, number, at, len(data), *data) for number, at, data in records)
    return bytes([len(body)]) + body


def _file_answer(blocks: list[bytes]) -> bytes:
    body = b"".join(bytes([len(block) + 1, 6]) + block for block in blocks)
    return bytes([len(body)]) + body


_bits, _registers = st.integers(1, 2000), st.integers(1, 125)
_coil = st.sampled_from([b"\0\0", b"\xff\0"])
_file_words = st.tuples(st.integers(1, 9), st.integers(0, 9999), st.lists(words, min_size=1, max_size=5))

requests = st.one_of(
    _join(st.sampled_from([b"\1", b"\2"]), _words(words, _bits)),
    _join(st.sampled_from([b"\3", b"\4"]), _words(words, _registers)),
    _join(_code(5), _words(words), _coil),
    _join(_code(6), _words(words, words)),
    st.sampled_from([b"\x07", b"\x0b", b"\x0c", b"\x11"]),
    _join(_code(8), _words(st.sampled_from(sorted(DIAGNOSTICS)), words)),
    _join(_code(0x0F), _words(words), st.integers(1, 60).flatmap(_write_bits)),
    _join(_code(0x10), _words(words), st.integers(1, 123).flatmap(_write_words)),
    _join(
        _code(0x14),
        st.lists(st.tuples(words, st.integers(0, 9999), st.integers(1, 9)), min_size=1, max_size=5).map(_file_read),
    ),
    _join(_code(0x15), st.lists(_file_words, min_size=1, max_size=3).map(_file_write)),
    _join(_code(0x16), _words(words, words, words)),
    _join(_code(0x17), _words(words, _registers, words), st.integers(1, 50).flatmap(_write_words)),
    _join(_code(0x18), _words(words)),
    st.integers(1, 4).map(lambda code: bytes([0x2B, 0x0E, code, 0])),
)

responses = st.one_of(
    _join(st.sampled_from([b"\1", b"\2"]), _counted(1, 250)),
    _join(st.sampled_from([b"\3", b"\4", b"\x17"]), _counted(2, 250, 2)),
    _join(_code(7), st.binary(min_size=1, max_size=1)),
    _join(_code(0x0B), _words(st.sampled_from([0, 0xFFFF]), words)),
    _join(_code(0x0C), _counted(6, 70)),
    _join(_code(0x0F), _words(words, st.integers(1, 1968))),
    _join(_code(0x10), _words(words, st.integers(1, 123))),
    _join(_code(0x11), _counted(2, 60)),
    _join(_code(0x14), st.lists(st.binary(min_size=2, max_size=20), min_size=1, max_size=5).map(_file_answer)),
    _join(
        _code(0x18),
        st.lists(words, max_size=31).map(lambda w: struct.pack(f">BHH{len(w)}H", 0x18, 2 + 2 * len(w), len(w), *w)[1:]),
    ),
    _join(_code(0x2B), st.lists(st.binary(max_size=20), max_size=6).map(_identification)),
)

exceptions = st.tuples(
    st.sampled_from(sorted(FUNCTIONS)), st.sampled_from(sorted({*EXCEPTIONS, *VENDOR_EXCEPTIONS}))
).map(lambda pair: bytes([pair[0] | 0x80, pair[1]]))

messages = st.one_of(requests, responses, exceptions)
"""Function and data of any message."""

bodies = st.tuples(units, messages).map(lambda pair: bytes([pair[0]]) + pair[1])
"""Unit, function and data."""


def rtu(body: bytes) -> bytes:
    """The RTU frame of unit, function and data."""
    return body + crc16_modbus(body).to_bytes(2, "little")


def ascii_frame(body: bytes) -> bytes:
    """The ASCII frame of unit, function and data."""
    return b":" + (body + bytes([lrc(body)])).hex().upper().encode() + b"\r\n"


rtu_frames = bodies.map(rtu)
ascii_frames = bodies.map(ascii_frame)
