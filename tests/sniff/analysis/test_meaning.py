"""What a frame means: first in the line, in full in the tree and in JSON; the same by tables and row by row."""

from __future__ import annotations

from pathlib import Path

import pytest

from dissectors.frame import Frame
from dissectors.profiles import Devices
from dissectors.profiles.packaged import packaged
from sniff.analysis.packet_tree import Field
from sniff.analysis.row_tree import tree_of
from sniff.analysis.wording import describe
from sniff.bus.offline import settled
from sniff.engine.follow_settings import dissector_for
from sniff.engine.verdict_join import JudgedRow
from sniff.formats import text as text_format

CAPTURES = Path(__file__).parents[3] / "captures"
E510 = Devices(default=packaged("teco-e510"))
F510 = Devices(default=packaged("teco-f510"))
ACN = Devices(default=packaged("automationdirect-acn"))

HEAD = "#!sniff-capture 1\n# line: 19200,8E1\n# protocol: modbus-rtu\n# start: 2026-03-01T10:00:00Z\n"


def read(path: Path, devices: Devices) -> tuple[list[JudgedRow], list[str]]:
    """The rows of a capture, and their lines."""
    capture = text_format.read(path)
    dissector = dissector_for(capture.session)
    rows = list(settled(capture.items(), capture.session, devices))
    return rows, [describe(dissector, item.row, item.meaning) for item in rows]


def modbus(tmp_path: Path, frames: tuple[str, ...], devices: Devices) -> tuple[list[JudgedRow], list[str]]:
    from dissectors.checksums import crc16_modbus

    lines = []
    for text in frames:
        octets = bytes.fromhex(text)
        lines.append(f"+60 {(octets + crc16_modbus(octets).to_bytes(2, 'little')).hex(' ')}")
    path = tmp_path / "made.cap.txt"
    path.write_text(HEAD + "\n".join(lines) + "\n")
    return read(path, devices)


def tree(item: JudgedRow) -> dict[str, str]:
    """Names and values of everything in the tree."""
    found: dict[str, str] = {}

    def take(fields: tuple[Field, ...]) -> None:
        for field in fields:
            found.setdefault(field.name, field.value)
            take(field.children)

    assert isinstance(item.row.event, Frame)
    take(tree_of(dissector_for_protocol(item), item.row, item.transaction, str, item.meaning))
    return found


def dissector_for_protocol(item: JudgedRow) -> object:
    from dissectors import registry

    assert item.row.header is not None
    return registry.get(item.row.header.protocol)


READ_16 = ("0303 2520 0010", "0303 20" + "".join(f"{7 * place + 1:04x}" for place in range(16)))


def test_a_line_says_first_what_a_frame_means(tmp_path: Path) -> None:
    _, lines = modbus(tmp_path, READ_16, E510)
    assert lines[0].startswith("3 ← read status, fault, digital inputs, ")
    assert lines[0].endswith(" — holding 0x2520 ×16")
    assert lines[1].startswith("3 → status running, forward, not ready; fault UT; ")
    assert "output current 5.0 A" in lines[1]
    assert " — 16 registers: 1 8 15 " in lines[1]


def test_every_register_of_a_read_has_its_name_and_octets(tmp_path: Path) -> None:
    rows, _ = modbus(tmp_path, READ_16, E510)
    names = tree(rows[1])
    assert names["Register 2524h (wire 0x2524) output frequency"] == "0.29 Hz (29)"
    assert names["Register 2527h (wire 0x2527) output current"] == "5.0 A (50)"
    assert names["Register 2525h (wire 0x2525) reserved"] == "36"
    assert names["bit 0 running"] == "1 (running)"
    assert sum(name.startswith("Register 25") for name in names) == 16
    first = tree_of(dissector_for_protocol(rows[1]), rows[1].row, None, str, rows[1].meaning)[0]
    assert [(field.begin, field.end) for field in first.children[:2]] == [(3, 5), (5, 7)]


def test_parameters_that_have_but_a_number_are_said_as_a_span(tmp_path: Path) -> None:
    _, lines = modbus(tmp_path, ("0303 0000 0014", "0303 0012 0002", "0303 2524 0001"), E510)
    assert lines[0] == "3 ← read parameters 00-00 … 00-19 — holding 0x0000 ×20"
    assert lines[1].startswith("3 ← read parameter 00-18, parameter 00-19 — ")
    rows, _ = modbus(tmp_path, ("0303 0000 0014",), E510)
    assert tree(rows[0])["Register 0013h (wire 0x0013)"] == "parameter 00-19"  # the tree has each


def test_without_a_profile_registers_have_their_numbers(tmp_path: Path) -> None:
    rows, lines = modbus(tmp_path, (*READ_16, "0101 0010 000a", "0101 02 5501"), Devices())
    assert lines[1] == "3 → 16 registers: 1 8 15 22 29 36 43 50 57 64 … +6"
    assert tree(rows[1])["Register 0x2524 (49509)"] == "29"
    coils = tree(rows[3])
    assert (coils["Coil 17 (wire 0x0010)"], coils["Coil 18 (wire 0x0011)"]) == ("1", "0")


def test_the_wire_number_is_told_where_it_is_another(tmp_path: Path) -> None:
    rows, lines = modbus(tmp_path, ("0103 030f 0001", "0103 02 007b"), ACN)
    assert lines[1] == "1 → output current 12.3 A — 1 register: 123"
    assert tree(rows[1])["Register 0310h (wire 0x030F, the manual's −1) output current"] == "12.3 A (123)"


def test_the_makers_words_replace_the_standards(tmp_path: Path) -> None:
    _, lines = modbus(tmp_path, ("0306 2501 0001", "0386 05"), E510)
    assert lines == [
        "3 ← run, forward — write register 0x2501 = 1",
        "3 → exception: write mode error (code 5, write register)",
    ]


def test_a_broadcast_is_for_all_of_one_kind(tmp_path: Path) -> None:
    each = Devices({1: packaged("teco-e510"), 2: packaged("teco-e510")})
    _, lines = modbus(tmp_path, ("0010 2501 0002 04 0003 1770",), each)
    assert lines[0].startswith("0 ← broadcast: all drives: run, reverse; frequency command 60.00 Hz — write registers")


def test_an_n2_answer_is_read_with_its_command() -> None:
    path = CAPTURES / "n2-clean.cap.txt"
    _, named = read(path, F510)
    _, bare = read(path, Devices())
    assert named[5].startswith("1 → motor rated voltage 460 V — AI 2 = 460 ")
    assert bare[5].startswith("1 → AI 2 = 460 (status 00h in front, no bit set, tentative) — A 00")
    assert bare[3].startswith("1 → AI 1 = 1750; AI 2 = 460; ")


@pytest.mark.parametrize("name", ["object-named-otherwise"])
def test_a_property_is_compared_with_the_manual(name: str) -> None:
    rows, lines = read(CAPTURES / "findings" / f"drive-{name}.cap.txt", F510)
    assert '"Something else"; the manual has "Frequency"' in " ".join(tree(rows[1]).values())
    assert "degrees-celsius (27)" not in lines[3]
    assert lines[7].startswith("5 → 2 output frequency 29.5 Hz — read-property ack")
    shown = tree(rows[7])
    assert shown["analog-input 4 present-value"] == "29.5"
    assert shown["property-identifier"] == "present-value (85)"


def test_a_value_out_of_its_range_is_marked(tmp_path: Path) -> None:
    rows, lines = modbus(tmp_path, ("0303 2524 0001", "0303 02 ffff"), E510)
    assert lines[1].startswith("3 → output frequency 655.35 Hz (out of range) — ")
    named = tree(rows[1])["Register 2524h (wire 0x2524) output frequency"]
    assert named == "655.35 Hz (65535) (out of the range 0 … 599 Hz)"


def test_a_code_of_the_makers_own_is_written_as_in_manuals(tmp_path: Path) -> None:
    _, lines = modbus(tmp_path, ("0303 2524 0001", "0383 52"), E510)
    assert lines[1].endswith("(code 0x52, read holding)")
