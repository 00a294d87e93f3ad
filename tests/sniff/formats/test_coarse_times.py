"""Of when something came no more is claimed than a file shows: the place of the last digit of its times."""

from __future__ import annotations

from pathlib import Path

import pytest

from dissectors.line import MS, NS_PER_S, LineSettings
from dissectors.modbus.envelope import seal_rtu
from dissectors.tracker import Verdict
from sniff.bus.offline import settled
from sniff.engine.session import with_settings
from sniff.formats import read
from tests.sniff.formats.packets_made import as_pcap

ASKED, ANSWERED = seal_rtu(b"\1\3\0\0\0\2"), seal_rtu(b"\1\3\4\0\1\0\2")


def _table(path: Path, heading: str, stamp: str) -> Path:
    rows = []
    for number in range(8):
        octets = ANSWERED if number % 2 else ASKED
        if heading.startswith("Start"):
            octets = octets[:1]  # as a logic analyser's; of whole frames nobody knows how a program timed them
        rows.append(f"{stamp.format(seconds=number // 2, parts=100 * number + 23)},{octets.hex(' ')}\n")
    path.write_text(f"{heading}\n{''.join(rows)}")
    return path


@pytest.mark.parametrize(
    ("heading", "stamp", "latency"),
    [
        ("Time,Data", "2026-03-01 10:00:{seconds:02}", NS_PER_S),
        ("Time,Data", "2026-03-01 10:00:{seconds:02}.{parts:03}", 20 * MS),  # assumed of another program
        ("Start,Data", "{seconds}.{parts:03}", MS),
        ("Start,Data", "{seconds}.{parts:06}", 0),
        ("Start [ms],Data", "{seconds}{parts:03}", MS),
        ("Start [us],Data", "{seconds}{parts:06}", 0),
    ],
)
def test_a_table(heading: str, stamp: str, latency: int, tmp_path: Path) -> None:
    adapter = read(_table(tmp_path / "x.csv", heading, stamp)).session.adapter
    assert adapter.latency == latency
    assert ("counts" in adapter.latency_from) is (latency in (MS, NS_PER_S))


@pytest.mark.parametrize(("steps", "latency"), [("250 8 200 7", MS), ("250 8.2 200 7.4", MS // 10), ("250 8.2345", 0)])
def test_a_text_capture(steps: str, latency: int, tmp_path: Path) -> None:
    path = tmp_path / "x.cap.txt"
    lines = [f"+{step} {ASKED.hex(' ')}" for step in steps.split()]
    path.write_text("#!sniff-capture 1\n# line: 19200,8E1\n# protocol: modbus-rtu\n" + "\n".join(2 * lines) + "\n")
    adapter = read(path).session.adapter
    assert adapter.latency == latency
    assert ("multiples" in adapter.latency_from) is (latency > 0)


def test_packets_whose_times_are_whole_seconds(tmp_path: Path) -> None:
    begin = 1_772_359_200 * NS_PER_S
    packets = [(begin + number // 2 * NS_PER_S, ANSWERED if number % 2 else ASKED) for number in range(8)]
    session = read(as_pcap(tmp_path / "x.pcap", packets, 147)).session
    assert (session.adapter.latency, session.has_times) == (NS_PER_S, True)
    assert with_settings(session, "modbus-rtu", session.line).adapter.latency == NS_PER_S
    packets = [(time + number * 15 * MS, octets) for number, (time, octets) in enumerate(packets)]
    assert read(as_pcap(tmp_path / "y.pcap", packets, 147)).session.adapter.latency == 20 * MS


@pytest.mark.parametrize("step", [0, 1000])
def test_packets_that_somebody_only_put_in_order(step: int, tmp_path: Path) -> None:
    """As text2pcap does where a dump has no times."""
    begin = 1_772_359_200 * NS_PER_S
    packets = [(begin + number * step, ANSWERED if number % 2 else ASKED) for number in range(40)]
    capture = read(as_pcap(tmp_path / "x.pcap", packets, 147))
    assert not capture.session.has_times
    session = with_settings(capture.session, "modbus-rtu", LineSettings.parse("9600,8N1"))
    assert not session.has_times
    verdicts = [one.transaction.verdict for one in settled(capture.items(), session) if one.transaction is not None]
    assert verdicts == [Verdict.ANSWERED] * 40
