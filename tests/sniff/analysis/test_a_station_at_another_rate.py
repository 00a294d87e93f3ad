"""One station that sends at another rate, on lines of text: whose octets they are, and what they are not."""

from __future__ import annotations

import pytest

from dissectors.frame import Chunk
from dissectors.line import LineSettings
from dissectors.modbus.envelope import seal_ascii
from dissectors.n2.envelope import make_answer, make_command
from sniff.engine.session import Adapter, Session
from sniff.simulation.collision import low_times, receive
from tests.faults.judged import findings_of

MS = 1_000_000
EXACT = Adapter("exact", "", 0, "measured")


class Line:
    """Frames one behind the other, some of them sent at another rate."""

    def __init__(self, line: str) -> None:
        self.line = LineSettings.parse(line)
        self.now, self.chunks = 500 * MS, list[Chunk]()

    def say(self, octets: bytes, gap: float, rate: int | None = None) -> Line:
        start = self.now + int(gap * MS)
        sent = LineSettings(rate or self.line.baud, self.line.data_bits, self.line.parity, self.line.stop_bits)
        heard = receive(self.line, low_times(sent, start, octets, {}))
        self.now = start + sent.char * len(octets)
        self.chunks += [Chunk(end, heard.octets[at : at + 1]) for at, end in enumerate(heard.ends)]
        return self

    def findings(self, protocol: str) -> dict[str, str]:
        found = findings_of(Session("x", self.line, protocol, adapter=EXACT), self.chunks)
        return {one.code: f"{one.subject}: {one.seen} [{one.means}]" for one in found}


@pytest.mark.parametrize("rate", [2400, 4800])
def test_seven_bits_are_right_where_text_is_spoken(rate: int) -> None:
    bus = Line("9600,7E1")
    for turn in range(10):
        bus.say(seal_ascii(bytes((2, 3, 0, 0, 0, 1))), 80).say(seal_ascii(bytes((2, 3, 2, 0, turn))), 20)
        bus.say(seal_ascii(bytes((1, 3, 0, 0, 0, 2))), 80).say(seal_ascii(bytes((1, 3, 4, 0, turn, 0, 5))), 20, rate)
        bus.now += 100 * MS
    said = bus.findings("modbus-ascii")
    assert "LN003" not in said
    assert any(text.startswith("station 1: 10") for text in said.values())


def test_a_follower_of_n2_at_another_rate_is_named() -> None:
    bus = Line("9600,8N1")
    for turn in range(10):
        for address in (1, 2):
            bus.say(make_command(f"{address:02X}4"), 80).say(make_answer(), 20)
        bus.say(make_command("034"), 80).say(make_answer(f"F{turn:04X}"), 20, 4800)
        bus.now += 100 * MS
    said = bus.findings("n2")["LN204"]
    assert "about 4800 Bd" in said
    assert said.startswith("station 3: ")
    assert "10 of them in place of its answers" in said
