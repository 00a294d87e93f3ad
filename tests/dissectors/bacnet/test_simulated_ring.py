"""Rings of simulated nodes: a clean one raises nothing, each fault its finding; tracker and ring model agree."""

from __future__ import annotations

from dataclasses import replace

import pytest

from dissectors.bacnet.findings import judge
from dissectors.bacnet.ring import Ring
from dissectors.bacnet.ring_events import RingEventKind
from dissectors.bacnet.ring_observer import MstpRingObserver
from dissectors.bacnet.simulated import Device, Faults, Poller, SimulatedNode, f510
from dissectors.findings import Severity
from dissectors.frame import Frame
from dissectors.line import LineSettings, Timing
from dissectors.tracker import Verdict
from tests.dissectors.bacnet.ring_bus import MS, TIMING, Heard, S, run

POLLED = [(5, "analog-input,4", "present-value"), (5, "device,510", "model-name"), (9, "binary-input,0", "object-name")]


def ring(timing: Timing = TIMING, faults: dict[int, Faults] | None = None, **more: object) -> list[SimulatedNode]:
    """Four masters: 2 reads, 5 and 9 are drives, 20 is quiet."""
    faults = faults or {}
    applications = {2: Poller(POLLED, every=300 * MS), 5: f510(510), 9: f510(511), 20: None}
    return [
        SimulatedNode(mac, timing, application, max_master=24, faults=faults.get(mac), **more)  # type: ignore[arg-type]
        for mac, application in applications.items()
    ]


def switch(node: SimulatedNode, faults: Faults):
    def change() -> None:
        node.faults = faults

    return change


@pytest.fixture(scope="module")
def clean() -> Heard:
    return run(ring(), 20)


def test_a_clean_ring_of_four_masters_raises_nothing_in_minutes():
    line = LineSettings(9600)
    timing = Timing(line)
    nodes = ring(timing)
    for node in nodes:
        node.faults = Faults(use_delay=3 * MS)
    heard = run(nodes, 180, line=line, keep=False)
    assert heard.ring.frames > 6_000
    assert heard.findings == ()
    assert heard.ring.order == (2, 5, 9, 20)
    assert heard.ring.happened == {}


def test_what_the_model_says_of_a_clean_ring(clean: Heard):
    found = clean.ring
    assert found.order == (2, 5, 9, 20)
    assert found.masters == (2, 5, 9, 20)
    assert all(isinstance(e, Frame) and e.ok for e in clean.events)
    assert found.nodes[5].devices == (510,)
    assert found.nodes[20].highest_polled == 24
    assert found.nodes[2].requests_sent == found.nodes[5].replies + found.nodes[9].replies > 30
    assert found.nodes[2].most_in_a_hold == 1
    turnaround = TIMING.line.bits(40)
    use = found.nodes[9].use
    assert use.least == pytest.approx(turnaround, abs=1000)
    loop = found.nodes[9].loop.quantile(0.5)
    assert found.predicted_loop is not None
    assert loop == pytest.approx(found.predicted_loop, rel=0.2)
    slow_adapter = replace(found, timing=replace(TIMING, latency=20_000_000))
    assert slow_adapter.predicted_loop == 4 * (8 * TIMING.char + turnaround)  # its use times say nothing
    assert found.poll_waste_share == pytest.approx(
        sum(
            clean.events[no + 1].start - event.start
            for no, event in enumerate(clean.events[:-1])
            if event.octets[2] == 1 and clean.events[no + 1].octets[2] != 2
        )
        / found.span,
        rel=1e-6,
    )
    assert any("Max_Master 20 would do" in words for words in found.advice())


def test_the_tracker_on_a_clean_ring(clean: Heard):
    verdicts = {(t.kind, t.verdict) for t in clean.transactions if t.verdict is not Verdict.OPEN}
    assert verdicts == {
        ("token", Verdict.DATA),
        ("poll-for-master", Verdict.DATA),
        ("poll-for-master", Verdict.ANSWERED),
        ("read-property", Verdict.ANSWERED),
        ("i-am", Verdict.BROADCAST),
    }
    ids = sorted(t.id for t in clean.transactions)
    assert ids == list(range(1, len(ids) + 1))
    frames = [t.request for t in clean.transactions] + [t.response for t in clean.transactions if t.response]
    assert sorted(n for n in frames if n is not None) == list(range(len(clean.events)))


def test_a_lost_token_names_the_holder_and_who_began_anew():
    heard = run(ring(faults={9: Faults(loses_token_every=200)}), 20)
    finding = heard.finding("MS101")
    assert finding.severity is Severity.ERROR
    assert finding.subject == "MAC 9"
    assert "begun anew by MAC 2" in finding.seen
    lost = heard.ring.of(RingEventKind.LOST_TOKEN, 9)
    assert lost.count >= 2
    assert all(event.value is not None and event.value >= 500 * MS for event in lost.events)
    for event in lost.events:
        assert heard.events[event.no].start == event.time
    assert "MS104" not in heard.codes


def test_a_station_that_is_switched_off_leaves_and_comes_back():
    nodes = ring()
    off = run(nodes, 12, after=[(6, switch(nodes[2], Faults(off=True)))])
    assert off.finding("MS106").subject == "MAC 9"
    assert off.finding("MS102").subject == "5 → 9"
    assert off.ring.order == (2, 5, 20)
    nodes = ring()
    back = run(nodes, 20, after=[(6, switch(nodes[2], Faults(off=True))), (9, switch(nodes[2], Faults()))])
    assert back.finding("MS105").subject == "5 → 9"
    assert "MS106" not in back.codes
    assert back.ring.order == (2, 5, 9, 20)


def test_a_deaf_station():
    nodes = ring()
    heard = run(nodes, 15, after=[(6, switch(nodes[2], Faults(deaf=True)))])
    assert heard.finding("MS102").subject == "5 → 9"
    assert heard.ring.edges[5, 9].retries >= 1
    assert {"MS104", "MS106", "MS501"} & heard.codes  # it believes the bus silent and begins to talk into it


def test_two_stations_with_one_address():
    nodes = [*ring(), SimulatedNode(9, TIMING, f510(777), max_master=24, faults=Faults(use_delay=4 * MS))]
    heard = run(nodes, 30)
    finding = heard.finding("MS501")
    assert (finding.subject, finding.severity) == ("MAC 9", Severity.ERROR)
    assert "before its own poll could be answered" in finding.seen
    assert all(heard.headers[no].source == 9 for no in finding.evidence)


def test_another_device_in_its_place_is_only_noted():
    """The first one is off for good when the other begins: it may have been replaced."""
    nodes = [*ring(), SimulatedNode(9, TIMING, f510(777), max_master=24, faults=Faults(off=True))]
    heard = run(
        nodes,
        20,
        after=[(6, switch(nodes[2], Faults(off=True))), (8, switch(nodes[4], Faults()))],
    )
    finding = heard.finding("MS501")
    assert finding.severity is Severity.NOTE
    assert "511, 777" in finding.seen


def test_two_stations_seen_by_their_device_instances_in_turns():
    """Each says who it is when it is switched on."""
    nodes = [*ring(), SimulatedNode(9, TIMING, f510(777), max_master=24, faults=Faults(off=True))]
    again = SimulatedNode(9, TIMING, f510(511), max_master=24, faults=Faults(off=True))
    heard = run(
        [*nodes, again],
        30,
        after=[
            (6, switch(nodes[2], Faults(off=True))),
            (8, switch(nodes[4], Faults())),
            (14, switch(nodes[4], Faults(off=True))),
            (16, switch(again, Faults())),
        ],
    )
    finding = heard.finding("MS501")
    assert finding.severity is Severity.ERROR
    assert "511, 777" in finding.seen


def test_slow_to_use_the_token():
    heard = run(ring(faults={20: Faults(use_delay=18 * MS)}), 15)
    finding = heard.finding("MS103")
    assert finding.subject == "MAC 20"
    assert "MS102" not in heard.codes


def test_a_late_answer_before_and_after_the_asker_gave_up():
    heard = run(ring(faults={5: Faults(reply_delay=252 * MS)}), 15)
    assert heard.finding("MS302").subject == "2 → 5"
    assert "MS301" not in heard.codes
    assert any(t.verdict is Verdict.ANSWERED and t.latency.nominal > 250 * MS for t in heard.transactions if t.latency)
    heard = run(ring(faults={5: Faults(reply_delay=330 * MS)}), 15)
    assert {"MS301", "MS302"} & heard.codes


def test_no_answer():
    heard = run(ring(faults={5: Faults(silent=True)}), 15)
    finding = heard.finding("MS301")
    assert finding.subject == "2 → 5"
    silent = [t for t in heard.transactions if t.verdict is Verdict.NO_RESPONSE]
    assert {t.station for t in silent} == {5}
    assert finding.count == len(silent)
    assert "MS101" not in heard.codes


def test_postponed_replies_and_the_real_answers():
    heard = run(ring(faults={5: Faults(postpones=True)}), 20)
    finding = heard.finding("MS303")
    assert finding.subject == "MAC 5"
    node = heard.ring.nodes[5]
    assert node.service.count == node.postponed > 5
    late = [t for t in heard.transactions if t.station == 5 and t.kind == "read-property"]
    assert {t.verdict for t in late} <= {Verdict.ANSWERED, Verdict.OPEN}
    for transaction in late[:5]:
        assert transaction.request is not None
        assert transaction.response is not None
        assert heard.headers[transaction.request + 1].kind == "reply-postponed"
        assert transaction.response > transaction.request + 1


def test_a_second_token():
    heard = run(ring(faults={9: Faults(forges_every=3)}), 15)
    finding = heard.finding("MS104")
    assert "9" in finding.seen
    assert finding.count >= 2


def test_too_many_polls():
    heard = run(ring(polls_every=4), 15)
    told = [finding for finding in heard.findings if finding.code == "MS201"]
    assert [(one.subject, one.severity) for one in told if one.cause is None] == [("bus", Severity.WARNING)]
    assert {one.subject for one in told if one.cause == ("MS201", "bus")} == {"MAC 2", "MAC 5", "MAC 9", "MAC 20"}
    assert all("one in 50 is usual" in one.seen for one in told)


def test_one_station_that_polls_too_often_is_named():
    nodes = ring()
    nodes[1] = SimulatedNode(5, TIMING, f510(510), max_master=24, polls_every=4)
    finding = run(nodes, 15).finding("MS201")
    assert (finding.subject, finding.severity, finding.cause) == ("MAC 5", Severity.WARNING, None)


def test_damaged_frames():
    heard = run(ring(faults={5: Faults(damages_every=40)}), 20)
    assert heard.finding("MS401").subject == "bus"
    assert heard.ring.header_errors + heard.ring.data_errors >= 3


def test_a_station_alone():
    heard = run([SimulatedNode(3, TIMING)], 15)
    assert heard.codes == {"MS109"}
    assert heard.finding("MS109").subject == "MAC 3"


def test_what_the_adapter_hides_is_not_judged():
    heard = run(ring(faults={20: Faults(use_delay=18 * MS)}), 10, latency=17 * MS)
    assert not heard.ring.measurable(15 * MS)
    assert heard.ring.limits["token use"] is False
    assert heard.ring.limits["reply"] is True
    assert "MS103" not in heard.codes


def test_two_halves_add_up(clean: Heard):
    cut = len(clean.events) // 2
    halves = []
    for part in (range(cut), range(cut, len(clean.events))):
        observer = MstpRingObserver(TIMING)
        for no in part:
            observer.see(no, clean.events[no], clean.headers[no])
        halves.append(observer.ring())
    both = halves[0].merge(halves[1])
    whole = clean.ring
    assert (both.frames, both.octets, both.first, both.last) == (whole.frames, whole.octets, whole.first, whole.last)
    assert both.order == whole.order
    for mac, node in whole.nodes.items():
        assert both.nodes[mac].tokens_sent == node.tokens_sent
        assert abs(both.nodes[mac].use.count - node.use.count) <= 1
        assert both.nodes[mac].use.most == node.use.most
    assert judge(both) == judge(whole) == ()
    assert Ring().merge(whole) == whole.merge(Ring())


def test_memory_of_the_model_does_not_grow():
    heard = run(ring(faults={9: Faults(loses_token_every=10), 5: Faults(damages_every=7)}), 60, keep=False)
    assert sum(happened.count for happened in heard.ring.happened.values()) > 64
    assert all(len(happened.events) <= 32 for happened in heard.ring.happened.values())
    assert all(len(node.use.buckets) < 800 for node in heard.ring.nodes.values())


def test_the_drive_answers_as_documented():
    from dissectors.bacnet import apdu as apdus
    from dissectors.bacnet import codec, npdu, services
    from dissectors.bacnet.application import confirmed, read_property

    drive = f510(510)

    def ask(octets: bytes):
        answer = drive.answer(2, octets)
        assert answer is not None
        body = answer[npdu.decode(answer).body :]
        apdu = apdus.decode(body)
        return apdu, codec.decode(services.parameters(apdu.type, apdu.service or 0), body[apdu.body :]).record

    apdu, values = ask(read_property(1, "device,510", "vendor-identifier"))
    assert values["property-value"] == 461
    apdu, values = ask(read_property(2, "analog-input,4", "units"))
    assert str(values["property-value"]) == "hertz"
    apdu, values = ask(read_property(3, "analog-input,4", "reliability"))
    assert (apdu.type, str(values["error-code"])) == (5, "unknown-property")
    apdu, values = ask(read_property(4, "analog-input,99", "present-value"))
    assert (apdu.type, str(values["error-class"]), str(values["error-code"])) == (5, "object", "unknown-object")
    write = {"object-identifier": "analog-output,0", "property-identifier": "present-value"}
    apdu, _ = ask(confirmed(5, 15, {**write, "property-value": 42.5}))
    assert apdu.type == 2
    apdu, values = ask(confirmed(6, 15, {**write, "property-value": 999.0}))
    assert str(values["error-code"]) == "value-out-of-range"
    apdu, values = ask(confirmed(7, 15, {**write, "object-identifier": "analog-input,0", "property-value": 1.0}))
    assert str(values["error-code"]) == "write-access-denied"
    apdu, values = ask(read_property(8, "analog-output,0", "present-value"))
    assert values["property-value"] == 42.5
    spec = {
        "object-identifier": "analog-input,4",
        "list-of-property-references": [{"property-identifier": "present-value"}, {"property-identifier": "priority"}],
    }
    apdu, values = ask(confirmed(9, 14, {"list-of-read-access-specs": [spec]}))
    results = values["list-of-read-access-results"][0]["list-of-results"]
    assert [next(iter(r["read-result"]))[0] for r in results] == ["property-value", "property-access-error"]
    apdu, _ = ask(confirmed(10, 5, {"subscriber-process-identifier": 1, "monitored-object-identifier": "device,1"}))
    assert (apdu.type, apdu.reason) == (6, 9)
    who_is = npdu.encode(apdus.encode(1, service=8), dnet=0xFFFF)
    (i_am,) = drive.hear(2, who_is)
    assert i_am.destination == 255
    assert isinstance(drive, Device)
    assert len(drive.objects) == 16 + 31 + 3 + 10 + 3 + 2 + 1
    assert S == 10**9
