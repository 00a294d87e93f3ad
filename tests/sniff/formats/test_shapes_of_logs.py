"""Logs in many shapes and hostile variations: each octet once, times as they are told, what is broken never taken."""

from __future__ import annotations

from pathlib import Path

import pytest

from dissectors.frame import Chunk
from sniff.engine.capture import CaptureError
from sniff.formats import read
from tests.sniff.formats import program_shapes_made
from tests.sniff.formats.shapes_made import SHAPES
from tests.sniff.formats.written_anew import write_anew

assert program_shapes_made  # adds to them


@pytest.mark.parametrize("name", SHAPES)
def test_shapes(name: str, tmp_path: Path) -> None:
    shape = SHAPES[name]
    path = tmp_path / (f"{name}.csv" if name.startswith("csv") else f"{name}.txt")
    write_anew(path, shape.log)
    if shape.octets is None:
        with pytest.raises(CaptureError):
            list(read(path).items())
        return
    log = read(path)
    chunks = [item for item in log.items() if isinstance(item, Chunk)]
    assert b"".join(chunk.octets for chunk in chunks) == shape.octets
    assert log.completeness().whole == shape.whole, log.completeness().text
    assert chunks[0].time >= 0
    if shape.delta is not None:
        assert chunks[1].time - chunks[0].time == pytest.approx(shape.delta, abs=2)
    if shape.first is not None:
        assert chunks[0].time == shape.first


@pytest.mark.parametrize(
    ("dates", "days"),
    [
        (("05/11/2024", "06/11/2024", "13/11/2024"), (0, 1, 8)),  # a number above 12
        (("11/05/2024", "11/06/2024", "11/07/2024"), (0, 1, 2)),  # the month stays
        (("05/11/2024", "06/11/2024", "07/11/2024"), (0, 1, 2)),
        (("30-11-24", "01-12-24", "02-12-24"), (0, 1, 2)),
        (("24-11-28", "24-11-29", "24-11-30"), (0, 1, 2)),  # a year of two digits
    ],
)
def test_the_order_of_a_date_is_told_by_all_dates(
    dates: tuple[str, ...], days: tuple[int, ...], tmp_path: Path
) -> None:
    path = tmp_path / "x.log"
    path.write_text("".join(f"{date} 10:00:00.100 TX: 01 03 00 00 00 02 C4 0B\n" for date in dates))
    log = read(path)
    times = [item.time for item in log.items()]
    assert [(time - times[0]) // (86_400 * 10**9) for time in times] == list(days)
    assert "taken as" not in log.completeness().text


def test_a_date_that_reads_two_ways_is_said(tmp_path: Path) -> None:
    path = tmp_path / "x.log"
    path.write_text("05/11/2024 10:00:00.100 TX: 01 03 00 00 00 02 C4 0B\n" * 3)
    log = read(path)
    assert list(log.items())
    assert "dates taken as month/day/year" in log.completeness().text


@pytest.mark.parametrize(
    ("step", "unit", "said"),
    [("137", "ms", True), ("137123", "µs", True), ("137123456", "ns", True), ("0.137", "s", False)],
)
def test_the_unit_of_a_bare_time_is_told_by_its_steps(step: str, unit: str, said: bool, tmp_path: Path) -> None:
    path = tmp_path / "x.log"
    times = [1234 + float(step) * number for number in range(6)]
    text = [f"{time:.3f}" if "." in step else f"{time:.0f}" for time in times]
    path.write_text("".join(f"{time} TX 01 03 00 00 00 02 C4 0B\n" for time in text))
    log = read(path)
    first, second, *_ = (item.time for item in log.items())
    assert second - first == pytest.approx(float(step) * {"s": 1e9, "ms": 1e6, "µs": 1e3, "ns": 1}[unit], rel=1e-6)
    assert (f"times taken as {unit}" in log.completeness().text) == said


@pytest.mark.parametrize(
    "odd",
    [
        "221111111111111111111 ms TX 01 03 00 00 00 02 C4 0B",
        "22136-222222222222222222222554 uart-1: 00",
        "@4fffffffffffffff00000000 TX 01 03 00 00 00 02 C4 0B",
        "134168328002500000 TX 01 03 00 00 00 02 C4 0B",
    ],
)
def test_a_number_that_no_time_can_be(odd: str, tmp_path: Path) -> None:
    path = tmp_path / "x.log"
    usual = odd.replace("221111111111111111111", "17").replace("22222222222222222222", "").replace("13416832", "1341")
    path.write_text("".join(f"{usual}\n{odd}\n{usual}\n" for _ in range(4)))
    times = [item.time for item in read(path).items()]
    assert len(times) == 12
    assert all(0 <= time < 1 << 63 for time in times)


def octets_of(path: Path) -> bytes:
    return b"".join(item.octets for item in read(path).items() if isinstance(item, Chunk))


CODES = (bytes((80, 3, 0, 33, 0, 16, 217, 159)), bytes((80, 16, 12, 10, 11, 13, 40, 47)))
TEXT = b":010300000002FA\r\n"


@pytest.mark.parametrize(
    ("written", "octets"),
    [
        ((CODES[0], CODES[1]), "".join(map(chr, b"".join(CODES))).encode("latin-1")),  # two digits, beside others
        ((TEXT, TEXT), TEXT + TEXT),  # nothing but two digits, and frames of characters
    ],
)
def test_codes_of_two_digits_are_decimal_where_the_log_tells(
    written: tuple[bytes, ...], octets: bytes, tmp_path: Path
) -> None:
    path = tmp_path / "x.log"
    path.write_text("".join("TX: " + "".join(f"#{octet}" for octet in line) + "\n" for line in written * 4))
    assert octets_of(path) == octets * 4


def test_pairs_behind_a_sign_stay_pairs(tmp_path: Path) -> None:
    path = tmp_path / "x.log"
    path.write_text("TX: #01#03#00#00#00#02#C4#0B\nRX: #01#03#04#00#01#00#02#2A#32\n" * 4)
    assert octets_of(path) == bytes.fromhex("010300000002C40B 01030400010002 2A32") * 4


def test_strings_that_need_no_escape_are_octets_beside_others(tmp_path: Path) -> None:
    path = tmp_path / "x.log"
    heard = (b"P\x03\x00", b"!", b"\x00", b"AB", TEXT[:1], TEXT[1:-2], TEXT[-2:])
    path.write_text("".join(f"rx {octets!r}\n" for octets in heard * 4) + "opened b'COM7'\n")
    assert octets_of(path) == b"".join(heard) * 4
