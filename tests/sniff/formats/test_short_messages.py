"""Messages of one to three octets, and frames in characters, in logs whose other lines have more: none is lost."""
# ruff: noqa: E501

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from dissectors.frame import Chunk
from sniff.formats import read
from sniff.formats.log_spellings import CONTROLS

FIELD = [bytes.fromhex(digits) for digits in (
    "DC0101", "DC0102", "6805058F82025A046D16", "E5", "10030249 4E16", "E5", "010302", "DC0201", "6807070381463A3E0200 4416",
    "6805058103083D3E0716", "E5", "DC0102", "DC0201", "1002015D6016", "E5",
)]  # fmt: skip
"""Tokens and short acknowledges of PROFIBUS."""
TEXT = [b">01FA7\r", b"A10617\r", b">0104C5\r", b"A\r", b">0104C5\r", b"A0042910000BC\r", b">0132C8\r", b"A\r"]
"""Metasys N2 with its acknowledge of two octets."""
ASCII = [b":010325200004B3\r\n", b":010308002400000000000000D0\r\n"] * 4


NAMES = {code: f"<{name}>" for code, name in enumerate([*CONTROLS, "SPACE"])}


def hx(octets: bytes, between: str = " ", form: str = "{:02X}") -> str:
    return between.join(form.format(octet) for octet in octets)


def shown(octets: bytes) -> str:
    return "".join(chr(octet) if 0x20 <= octet < 0x7F else "." for octet in octets)


def numbered(octet: int) -> str:
    return f"{chr(octet) if 0x20 < octet < 0x7F else NAMES.get(octet, '?')} ({octet:03d})"


def dump(octets: bytes) -> str:
    rows = [octets[at : at + 16] for at in range(0, len(octets), 16)]
    return "".join(f"    {hx(row):<48}  {shown(row):<16}\n" for row in rows)


def way(number: int) -> str:
    return "TX" if number % 2 == 0 else "RX"


Written = Callable[[int, bytes], str]
KINDS: dict[str, Written] = {
    "time and pairs": lambda i, o: f"10:00:{i:02d}.512: {hx(o)}\n",
    "hexlify": lambda i, o: f"b'{o.hex()}'\n",
    "json": lambda i, o: f'{{"ts": "2026-03-14T10:00:{i:02d}Z", "dir": "{way(i)}", "hex": "{o.hex()}", "len": {len(o)}}}\n',
    "0x": lambda i, o: f"[2026/03/14 10:00:{i:02d}] {'=>' if i % 2 else '<='} Poll [{hx(o, ' ', '0x{:02x}')}]\n",
    "in brackets": lambda i, o: hx(o, "", "[{:02X}]" if i % 2 == 0 else "<{:02X}>") + "\n",
    "syslog": lambda i, o: f"Mar 14 10:00:{i:02d} pi app[812]: {hx(o, '', '<{:02X}>')}\n",
    "pymodbus": lambda i, o: f"2026-03-14 10:00:{i:02d},512 DEBUG transport:225 recv: {hx(o, ' ', '{:#x}')}\n",
    "length ahead": lambda i, o: f"{i}\t10:00:{i:02d}\ta.exe\tIRP_MJ_READ\tSerial0\tSUCCESS\tLength {len(o)}: {hx(o)}\n",
    "characters behind": lambda i, o: f"{i}\t10:00:{i:02d}\tIRP_MJ_READ\tUP\t{hx(o)}\t{shown(o)}\t{len(o)}\t\tCOM3\n",
    "head and dump": lambda i, o: f"[14/03/2026 10:00:{i:02d}] Read data (COM3)\n{dump(o)}",
    "host ahead": lambda i, o: f"[2026-03-14 10:00:{i:02d}.512]# RECV HEX from 192.168.0.7 :8899>\n{hx(o)} \n\n",
    "packed time": lambda i, o: f"<202603141000{i:02d}.512 {way(i)}>\n{hx(o)}\n",
    "digits behind a comma": lambda i, o: f"2026/03/14 10:00:{i:02d},{o.hex().upper()}\n",
    "colons": lambda i, o: f"[10:00:{i:02d}.512][D][uart_debug:114]: {'>>>' if i % 2 else '<<<'} {hx(o, ':')}\n",
    "decimals": lambda i, o: f"[10:00:{i:02d}][D][uart:1]: {'>>>' if i % 2 else '<<<'} {hx(o, ',', '{}')}\n",
    "number and characters": lambda i, o: f"10:00:{i:02d}.512\t{way(i)}\t{len(o)}\t{hx(o)}\t{shown(o)}\n",
    "number ahead of small digits": lambda i, o: f"{i:5d}   {i / 8:.6f}  DTE → DCE  Modbus/RTU {len(o)} {o.hex(' ')}\n",
    "&H": lambda i, o: f"{way(i)}: {hx(o, ' ', '&H{:02X}')}\n",
    "16#": lambda i, o: f"{way(i)}: {hx(o, ', ', '16#{:02X}')}\n",
    "characters with numbers": lambda i, o: f"Host --> {' '.join(map(numbered, o))} \n",
    "sum behind": lambda i, o: f"DATE=2026-03-14T10:00:{i:02d}.512;FRAME={hx(o, '-')};CRC=OK;CRC_VAL=0x{sum(o):04X};\n",
    "pairs in quotes": lambda i, o: f"10:00:{i:02d}.512 MB: {{'RawData':{[f'{one:02X}' for one in o]}}}\n",
    "strings of a character": lambda i, o: f"10:00:{i:02d}.512 {[bytes((octet,)) for octet in o]}\n",
    "assembler": lambda i, o: f"10:00:{i:02d}.512 {way(i)} {', '.join('0' * (one > 0x9F) + f'{one:02X}h' for one in o)}\n",
    "decimals in brackets": lambda i, o: hx(o, "", "[{:03d}]") + "\n",
    "data of a phone": lambda i, o: f"10:00:{i:02d}.512 app {{length = {len(o)}, bytes = 0x{o.hex()}}}\n",
    "a check in a column": lambda i, o: f"10:00:{i:02d}.512 {way(i)} {f'{hx(o[:-1])} | {hx(o[-1:])}'.strip(' |')}\n",
    "ticks with c1 in them": lambda i, o: f"0x002{'C1F'[i % 3:]}{i:04X} {way(i)} {hx(o)}\n",
    "decimals on lines": lambda i, o: f'{{"t": {i}, "data": [\n' + ",\n".join(f" {octet}" for octet in o) + "\n]}\n",
}  # fmt: skip


@pytest.mark.parametrize("frames", [FIELD, TEXT, ASCII], ids=["field", "text", "ascii"])
@pytest.mark.parametrize("kind", KINDS)
def test_all_octets_are_read(kind: str, frames: list[bytes], tmp_path: Path) -> None:
    path = tmp_path / "x.log"
    path.write_text("".join(KINDS[kind](number, frame) for number, frame in enumerate(frames * 2)))
    log = read(path)
    found = b"".join(item.octets for item in log.items() if isinstance(item, Chunk))
    assert found == b"".join(frames * 2), log.completeness().text
    assert log.completeness().whole


IN_CHARACTERS: dict[str, Written] = {
    "names": lambda i, o: f"10:00:{i:02d}.512 {way(i)} {o.decode().replace(chr(13), '<CR>')}\n",
    "plain": lambda i, o: f"10:00:{i:02d}.512 {way(i)} {o.decode().rstrip()}\n",
}


@pytest.mark.parametrize("kind", IN_CHARACTERS)
def test_answers_in_characters(kind: str, tmp_path: Path) -> None:
    path = tmp_path / "x.log"
    path.write_text("".join(IN_CHARACTERS[kind](number, frame) for number, frame in enumerate(TEXT * 2)))
    found = b"".join(item.octets for item in read(path).items() if isinstance(item, Chunk))
    assert found == b"".join(TEXT * 2)


def test_short_messages_with_a_label_of_their_own_repeat_nobody(tmp_path: Path) -> None:
    path = tmp_path / "x.log"
    lines = [
        f"10:00:00.{i:03d} N2 {way(i)} {'Len=' if len(o) > 2 else 'raw'}: {hx(o)}\n" for i, o in enumerate(TEXT * 4)
    ]
    path.write_text("".join(lines))
    found = b"".join(item.octets for item in read(path).items() if isinstance(item, Chunk))
    assert found == b"".join(TEXT * 4)


TABLES: dict[str, tuple[str, Written]] = {
    "German": (
        "Datum;Zeit;Richtung;Daten\n",
        lambda i, o: f"14.03.2026;23:58:{i:02d},512;{way(i)};{hx(o)}\n",
    ),
    "number of octets": (
        "Timestamp,Direction,Bytes,Data\n",
        lambda i, o: f"3/14/2026 11:58:{i:02d}.512 PM,{way(i)},{len(o)},{hx(o)}\n",
    ),
    "name and base": ("Zeit;Daten (hex)\n", lambda i, o: f"2026-03-14 23:58:{i:02d},512;{hx(o)}\n"),
    "rows that go on": (
        "Date\tTime\tEvent\tLength\tData\n",
        lambda i, o: (
            f"3/14/2026\t11:58:{i:02d}.512 PM\t{way(i)}\t{len(o)}\t"
            + "\n\t\t\t\t".join(hx(o[at : at + 4]) for at in range(0, len(o), 4))
            + "\n"
        ),
    ),
    "octets in columns": (
        "Timestamp,Data0,Data1,Data2,Data3,Data4,Data5,Data6,Data7,ASCII\n",
        lambda i, o: "".join(
            f"2026-03-14T23:58:{i:02d}.512Z,{hx(row, ',')}{',' * (8 - len(row))},{shown(row).replace(',', '.')}\n"
            for row in (o[at : at + 8] for at in range(0, len(o), 8))
        ),
    ),
}


@pytest.mark.parametrize("frames", [FIELD, TEXT, ASCII], ids=["field", "text", "ascii"])
@pytest.mark.parametrize("kind", TABLES)
def test_tables(kind: str, frames: list[bytes], tmp_path: Path) -> None:
    path = tmp_path / "x.csv"
    heading, written = TABLES[kind]
    path.write_text(heading + "".join(written(number, frame) for number, frame in enumerate(frames * 2)))
    log = read(path)
    chunks = [item for item in log.items() if isinstance(item, Chunk)]
    assert b"".join(chunk.octets for chunk in chunks) == b"".join(frames * 2), log.completeness().text
    assert log.completeness().whole
    assert chunks[0].time == 1_773_532_680_512_000_000  # 2026-03-14T23:58:00.512Z


def test_levels_of_lines_are_no_octets(tmp_path: Path) -> None:
    path = tmp_path / "x.csv"
    path.write_text("Time [s],D0,D1\n" + "".join(f"{number * 1e-4:.6f},{number % 2},1\n" for number in range(40)))
    assert read(path).session.adapter.name == "logic analyser"


@pytest.mark.parametrize("word", ["ok", "RX: on", "12 polls", "10:00:09.512: ready", "10:00:09.512: /dev/ttyS0"])
def test_words_are_no_octets(word: str, tmp_path: Path) -> None:
    path = tmp_path / "x.log"
    path.write_text("".join(f"10:00:0{number}.512: {hx(frame)}\n{word}\n" for number, frame in enumerate(FIELD[:8])))
    found = b"".join(item.octets for item in read(path).items() if isinstance(item, Chunk))
    assert found == b"".join(FIELD[:8])
