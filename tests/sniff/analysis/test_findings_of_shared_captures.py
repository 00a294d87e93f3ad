"""What `check` finds in traffic that nobody of this project made: each finding was compared with the capture by eye.

A capture that is not listed with a finding must not give it: the sets are exact, from note upwards.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from itertools import islice

import pytest

from dissectors.findings import Finding, Severity
from dissectors.frame import Chunk
from dissectors.line import LineSettings
from sniff.analysis.judging import Judging
from sniff.bus.offline import outputs
from sniff.engine.engine import Output
from sniff.engine.follow_settings import dissector_for
from sniff.engine.session import Item, Session
from sniff.formats import read
from tests.captures_shared import Listed, folder, listed, timed

MS = 1_000_000
RTU, ASCII, N2, MSTP = "modbus-rtu", "modbus-ascii", "n2", "mstp"
ANALYSER = (
    ("sigrok-brainchild-io16do", "19200,8E1"),
    *(
        (f"sigrok-flowmeter-{name}", "9600,8N1")
        for name in ("graph_tool", "target_0liter_per_min", "target_20liter_per_min")
    ),
)


def findings_of(protocol: str, line: str, items: Iterable[Item], session: Session | None = None) -> tuple[Finding, ...]:
    settings = LineSettings.parse(line)
    if session is None:
        session = Session(port="shared", line=settings, protocol=protocol)
    session = replace(session, line=settings, protocol=protocol)
    judging = Judging(session, dissector_for(session))
    for item in outputs(iter(items), session):
        if isinstance(item, Output):
            judging.add(item)
    return judging.findings()


def said(findings: Iterable[Finding]) -> set[tuple[str, str, str]]:
    return {(f.severity.label, f.code, f.subject) for f in findings if f.severity > Severity.INFO}


def spaced(frames: Iterable[Listed], line: str, silence: Callable[[Listed], int]) -> Iterator[Chunk]:
    """Frames that came without times, each behind so much silence (ns)."""
    char, now = LineSettings.parse(line).char, 0
    for frame in frames:
        now += silence(frame) + len(frame.octets) * char
        yield Chunk(now, frame.octets)


def in_pairs(frame: Listed) -> int:
    """The vectors of minimalmodbus: N.0 is a request, N.1 its answer."""
    return 100 * MS if frame.when.endswith(".0") else 10 * MS


@pytest.mark.parametrize(("name", "line"), ANALYSER)
def test_a_logic_analyser_on_buses_in_order(name: str, line: str) -> None:
    octets = [Chunk(octet.end, bytes((octet.octet,))) for octet in timed(name)]
    assert said(findings_of(RTU, line, octets)) == set()


@pytest.mark.parametrize("name", ["modbus-rtu-omega-cn7500", "modbus-rtu-delta-dtb4824"])
def test_recorded_pairs_in_order(name: str) -> None:
    assert said(findings_of(RTU, "19200,8E1", spaced(listed(name), "19200,8E1", in_pairs))) == set()


def test_a_battery_that_always_answers_from_another_address() -> None:
    frames = listed("modbus-rtu-daly-ess")
    chunks = spaced(frames, "9600,8N1", lambda frame: (100 if ">>>" in frame.note else 20) * MS)
    findings = findings_of(RTU, "9600,8N1", chunks)
    assert said(findings) == {("note", "MB206", "station 129")}
    (finding,) = (finding for finding in findings if finding.code == "MB206")
    assert finding.count == len(frames) // 2


def test_answers_alone_are_answers_that_nobody_asked_for() -> None:
    chunks = spaced(listed("modbus-rtu-daly-ble-responses"), "9600,8N1", lambda _: 1000 * MS)
    findings = findings_of(RTU, "9600,8N1", chunks)
    assert said(findings) == {("warning", "MB207", "bus")}


def test_vectors_that_are_wrong_on_purpose() -> None:
    """From pair 73 on they hold words of English, answers of other functions, and a local echo with another count."""
    frames = listed("vectors-minimalmodbus-rtu")
    good = [frame for frame in frames if "GOOD_RTU" in frame.note]
    assert {code for _, code, _ in said(findings_of(RTU, "19200,8E1", spaced(good, "19200,8E1", in_pairs)))} <= {
        *("MB002", "MB005", "MB008", "MB010")  # answers that its tests of wrong answers are made with
    }
    everything = said(findings_of(RTU, "19200,8E1", spaced(frames, "19200,8E1", in_pairs)))
    assert ("warning", "LN204", "bus") in everything  # "TESTMESSAGE" …
    assert ("warning", "MB010", "station 1") in everything
    assert not any(severity == "error" for severity, _, _ in everything)


def test_ascii_lines_of_several_issues() -> None:
    """Two answers of which the source shows only a part, a request without answer, and one with a wrong LRC: nobody has
    more of the damage than it sends."""
    char = LineSettings.parse("9600,7E1").char
    chunks = [
        Chunk(int(float(frame.when) * 1e9) + len(frame.octets) * char, frame.octets)
        for frame in listed("modbus-ascii-misc")
    ]
    assert said(findings_of(ASCII, "9600,7E1", chunks)) == {
        ("warning", "MB007", "bus"),
        ("note", "MB005", "station 1"),
        ("note", "MB002", "station 1"),
        ("note", "MB009", "master"),
    }


def test_vectors_of_n2_ask_for_a_point_that_is_not_there() -> None:
    frames = listed("vectors-n2open-digimat")
    chunks = spaced(frames, "9600,8N1", lambda frame: (100 if frame.octets[:1] == b">" else 20) * MS)
    assert said(findings_of(N2, "9600,8N1", chunks)) == {("warning", "N2002", "station 1, AI 153")}


@pytest.mark.parametrize(("name", "line"), [("mstp-chipkin-cas-log", "9600,8N1"), ("vectors-mstp-misc", "38400,8N1")])
def test_frames_of_mstp_without_times(name: str, line: str) -> None:
    """Without tokens in it, a capture says nothing about who may send; a single damaged frame is no finding."""
    assert said(findings_of(MSTP, line, spaced(listed(name), line, lambda _: 5 * MS))) == set()


@pytest.mark.parametrize("name", ["profibus-dp-excerpts", "negative-logo-td"])
@pytest.mark.parametrize("protocol", [RTU, ASCII, N2, MSTP])
def test_a_foreign_protocol_is_no_frame_at_all(name: str, protocol: str) -> None:
    chunks = spaced(listed(name), "19200,8E1", lambda _: 50 * MS)
    assert said(findings_of(protocol, "19200,8E1", chunks)) == {("error", "LN003", "bus")}


def pcap(name: str, file: str, first: int | None = None) -> tuple[Finding, ...]:
    capture = read(folder(name) / file)
    return findings_of(MSTP, "38400,8N1", islice(capture.items(), first), capture.session)


def test_a_ring_that_a_master_leaves() -> None:
    """27 does not answer row 582, ignores two tokens, and is not heard again; 27 polls far beyond 27.

    11 takes 38 … 45 ms to use five of its tokens: over 15 ms, though the capture's times may be late by 20 ms.
    """
    findings = pcap("mstp-kargs-2009", "mstp_20090227094623.pcap")
    assert said(findings) == {
        ("error", "MS106", "MAC 27"),
        ("warning", "MS103", "MAC 11"),
        ("warning", "MS201", "MAC 27"),  # 12 polls more, yet only to find a new successor
        ("note", "MS301", "0 → 27"),
        ("note", "MS305", "MAC 27"),  # row 202: reject buffer-overflow
        ("note", "MS102", "12 → 27"),
    }
    evidence = {finding.code: finding.evidence for finding in findings}
    assert (evidence["MS301"], evidence["MS102"], evidence["MS106"]) == ((582,), (587,), (588,))


def test_a_ring_of_three_that_polls_with_every_token() -> None:
    """Packet 8 has the preamble twice and 1500 zeros behind it, an artefact of the program that captured it."""
    assert said(pcap("mstp-md5-2018-good1", "mstp_2018_Good1.cap", 12_000)) == {
        ("warning", "MS201", "bus"),
        *(("note", "MS201", f"MAC {mac}") for mac in (2, 17, 47)),
        ("note", "LN203", "bus"),
        ("note", "LN204", "bus"),
        ("note", "MS403", "bus"),
    }


def test_a_ring_of_two_that_polls_with_every_token() -> None:
    findings = pcap("mstp-cimetrics-snap-mixed", "derived_linktype165.pcap")
    assert said(findings) == {
        ("warning", "MS201", "bus"),
        ("note", "MS201", "MAC 1"),
        ("note", "MS201", "MAC 114"),
    }
