"""Logs whose times are none, of buses with long frames: nothing is damaged, late, lost or unheard for it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from dissectors import registry
from dissectors.bacnet.envelope import frame
from dissectors.findings import Finding, Severity
from dissectors.frame import Frame
from dissectors.line import LineSettings
from sniff.analysis.judging import Judging
from sniff.bus.offline import outputs
from sniff.engine.engine import Output
from sniff.engine.session import LineEvent
from sniff.formats import read
from tests.dissectors.bacnet.ring_script import Step, data, rounds, token

MS = 1_000_000
READ = "01040275010c0c020004d2194c"
_LIST = bytes.fromhex("010030010c0c020004d2194c3e" + "c400000001" * 270 + "3f")


def sent() -> list[bytes]:
    """A clean ring in which 31 answers with extended frames of 1400 octets now and then, and with short ones."""
    steps: list[Step] = []
    for _ in range(6):
        steps += [*rounds(12, 12, 31, 40), (2, data(12, 31, READ, expects=True)), (18, frame(33, 12, 31, _LIST))]
        steps += [
            *rounds(12, 12, 31, 40),
            (2, data(12, 31, READ, expects=True)),
            (8, frame(7, 12, 31)),
            (2, token(12, 31)),
        ]
        steps += [(2, data(31, 12, _LIST[:200].hex())), (2, token(31, 40)), (2, token(40, 12))]
    return [octets for _, octets in steps]


def a_frame_a_line(frames: list[bytes]) -> str:
    return "".join(octets.hex(" ").upper() + "\n" for octets in frames)


def hexdump(frames: list[bytes]) -> str:
    octets = b"".join(frames)
    return "".join(f"{at:08x}  {octets[at : at + 16].hex(' ')}\n" for at in range(0, len(octets), 16))


def to_the_second(frames: list[bytes]) -> str:
    lines, time = [], 0
    for octets in frames:
        time += 5 * MS + len(octets) * MS // 4
        lines.append(f"12:00:{time // (1000 * MS):02d}  {octets.hex(' ').upper()}\n")
    return "".join(lines)


def judged(path: Path, rate: str) -> tuple[list[bytes], list[Finding]]:
    """The good frames of a log, and what is found above a note."""
    capture = read(path)
    capture.session = session = replace(capture.session, protocol="mstp", line=LineSettings.parse(rate))
    judging, good = Judging(session, registry.get("mstp"), {}), []
    for item in outputs(capture.items(), session):
        if isinstance(item, LineEvent):
            continue
        assert isinstance(item, Output)
        judging.add(item)
        good += [row.event.octets for row in item.rows if isinstance(row.event, Frame) and row.event.ok]
    return good, [one for one in judging.findings() if one.severity >= Severity.WARNING]


@pytest.mark.parametrize("rate", ["9600,8N1", "38400,8N1", "115200,8N1"])
@pytest.mark.parametrize("write", [a_frame_a_line, hexdump, to_the_second])
def test_a_clean_ring(write: Callable[[list[bytes]], str], rate: str, tmp_path: Path):
    frames = sent()
    path = tmp_path / "ring.log"
    path.write_text(write(frames))
    good, graves = judged(path, rate)
    assert good == frames
    assert not [(one.code, one.seen) for one in graves]
