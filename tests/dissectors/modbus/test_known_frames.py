"""Frames that a manual prints, or that were recorded from a live server, read as the manual says.

Sources: TECO E510 and F510 communication addenda, AutomationDirect ACN RS-485 communication, WEG CFW (device
identification), pymodbus on a pseudo-terminal. Every checksum is recomputed here; the two misprints of the manuals
are reported as bad.
"""

from __future__ import annotations

import pytest

from dissectors.modbus.text import text

RTU = """
010100130 00A4DC8               | request  | 1 ← read coils 0x0013 ×10
01010224 01633C                 | response | 1 → 16 bits: 00100100 10000000
010200050008 69CD               | request  | 1 ← read discrete 0x0005 ×8
01020192 2025                   | response | 1 → 8 bits: 01001001
010325200002 CECD               | request  | 1 ← read holding 0x2520 ×2
01030425202521 2A7D             | response | 1 → 2 registers: 9504 9505
010400080001 B008               | request  | 1 ← read input 0x0008 ×1
0104020008 B8F6                 | response | 1 → 1 register: 8
01050010FF00 8DFF               | either   | 1 ↔ write coil 0x0010 = on
010500100000 CC0F               | either   | 1 ↔ write coil 0x0010 = off
010601021770 27E2               | either   | 1 ↔ write register 0x0102 = 6000
0107 41E2                       | request  | 1 ← exception status
010700 2230                     | response | 1 → exception status 0x00
01080000A537 DA8D               | either   | 1 ↔ diagnostics: return query data A5 37
01080001FF00 F03B               | either   | 1 ↔ diagnostics: restart communications 0xFF00
010800033B00 033B               | either   | 1 ↔ diagnostics: change ascii input delimiter ";"
010800040000 A1CA               | request  | 1 ← diagnostics: force listen only mode
0108000B0000 91C9               | either   | 1 ↔ diagnostics: return bus message count
0108000B0123 D180               | response | 1 → diagnostics: bus message count 291
010B 41E7                       | request  | 1 ← event counter
010BFFFF0108 A479               | response | 1 → event counter 264, busy
010C 0025                       | request  | 1 ← event log
010C080000010801212000 0DC1     | response | 1 → event log: 264 events, 289 messages: 20 00
010F0013000A02CD01 72CB         | request  | 1 ← write coils 0x0013 ×10: 10110011 10
010F0013000A 2409               | response | 1 → write coils 0x0013 ×10
0110010100020400011770 6027     | request  | 1 ← write registers 0x0101 ×2: 1 6000
011001010002 11F4               | response | 1 → write registers 0x0101 ×2
0111 C02C                       | request  | 1 ← server id
01110950796D6F64627573FF 8DDC   | response | 1 → server id "Pymodbus", running
01140E0600040001000206000300090002 F4FD | request | 1 ← read file 4 record 1 ×2, 3 record 9 ×2
01140C05060DFE0020050633CD0040 79A1     | response | 1 → read file: 3582 32 / 13261 64
01150D0600040007000306AF04BE100D D60B   | either   | 1 ↔ write file 4 record 7 ×3: 1711 1214 4109
0116000400F20025 67EE           | either   | 1 ↔ mask write 0x0004 and 0x00F2 or 0x0025
011700030006000E00030600FF00FF00FF 4691 | request  | 1 ← read 0x0003 ×6, write 0x000E ×3: 255 255 255
01170C000300050005000600070008 DA77     | response | 1 → 6 registers: 3 5 5 6 7 8
011804DE 0347                   | request  | 1 ← read fifo 0x04DE
01180006000201B81284 1918       | response | 1 → fifo of 2: 440 4740
012B0E0100 7077                 | request  | 1 ← device id: basic from VendorName
012B0E010100000300045445434F0104463531300205 56312E3230 9185 | response | \
1 → device id: VendorName "TECO", ProductCode "F510", MajorMinorRevision "V1.20"
012B0E0183000000 0FAF           | response | 1 → device id: no objects
018302 C0F1                     | response | 1 → exception: illegal data address (read holding)
018305 8133                     | response | 1 → exception: acknowledge (read holding)
01AB01 9EF0                     | response | 1 → exception: illegal function (device id)
000625010001 1317               | broadcast | 0 ← broadcast: write register 0x2501 = 1
FE0325200001 9AC3               | request  | 254 ← read holding 0x2520 ×1
FE03020003 EC51                 | response | 254 → 1 register: 3
010625021770 2D12               | either   | 1 ↔ write register 0x2502 = 6000
010325230005 7F0F               | request  | 1 ← read holding 0x2523 ×5
01030A17701770 00000C800032 437B | response | 1 → 5 registers: 6000 6000 0 3200 50
010103100000 3D8B               | response | 1 → 24 bits: 00001000 00000000 00000000
010100000014 3C05               | request  | 1 ← read coils 0x0000 ×20
010103000001 FD8E               | either   | 1 ↔ read coils 0x0300 ×1
01030442F6E979 800B             | response | 1 → 2 registers: 17142 59769
0103021770 B650                 | response | 1 → 1 register: 6000
028352 30CD                     | response | 2 → exception: vendor 0x52 (read holding)
018352 C0CD                     | response | 1 → exception: vendor 0x52 (read holding)
010301230001 743C               | request  | 1 ← read holding 0x0123 ×1
018820 47D8                     | response | 1 → exception: vendor 0x20 (diagnostics)
018652 C39D                     | response | 1 → exception: vendor 0x52 (write register)
019052 CDFD                     | response | 1 → exception: vendor 0x52 (write registers)
01101102000204 00320064 1202    | request  | 1 ← write registers 0x1102 ×2: 50 100
011011020002 E534               | response | 1 → write registers 0x1102 ×2
"""

MISPRINTS = """
0103021770 AF82 | response | 1 → 1 register: 6000 [CRC error: 0xAF82, computed 0xB650]
028352 C0CD     | response | 2 → exception: vendor 0x52 (read holding) [CRC error: 0xC0CD, computed 0x30CD]
"""

ASCII = """
:0103001300 02E7        | request  | 1 ← read holding 0x0013 ×2
:010325200002B5         | request  | 1 ← read holding 0x2520 ×2
:010304252025216D       | response | 1 → 2 registers: 9504 9505
:01080000A5371B         | either   | 1 ↔ diagnostics: return query data A5 37
:0106010217706F         | either   | 1 ↔ write register 0x0102 = 6000
:0183027A               | response | 1 → exception: illegal data address (read holding)
:01865128               | response | 1 → exception: vendor 0x51 (write register)
:010301230001D7         | request  | 1 ← read holding 0x0123 ×1
:010302177073           | response | 1 → 1 register: 6000
:02835229               | response | 2 → exception: vendor 0x52 (read holding)
:01882057               | response | 1 → exception: vendor 0x20 (diagnostics)
:01865227               | response | 1 → exception: vendor 0x52 (write register)
:01100101000204000117705F | request | 1 ← write registers 0x0101 ×2: 1 6000
:011001010002EB         | response | 1 → write registers 0x0101 ×2
:0190521D               | response | 1 → exception: vendor 0x52 (write registers)
"""


def rows(table: str) -> list[tuple[str, str, str]]:
    lines = [line for line in table.replace("\\\n", "").splitlines() if line.strip()]
    parts = [[part.strip() for part in line.split("|", 2)] for line in lines]
    return [(octets.replace(" ", ""), role, words) for octets, role, words in parts]


@pytest.mark.parametrize(("octets", "role", "words"), rows(RTU), ids=lambda value: value[:16])
def test_rtu(octets, role, words, frame_of, peek_any):
    frame = frame_of(octets)
    header = peek_any(frame)
    assert frame.ok
    assert header.ok
    assert (header.role.value, text(frame, header, header.role)) == (role, words)


@pytest.mark.parametrize(("octets", "role", "words"), rows(MISPRINTS), ids=["E510 read response", "E510 read error"])
def test_misprints_of_the_manuals_are_bad(octets, role, words, frame_of, peek_any):
    frame = frame_of(octets)
    header = peek_any(frame)
    assert not header.ok
    assert (header.role.value, text(frame, header, header.role)) == (role, words)


@pytest.mark.parametrize(("characters", "role", "words"), rows(ASCII), ids=lambda value: value[:16])
def test_ascii(characters, role, words, frame_of, peek_any):
    frame = frame_of(characters.encode() + b"\r\n")
    header = peek_any(frame)
    assert frame.ok
    assert (header.protocol, header.ok) == ("modbus-ascii", True)
    assert (header.role.value, text(frame, header, header.role)) == (role, words)


def test_the_lrc_of_the_e510_manual(frame_of):
    """The sum of 01 03 01 00 0A is 0Fh, its LRC F1h (text of 1.0.1); the printed octets are no whole request."""
    assert frame_of(b":010301000AF1\r\n").ok
