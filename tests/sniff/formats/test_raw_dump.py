"""Octets and nothing else: what is read of them does not hang on the rate that somebody says."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from dissectors.frame import Chunk
from dissectors.line import LineSettings
from sniff.bus.offline import settled
from sniff.engine.session import with_settings
from sniff.formats import read

CAPTURES = Path(__file__).parents[3] / "captures"
RATES = ("1200,8N1", "9600,8N1", "19200,8E1", "38400,8N1", "115200,8N1", "1500000,8E1")


@pytest.mark.parametrize("name", ["rtu", "ascii", "n2", "mstp", "profibus"])
def test_another_rate_reads_the_same_frames(name: str, tmp_path: Path) -> None:
    known = read(CAPTURES / f"{name}-usual-faults.cap.txt")
    path = tmp_path / "x.bin"
    path.write_bytes(b"".join(item.octets for item in known.items() if isinstance(item, Chunk)))
    told = []
    for rate in RATES:
        dump = read(path)
        session = with_settings(dump.session, known.session.protocol, LineSettings.parse(rate))
        rows = list(settled(dump.items(), replace(session, adapter=dump.session.adapter)))
        told.append([(one.row.event.octets, one.transaction.verdict if one.transaction else None) for one in rows])
        assert b"".join(octets for octets, _ in told[-1]) == path.read_bytes()
    assert all(one == told[0] for one in told)
