"""What is left of an answer that was cut short stands beside the master's frame, and is not the master's."""

from __future__ import annotations

import pytest

from dissectors.frame import Chunk
from dissectors.line import LineSettings
from dissectors.modbus.envelope import seal_rtu
from sniff.analysis.judging import Judging
from sniff.bus.offline import outputs
from sniff.engine.engine import Output
from sniff.engine.follow_settings import dissector_for
from sniff.engine.session import Adapter, Session

MS = 1_000_000
LINE = LineSettings.parse("19200,8E1")
POLL, ANSWER = seal_rtu(bytes.fromhex("030300000001")), seal_rtu(bytes.fromhex("0303020007"))


def accused(after: bytes, answer: bytes) -> set[tuple[str, str]]:
    """Stray octets that were found, behind an adapter that holds octets back; every third poll goes as told: `after`
    it directly, then `answer`."""
    now, chunks = 10**9, []
    for turn in range(60):
        odd = turn % 3 == 2
        now += 300 * MS
        chunks.append(Chunk(now, POLL + (after if odd else b"")))
        now += 16 * MS
        said = answer if odd else ANSWER
        if said:
            chunks.append(Chunk(now, said))
    session = Session("x", LINE, "modbus-rtu", adapter=Adapter(latency=17 * MS))
    judging = Judging(session, dissector_for(session))
    for output in outputs(chunks, session):
        assert isinstance(output, Output)
        judging.add(output)
    return {(one.code, one.subject) for one in judging.findings() if one.code in ("LN201", "LN202", "LN203")}


@pytest.mark.parametrize("left", [b"\x03", b"\x03\x03"])
def test_what_is_left_of_an_answer_is_nobodys(left: bytes) -> None:
    assert accused(left, b"") <= {("LN203", "bus")}  # two octets may be a damaged frame


def test_octets_after_a_poll_that_is_answered_are_the_masters() -> None:
    assert accused(b"\xfe", ANSWER) == {("LN202", "master")}


def test_what_is_left_of_a_write_that_may_be_repeated_is_in_place_of_its_answer() -> None:
    write = seal_rtu(bytes.fromhex("030600030005"))
    other = seal_rtu(bytes.fromhex("050300000001")), seal_rtu(bytes.fromhex("0503020007"))
    session = Session("x", LINE, "modbus-rtu", adapter=Adapter())
    now, chunks = 10**9, []
    for turn in range(24):
        left = ((b"\x03", 25), (write, 190)) if turn % 8 == 0 else ()
        said = (POLL, 40), (ANSWER, 25), (other[0], 40), (other[1], 25), (write, 40), *left, (write, 25)
        for octets, gap in said:
            now += gap * MS
            chunks.append(Chunk(now, octets))
    judging = Judging(session, dissector_for(session))
    for output in outputs(chunks, session):
        assert isinstance(output, Output)
        judging.add(output)
    assert [one.subject for one in judging.findings() if one.code == "LN203"] == ["station 3"]
