"""Pairs of hexadecimal digits two spaces apart, among them rows of pairs without a letter."""

from __future__ import annotations

from pathlib import Path

import pytest

from dissectors.frame import Chunk
from dissectors.modbus.envelope import seal_rtu
from sniff.formats.bytelog import read

REQUEST = seal_rtu(bytes.fromhex("07 03 00 40 00 05"))
ANSWER = seal_rtu(bytes.fromhex("07 03 0A 00 0C 00 17 00 22 00 2D 00 38"))


@pytest.mark.parametrize("lead", ["[RTU]>{way} > 08:00:0{n}:250 - ", "{way}: ", "08:00:0{n}.250 {way}  "])
def test_pairs_without_letters_are_no_column_of_decimal_numbers(tmp_path: Path, lead: str) -> None:
    path = tmp_path / "x.log"
    rows = [(way, n) for n in range(3) for way in ("Tx", "Rx")]
    sent = [REQUEST if way == "Tx" else ANSWER for way, _ in rows]
    lines = [
        lead.format(way=way, n=n) + octets.hex(" ").replace(" ", "  ").upper()
        for (way, n), octets in zip(rows, sent, strict=True)
    ]
    path.write_text("".join(f"{line}  \n" for line in lines))
    assert [item.octets for item in read(path).items() if isinstance(item, Chunk)] == sent
