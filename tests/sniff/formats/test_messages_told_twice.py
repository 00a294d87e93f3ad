"""Logs of eModbus, which tells a message as it came, once more without its check, and numbers of its own between."""

from __future__ import annotations

from pathlib import Path

from dissectors.frame import Chunk
from dissectors.modbus.envelope import seal_rtu
from sniff.formats.bytelog import read

ASKED = bytes.fromhex("09 04 00 10 00 02")
TOLD = bytes.fromhex("09 04 04 00 51 00 52")
WRITTEN = bytes.fromhex("09 06 00 07 00 01")


def rows(octets: bytes) -> str:
    dumped = (octets[at : at + 16] for at in range(0, len(octets), 16))
    return "".join(
        f"  | {16 * no:04X}: {one.hex(' ').upper():<49} |{'.' * len(one):<16}|\n" for no, one in enumerate(dumped)
    )


def heard(path: Path, text: str) -> list[bytes]:
    path.write_text(text)
    return [item.octets for item in read(path).items() if isinstance(item, Chunk)]


def test_what_is_told_without_its_check_is_what_came_before(tmp_path: Path) -> None:
    text = ""
    for body, answer in ((ASKED, TOLD), (WRITTEN, WRITTEN), (ASKED, TOLD)):
        text += f"[D] Sent packet: @3FFB0A1C/{len(body)}:\n{rows(body)}"
        text += f"[D] Raw buffer received: @3FFB0B2C/{len(answer) + 2}:\n{rows(seal_rtu(answer))}"
        text += f"[D] Received packet: @3FFB0C3C/{len(answer)}:\n{rows(answer)}"
        text += f"[V] Response packet: @3FFB0C3C/{len(answer)}:\n{rows(answer)}"
    bodies = [ASKED, TOLD, WRITTEN, WRITTEN, ASKED, TOLD]
    assert heard(tmp_path / "x.log", text) == [seal_rtu(one) for one in bodies]


def test_what_the_tool_makes_where_no_answer_came_is_no_message(tmp_path: Path) -> None:
    text, code = "", bytes([0xE0])
    for time in (100, 2200, 4300):
        text += f"[D] Sent packet: @3FFB0A1C/{len(ASKED)}:\n{rows(ASKED)}"
        text += f"[D] {time}| RTUutils.cpp         [ 437] receive: C/[D] Received packet: @3FFB0B2C/1:\n{rows(code)}"
        text += f"[V] Data: @3FFB0B2C/1:\n{rows(code)}"
        text += f"[V] Response packet: @3FFB0B2C/3:\n{rows(bytes.fromhex('09 84 E0'))}"
    assert heard(tmp_path / "x.log", text) == [seal_rtu(ASKED)] * 3
