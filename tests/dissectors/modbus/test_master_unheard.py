"""A tap that hears the stations alone, as on one pair of a four-wire line: a confirmed write looks like a request."""

from __future__ import annotations

from tests.dissectors.modbus.judged import findings_of, graves_of


def test_answers_alone_accuse_no_station(paper_bus):
    bus = paper_bus()
    for value in range(12):
        for said in (f"0103020{value:x}07", f"020600050{value:03x}", "021000050002", "05010117", f"0503020{value:x}01"):
            bus.say(said)
    assert graves_of(bus) == {("MB207", "bus")}
    assert any((one.code, one.cause) == ("MB010", ("MB207", "bus")) for one in findings_of(bus))


def test_an_unfit_answer_stays_the_stations_where_some_requests_are_missed(paper_bus):
    bus = paper_bus()
    for value in range(12):
        bus.exchange("010300100001", f"0103020{value:x}07").exchange("020300000002", "0203020007")
        if value % 4 == 0:
            bus.say("0503020001")
    assert {("MB010", "station 2")} <= graves_of(bus)
