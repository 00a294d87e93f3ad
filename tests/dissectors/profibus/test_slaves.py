"""What is counted of each slave, how long it may take by its GSD, and what Clear and a claim to a slave need."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from dissectors.findings import Finding, Severity
from dissectors.frame import Chunk
from dissectors.line import LineSettings, Timing
from dissectors.profibus import PROFIBUS
from dissectors.profibus.findings import ProfibusFindings
from dissectors.profibus.ring import SlaveCounts
from dissectors.profibus.slave_state import SlaveState
from dissectors.profibus.telegram import BROADCAST, SC, telegram
from sniff.engine.engine import Engine, Output

LINE = LineSettings.parse("187500,8E1")
MS = 1_000_000
Telegrams = Sequence[tuple[int, bytes]]
"""ms of silence before each, and its octets."""


def judged(telegrams: Telegrams, judge: ProfibusFindings | None = None) -> ProfibusFindings:
    judge = judge or ProfibusFindings(Timing(LINE))
    engine, now = Engine(PROFIBUS, Timing(LINE)), 10**12

    def take(output: Output) -> None:
        for row in output.rows:
            judge.see(row.no, row.event, row.header, row.placement)
        for transaction in output.transactions:
            judge.settle(transaction)

    for silence, octets in telegrams:
        now += silence * MS + len(octets) * LINE.char
        take(engine.feed(Chunk(now, octets)))
    take(engine.close())
    return judge


def found(judge: ProfibusFindings, code: str) -> Finding | None:
    return next((one for one in judge.findings() if one.code == code), None)


def diagnosis(by: int = 1, owner: int = 255, first: int = 0x02, second: int = 0x05) -> list[tuple[int, bytes]]:
    data = bytes((first, second, 0, owner, 0xF5, 0x10))
    return [(1, telegram(5, by, 0x6D, dsap=60, ssap=62)), (1, telegram(by, 5, 0x08, data, 62, 60))]


def parameters(by: int = 1) -> list[tuple[int, bytes]]:
    return [(1, telegram(5, by, 0x5D, bytes((0x88, 100, 1, 11, 0xF5, 0x10, 0)), 61, 62)), (1, bytes((SC,)))]


def exchange(fcb: int, outputs: bytes = b"\0", wait: int = 1, by: int = 1) -> list[tuple[int, bytes]]:
    return [(wait, telegram(5, by, 0x5D | fcb << 5, outputs)), (1, telegram(by, 5, 0x08, b"\7"))]


def exchanges(count: int, outputs: bytes = b"\0", wait: int = 1) -> list[tuple[int, bytes]]:
    return [one for at in range(count) for one in exchange(at % 2, outputs, wait)]


def test_rubbish_in_the_place_of_an_answer_shows_no_station() -> None:
    asked = [(2, telegram(9, 1, 0x6D, dsap=60 - at % 2, ssap=62)) for at in range(6)]
    judge = judged([*exchanges(2), *asked[:3], (1, b"\xfe\x00\xf8"), *asked[3:], *exchanges(2)])
    silent = found(judge, "PB001")
    assert silent is not None
    assert silent.severity is Severity.ERROR
    assert found(judge, "PB002") is None


def test_who_answers_each_repeat_is_asked_too_soon() -> None:
    """The slot time is shorter than the way to it; lost requests are not so regular."""
    late = [one for at in range(12) for one in (exchange(at % 2)[0], *exchange(at % 2))]
    told = found(judged([*exchanges(1), *late]), "PB002")
    assert told is not None
    assert "slot time" in told.means
    lossy = [one for at in range(40) for one in (*exchange(at % 2)[: 1 + at % 2], *exchange(at % 2)[at % 2 * 2 :])]
    told = found(judged(lossy), "PB002")
    assert told is not None
    assert "slot time" not in told.means


def test_what_the_line_gives_back_is_no_repeat() -> None:
    answer = exchange(0)[1]
    echoed = [one for at in range(12) for one in (exchange(at % 2)[0], (0, exchange(at % 2)[0][1]), answer)]
    judge = judged([*exchanges(2), *echoed])
    assert found(judge, "PB002") is None
    assert judge.watch.slaves[5].counts.repeats == 0


def test_repeats_of_a_quarter_of_an_hour_are_no_chance_of_the_night() -> None:
    judge = judged([*exchanges(3), *exchange(1, wait=8 * 3_600_000)])
    record = judge.records[5]
    record.requests, record.answers = 30_000, 30_000
    for at in range(60):
        record.repeated.add(10**12 + at * 10**10)
    told = found(judge, "PB003")
    assert told is not None
    assert told.severity is Severity.WARNING
    assert "within a quarter of an hour" in told.seen


def test_counts_as_bus_monitors_have_them() -> None:
    lost = [(1, telegram(5, 1, 0x5D, b"\0"))] * 2 + [(1, telegram(5, 1, 0x6D, dsap=60, ssap=62))]
    spoilt = bytearray(telegram(1, 5, 0x08, b"\7"))
    spoilt[-2] ^= 0xFF
    illegal = [(1, telegram(5, 1, 0x5D, b"\0")), (1, bytes(spoilt))]
    refused = [(1, telegram(5, 1, 0x7D, b"\0")), (1, telegram(1, 5, 0x02))]
    judge = judged([*diagnosis(), *exchanges(4), *illegal, *refused, *lost])
    slave = judge.ring().slaves[5]
    assert slave.counts == SlaveCounts(1, 2, 1, 1, 1, 1, 1, 0)
    assert slave.exchanges == 4
    assert slave.cycle.count == 5  # not across the damage


def test_the_gsd_says_how_long_a_slave_may_take() -> None:
    slow = [one for at in range(10) for one in exchange(at % 2)]  # 1 ms: 187 bit times
    assert found(judged(slow), "PB018") is not None
    judge = ProfibusFindings(Timing(LINE))
    judge.know_response_times({5: 2 * MS}.get)
    assert found(judged(slow, judge), "PB018") is None


def clear(is_clear: bool = True) -> tuple[int, bytes]:
    return 1, telegram(BROADCAST, 1, 0x46, bytes((2 if is_clear else 0, 0)), 58, 62)


def test_clear_is_told_once_it_lasts() -> None:
    short = [clear(), *exchanges(20, wait=100), clear(is_clear=False)]
    assert found(judged([*short, *exchanges(100, b"\1", wait=100), *short]), "PB012") is None
    told = found(judged([clear(), *exchanges(60, wait=100)]), "PB012")
    assert told is not None
    assert told.severity is Severity.WARNING


def test_outputs_that_are_not_zero_end_clear_whose_end_was_not_heard() -> None:
    assert found(judged([clear(), *exchanges(20, wait=100), *exchanges(60, b"\1", wait=100)]), "PB012") is None


def test_damage_since_leaves_clear_open() -> None:
    told = found(judged([clear(), (1, b"\x55\x55\x55"), *exchanges(60, wait=100)]), "PB012")
    assert told is not None
    assert told.severity is Severity.NOTE


def test_who_only_reads_a_diagnosis_claims_no_slave() -> None:
    mine = [*diagnosis(), *parameters(), *diagnosis(owner=1, second=0x0C, first=0), *exchanges(4)]
    assert found(judged([*mine, *diagnosis(by=3, owner=1, first=0, second=0x0C)]), "PB011") is None
    claimed = [*mine, *parameters(by=3), *diagnosis(by=3, owner=1, first=0, second=0x0C)]
    assert found(judged(claimed), "PB011") is not None


def test_a_slave_whose_master_was_silent_did_not_drop_out_by_itself() -> None:
    came_up = [*diagnosis(), *parameters(), *diagnosis(owner=1, second=0x0C, first=0), *exchanges(4)]
    gone = diagnosis()
    at_once = found(judged([*came_up, *gone]), "PB007")
    assert at_once is not None
    assert at_once.severity is Severity.WARNING
    late = found(judged([*came_up, (1_500, gone[0][1]), gone[1]]), "PB007")
    assert late is not None
    assert late.severity is Severity.NOTE
    unknown = found(judged([*exchanges(4), (1_500, gone[0][1]), gone[1]]), "PB007")  # its watchdog was not heard
    assert unknown is not None
    assert unknown.severity is Severity.NOTE


@pytest.mark.parametrize(("first", "master_is_named"), [(0x84, True), (0x04, False)])
def test_a_master_is_late_for_a_watchdog_by_its_longest_reading(first: int, master_is_named: bool) -> None:
    """Bit 2 of the first octet of user parameters is 1 ms a step only with a slave of DP-V1; else the maker's."""
    short = (telegram(5, 1, 0x5D, bytes((0x88, 50, 1, 11, 0xF5, 0x10, 0, first, 0, 0)), 61, 62), bytes((SC,)))
    came_up = [*diagnosis(), *((1, one) for one in short), *exchanges(6)]
    left = [(100, telegram(5, 1, 0x7D, b"\0")), (1, telegram(1, 5, 0x03))]
    judge = judged([*came_up, *left, *exchanges(1)])
    assert (found(judge, "PB019") is not None) == master_is_named
    fallen = found(judge, "PB007")
    assert fallen is None or fallen.severity is Severity.NOTE


def test_one_request_and_its_repeats_prove_no_absent_station() -> None:
    once = [(1, telegram(9, 1, 0x6D, dsap=60, ssap=62))] * 3
    looked = found(judged([*once, *exchanges(2)]), "PB001")
    assert looked is not None
    assert looked.severity is Severity.NOTE
    again = found(judged([*once, *exchanges(2), *once, *exchanges(2)]), "PB001")
    assert again is not None
    assert again.severity is Severity.ERROR


def test_a_slave_is_offline_after_four_requests_that_nothing_answers() -> None:
    lost = [(1, telegram(5, 1, 0x5D, b"\0"))]
    for count, state in ((3, SlaveState.EXCHANGE), (4, SlaveState.OFFLINE), (9, SlaveState.OFFLINE)):
        judge = judged([*exchanges(4), *lost * count, (1, telegram(9, 1, 0x6D, dsap=60, ssap=62))])
        assert judge.ring().slaves[5].state is state, count
    back = judged([*exchanges(4), *lost * 4, *exchanges(1)])
    assert back.ring().slaves[5].state is SlaveState.EXCHANGE


def test_a_poll_before_a_long_silence_took_no_more_than_its_slot() -> None:
    """Who polls waits for a slot time, 87 ms at most at this rate; an hour of silence behind it is nobody's poll."""
    poll = telegram(9, 1, 0x49)
    ring = judged([*exchanges(2), (1, poll), *exchanges(2, wait=3_600_000)]).ring()
    assert ring.wasted == LINE.bits(16_383)
    assert 80 * MS < ring.wasted < 90 * MS


def test_a_watchdog_of_no_time_is_none_that_a_master_can_be_late_for() -> None:
    none = [(1, telegram(5, 1, 0x5D, bytes((0x88, 0, 1, 11, 0xF5, 0x10, 0)), 61, 62)), (1, bytes((SC,)))]
    left = [(1, telegram(5, 1, 0x7D, b"\0")), (1, telegram(1, 5, 0x03))]
    judge = judged([*diagnosis(), *none, *exchanges(6), *left])
    assert found(judge, "PB019") is None
    assert found(judge, "PB007") is not None
