"""Late reads: what came in them is excused, what came before them is not, however rows are handed over."""

from __future__ import annotations

from dissectors.frame import Chunk
from dissectors.line import LineSettings, Timing
from dissectors.modbus.envelope import seal_rtu
from dissectors.modbus.late_rows import LateRows
from sniff.analysis.judging import Judging
from sniff.bus.offline import outputs
from sniff.engine.engine import Output
from sniff.engine.follow_settings import dissector_for
from sniff.engine.session import Adapter, Session
from tests.faults.judged import findings_of

LINE = LineSettings.parse("9600,8N1")
MS = 1_000_000


def test_rows_are_found_among_others():
    late = LateRows()
    late.add((3, 4))
    late.add([900])
    assert late.among(2, 3)
    assert late.among(4, 8)
    assert not late.among(5, 899)
    for row in range(1000, 5000):
        late.add((row,))
    assert late.among(4990, 6000)
    assert not late.among(1, 900)


def test_damage_just_before_a_late_read_counts_both_ways():
    """Five answers with their checks the wrong way round, a request, and all else in one read that came late."""
    chunks, held, now, char = [], b"", 500 * MS, Timing(LINE).char
    for turn in range(8):
        request = seal_rtu(bytes((1, 16, 0, 1, 0, 1, 2, 0, turn)))
        answer = seal_rtu(bytes((1, 16, 0, 1, 0, 1)))
        for octets, gap in ((request, 80 * MS), (answer[:-2] + answer[-1:] + answer[-2:-1], 35 * MS)):
            now += gap + len(octets) * char
            if turn < 5 or (turn == 5 and octets is request):
                chunks.append(Chunk(now, octets))
            else:
                held += octets
    session = Session("x", LINE, "modbus-rtu", adapter=Adapter("exact", "", 0, "measured"))
    items = [*chunks, Chunk(now + 50 * MS, held)]
    judging = Judging(session, dissector_for(session))
    for output in outputs(items, session):
        if isinstance(output, Output):
            judging.add(output)
    (one,) = (finding for finding in judging.findings() if finding.code == "MB011")
    assert one.count == 5
    assert one in findings_of(session, items)


def test_an_answer_before_all_requests_is_excused_both_ways():
    """A capture that begins in the middle of an exchange, its first rows in one read."""
    said = b"\x78" + seal_rtu(bytes((19, 3, 2, 7, 0x6C)))
    for turn in range(12):
        said += seal_rtu(bytes((19, 3, 0, turn, 0, 1))) + seal_rtu(bytes((19, 3, 2, 7, turn)))
    session = Session("x", LINE, "modbus-rtu", adapter=Adapter("hub", "", 50 * MS, "measured"))
    items = [Chunk(500 * MS, said)]
    judging = Judging(session, dissector_for(session))
    for output in outputs(items, session):
        if isinstance(output, Output):
            judging.add(output)
    assert judging.findings() == findings_of(session, items)
    assert not [finding for finding in judging.findings() if finding.code == "MB207"]
