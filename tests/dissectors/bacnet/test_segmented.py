"""Messages in segments: one exchange, one verdict, and the whole where the last segment is; lost, repeated, refused."""

from __future__ import annotations

import random
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dissectors.bacnet import MSTP
from dissectors.bacnet import apdu as apdus
from dissectors.bacnet.apdu import SEGMENTED_ACCEPTED, SERVER, Apdu
from dissectors.bacnet.envelope import frame
from dissectors.bacnet.frame_types import CARRIES_NPDU
from dissectors.bacnet.npdu import EXPECTS_REPLY
from dissectors.bacnet.readings import readings
from dissectors.bacnet.reassembly import OCTETS_MAX, OPEN_MAX, Reassembler
from dissectors.findings import Finding
from dissectors.frame import Assembly, Chunk, Frame, Role
from dissectors.tracker import Transaction, Verdict
from sniff.analysis.packet_tree import fields_of
from sniff.analysis.wording import describe
from sniff.engine.engine import Output, Row
from tests.dissectors.bacnet.segmented_bus import (
    LINE,
    READ_MULTIPLE,
    SESSION,
    WRITE_MULTIPLE,
    Party,
    SegmentedBus,
    Step,
    doubled,
    reads,
    results,
    run,
    spoilt,
    without,
    writes,
)
from tests.seeds import examples

INVOKE = 33
SIZE = 50


def answered(count: int = 12, window: int = 2, **parties: Party) -> SegmentedBus:
    """Values read, answered in segments: 12 values are four segments, the last of them number 3."""
    bus = SegmentedBus(**parties)
    bus.rounds(1)
    bus.ask(INVOKE, READ_MULTIPLE, reads(count))
    bus.answer_in_segments(INVOKE, READ_MULTIPLE, results(count), SIZE, window)
    bus.rounds(1)
    return bus


def written(count: int = 12, window: int = 2, **parties: Party) -> SegmentedBus:
    """Values written in segments, acknowledged as a whole."""
    bus = SegmentedBus(**parties)
    bus.rounds(1)
    bus.ask_in_segments(INVOKE, WRITE_MULTIPLE, writes(count), SIZE, window)
    bus.reply(INVOKE, WRITE_MULTIPLE)
    bus.rounds(1)
    return bus


def exchanges(output: Output) -> list[Transaction]:
    """All but tokens, in the order of opening."""
    return sorted((one for one in output.transactions if not one.is_passing), key=lambda one: one.id)


def row(output: Output, no: int | None) -> Row:
    return next(row for row in output.rows if row.no == no)


def assembly(output: Output, no: int | None) -> Assembly:
    event = row(output, no).event
    assert isinstance(event, Frame)
    assert event.assembly is not None
    return event.assembly


def whole_answer(count: int = 12, first: float = 0.5) -> bytes:
    return apdus.encode(3, results(count, first), invoke_id=INVOKE, service=READ_MULTIPLE)


def told(output: Output, one: Transaction) -> list[float]:
    """The values that the exchange tells."""
    asked, answer = row(output, one.request).event, row(output, one.response).event
    assert isinstance(asked, Frame)
    assert isinstance(answer, Frame)
    return [float(reading.value) for reading in readings(asked, answer)]


def is_clean(output: Output) -> Transaction:
    """One exchange, answered; nothing else happened."""
    (one,) = exchanges(output)
    assert one.verdict is Verdict.ANSWERED
    assert one.of is None
    assert {row.placement.tx for row in output.rows if row.header and row.header.function in CARRIES_NPDU} == {one.id}  # type: ignore[union-attr]
    return one


@pytest.mark.parametrize("window", range(1, 9))
@pytest.mark.parametrize("count", [6, 12, 13, 30, 60])
def test_an_answer_in_segments_is_one_answer(count: int, window: int):
    output = run(answered(count, window).steps)
    one = is_clean(output)
    assert found_by_rules(output) == ()
    assert assembly(output, one.response).octets == whole_answer(count)
    assert told(output, one) == [number + 0.5 for number in range(count)]


def test_segments_may_be_extended_frames():
    bus = SegmentedBus()
    bus.ask(INVOKE, READ_MULTIPLE, reads(90))
    bus.answer_in_segments(INVOKE, READ_MULTIPLE, results(90), 700, 2)
    output = run(bus.steps)
    assert assembly(output, exchanges(output)[0].response).octets == whole_answer(90)
    assert {row.header.function for row in output.rows if row.header} >= {32, 33}


@pytest.mark.parametrize("window", range(1, 9))
@pytest.mark.parametrize("count", [6, 12, 13, 30, 60])
def test_a_request_in_segments_is_one_request(count: int, window: int):
    output = run(written(count, window).steps)
    one = is_clean(output)
    assert found_by_rules(output) == ()
    assert one.response is not None
    expected = apdus.encode(
        0, writes(count), invoke_id=INVOKE, service=WRITE_MULTIPLE, flags=SEGMENTED_ACCEPTED, max_segments=7
    )
    assert assembly(output, one.request).octets == expected
    assert told(output, one) == [float(number) for number in range(count)]


@pytest.mark.parametrize("postponed", [True, False])
def test_a_segment_within_a_window_need_not_be_acknowledged(postponed: bool):
    """All segments expect a reply by their frame type; within a window a Reply Postponed comes, or nothing."""
    bus, made = written(12, 3), SegmentedBus()
    for step, following in pairwise(bus.steps):
        if not step.name.startswith("request"):
            made.steps.append(step)
            continue
        made.say(step.name, frame(5, 5, 1, step.octets[8:-2]), 3.0)
        if following.name.startswith("ack"):
            continue
        if postponed:
            made.say("postponed", frame(7, 1, 5), 240.0)
        else:
            made.say("token", frame(0, 5, 1), 260.0)
            made.say("token", frame(0, 1, 5))
    output = run(made.steps)
    (one,) = exchanges(output)
    assert one.verdict is Verdict.ANSWERED
    assert told(output, one) == [float(number) for number in range(12)]
    assert found_by_rules(output) == ()


@pytest.mark.parametrize("postponed", [True, False])
@pytest.mark.parametrize("names", [("segment",), ("ack",), ("segment", "ack")])
def test_segments_and_acknowledgements_may_expect_a_reply(names: tuple[str, ...], postponed: bool):
    """Sent as Data Expecting Reply when the station has the token; a Reply Postponed comes at once, or nothing."""
    made = SegmentedBus()
    for step in answered(12, 2).steps:
        if step.name.startswith(names) and step.name != "segment 0":
            source, destination = step.octets[4], step.octets[3]
            data = step.octets[8:-2]
            data = data[:1] + bytes((data[1] | EXPECTS_REPLY,)) + data[2:]
            made.say(step.name, frame(5, destination, source, data), step.silence)
            if postponed:
                made.say("postponed", frame(7, source, destination), 200.0)
        else:
            made.steps.append(step)
    output = run(made.steps)
    (one,) = exchanges(output)
    assert one.verdict is Verdict.ANSWERED
    assert told(output, one) == [number + 0.5 for number in range(12)]
    assert found_by_rules(output) == ()


def found_by_rules(output: Output) -> tuple[Finding, ...]:
    findings = MSTP.judge(SESSION.timing)
    for row in output.rows:
        findings.see(row.no, row.event, row.header, row.placement)
    for one in output.transactions:
        findings.settle(one)
    return tuple(findings.findings())


def test_request_and_answer_may_both_be_segmented():
    bus = SegmentedBus()
    bus.ask_in_segments(INVOKE, READ_MULTIPLE, reads(40), SIZE, 3)
    bus.turn(bus.server.mac)
    bus.answer_in_segments(INVOKE, READ_MULTIPLE, results(40), SIZE, 3)
    output = run(bus.steps)
    assert told(output, is_clean(output)) == [number + 0.5 for number in range(40)]


BEHIND = {"client": Party(1, 7, bytes((192, 168, 1, 20, 0xBA, 0xC0))), "server": Party(5, 13, b"\x3d")}


@pytest.mark.parametrize("behind", [("client",), ("server",), ("client", "server")])
def test_stations_behind_routers_are_told_apart(behind: tuple[str, ...]):
    parties = {name: BEHIND[name] for name in behind}
    output = run(answered(**parties).steps)
    assert assembly(output, is_clean(output).response).octets == whole_answer()
    output = run(written(**parties).steps)
    assert assembly(output, is_clean(output).request).complete


def test_several_at_once_are_kept_apart():
    """The same invoke id at the same time, by two servers and by two stations behind one router."""
    buses = [
        answered(12, 2, client=Party(1), server=Party(5)),
        answered(13, 2, client=Party(1), server=Party(9)),
        answered(14, 2, client=Party(1), server=Party(5, 13, b"\x10")),
        answered(15, 2, client=Party(1), server=Party(5, 13, b"\x11")),
    ]
    lines = [[step for step in bus.steps if step.name != "token"] for bus in buses]
    mixed = [step for together in zip(*(line[1:] for line in lines), strict=False) for step in together]
    mixed += [step for line in lines for step in line[1 + len(min(lines, key=len)) - 1 :]]
    requests = [line[0] for line in lines]
    output = run([Step(one.name, 260.0, one.octets) for one in [*requests, *mixed]])
    answers = [event.assembly for event in (row.event for row in output.rows) if isinstance(event, Frame)]
    assert sorted(one.octets for one in answers if one is not None) == sorted(whole_answer(n) for n in (12, 13, 14, 15))


# What goes wrong on the way


def test_a_damaged_segment_that_comes_again_completes_the_message():
    """The third of four segments is damaged for everybody: refused from there on, sent again."""
    steps = without(answered(12, 3).steps, "token")
    bus = SegmentedBus()
    bus.acknowledge(bus.client, INVOKE, 1, 3, negative=True)
    again = [step for step in steps if step.name in ("segment 2", "segment 3")]
    at = next(number for number, step in enumerate(steps) if step.name == "ack 3")
    output = run([*spoilt(steps[:at], "segment 2"), *bus.steps, *again, *steps[at:]])
    one = next(one for one in exchanges(output) if one.request is not None and one.kind == "read-property-multiple")
    assert one.verdict is Verdict.ANSWERED
    assert assembly(output, one.response).octets == whole_answer()
    assert told(output, one) == [number + 0.5 for number in range(12)]
    holed = next(one.event.assembly for one in output.rows if isinstance(one.event, Frame) and one.event.assembly)
    assert holed == Assembly(b"", holed.frames, (2,))
    assert all(one.verdict is not Verdict.ANSWERED_TWICE for one in output.transactions)


@pytest.mark.parametrize(
    ("name", "window"),
    [("request 0", 1), ("request 1", 1), ("request 3", 1), ("request 0", 3), ("request 3", 3)],  # each expects a reply
)
def test_a_segment_that_was_acknowledged_was_damaged_for_the_sniffer_alone(name: str, window: int):
    steps = written(12, window).steps
    output = run(spoilt(steps, name))
    verdicts = {one.verdict for one in exchanges(output)}
    assert not verdicts & {Verdict.DAMAGED_REQUEST, Verdict.NO_RESPONSE, Verdict.OPEN}
    assert Verdict.ANSWERED in verdicts


def test_a_last_segment_that_was_answered_was_damaged_for_the_sniffer_alone():
    """The server answers at once, without acknowledging it."""
    bus = SegmentedBus()
    bus.rounds(1)
    bus.ask_in_segments(INVOKE, WRITE_MULTIPLE, writes(12), SIZE, 1)
    steps = bus.steps[:-1]
    bus.steps = []
    bus.reply(INVOKE, WRITE_MULTIPLE, at_once=True)
    output = run(spoilt([*steps, *bus.steps], "request 3"))
    assert [one.verdict for one in exchanges(output)] == [Verdict.ANSWERED, Verdict.DATA]


def test_a_damaged_segment_that_is_refused_was_damaged_for_the_server_too():
    """It is sent again; the exchange is answered."""
    steps = written(12, 1).steps
    at = next(number for number, step in enumerate(steps) if step.name == "request 1")
    bus = SegmentedBus()
    bus.acknowledge(bus.server, INVOKE, 0, 1, negative=True)
    output = run([*spoilt(steps[: at + 1], "request 1"), *bus.steps, *steps[at:]])
    assert [one.verdict for one in exchanges(output)] == [Verdict.ANSWERED, Verdict.DAMAGED_REQUEST]


def test_what_only_the_sniffer_missed_is_said_and_the_exchange_ends_with_the_acknowledgement():
    output = run(without(answered(12, 3).steps, "segment 2"))
    one = is_clean(output)
    assert assembly(output, one.response).missing == (2,)
    assert "segment 2 not seen" in describe(MSTP, row(output, one.response))
    assert told(output, one) == []
    tree = str(fields_of(MSTP, row(output, one.response).event, Role.RESPONSE))  # type: ignore[arg-type]
    assert "missing" in tree


@pytest.mark.parametrize("name", ["segment 0", "segment 1", "segment 3", "ack 0", "ack 3"])
@pytest.mark.parametrize("silence", [3.0, 2_500.0, 9_000.0])
def test_segments_and_acknowledgements_that_come_again_change_nothing(name: str, silence: float):
    output = run(doubled(answered(12, 3).steps, name, silence))
    one = is_clean(output)
    assert told(output, one) == [number + 0.5 for number in range(12)]


@pytest.mark.parametrize("name", ["request 1", "request 3", "request 4", "ack 0", "ack 4"])
def test_segments_of_a_request_that_come_again_change_nothing(name: str):
    output = run(doubled(written(12, 3).steps, name, 3.0))
    one = is_clean(output)
    assert told(output, one) == [float(number) for number in range(12)]


@pytest.mark.parametrize("who", ["client", "server"])
def test_an_abort_in_the_middle_ends_both_directions(who: str):
    bus = answered(30, 2)
    at = next(number for number, step in enumerate(bus.steps) if step.name == "segment 3")
    quitter = SegmentedBus(bus.client, bus.server)
    body = apdus.encode(7, invoke_id=INVOKE, reason=4, flags=SERVER if who == "server" else 0)
    quitter.send("abort", getattr(quitter, who), body, 6, False)
    output = run([*bus.steps[: at + 1], *quitter.steps])
    (one,) = exchanges(output)
    assert one.verdict is (Verdict.EXCEPTION if who == "server" else Verdict.OPEN)
    assert one.error is not None
    assert one.error.startswith("abort")
    assert all(not isinstance(row.event, Frame) or row.event.assembly is None for row in output.rows)


def test_an_answer_that_stops_accuses_nobody():
    bus = answered(30, 2)
    at = next(number for number, step in enumerate(bus.steps) if step.name == "segment 3")
    idle = SegmentedBus()
    idle.rounds(1)
    steps = [*bus.steps[: at + 1], *(Step("token", 40_000.0, step.octets) for step in idle.steps)]
    (one,) = exchanges(run(steps))
    assert one.verdict is Verdict.OPEN
    assert one.error == "its segments stopped before the last one"


def test_a_server_flag_set_wrongly_is_understood():
    """An acknowledgement of the client's that claims to be a server's, and the other way round."""
    for bus in (answered(), written()):
        turned = [
            Step(step.name, step.silence, _turned(step.octets)) if step.name.startswith("ack") else step
            for step in bus.steps
        ]
        is_clean(run(turned))


def _turned(octets: bytes) -> bytes:
    data = octets[8:-2]
    return frame(octets[2], octets[3], octets[4], data[:2] + bytes((data[2] ^ SERVER,)) + data[3:])


def test_the_same_invoke_id_again_is_another_message():
    first, second = answered(12, 2), answered(12, 2)
    second.steps.clear()
    second.ask(INVOKE, READ_MULTIPLE, reads(12))
    second.answer_in_segments(INVOKE, READ_MULTIPLE, results(12, 100.5), SIZE, 2)
    output = run([*without(first.steps, "segment 3", "ack 3"), *second.steps])
    one, two = exchanges(output)
    assert (one.verdict, two.verdict) == (Verdict.OPEN, Verdict.ANSWERED)
    assert told(output, two) == [number + 100.5 for number in range(12)]


def test_an_old_segment_never_stands_for_a_lost_one_of_another_answer():
    """The first answer breaks off after segment 2; of the second, whose first segment is the same, 2 is not seen."""
    body, other = results(12), results(9) + results(12, 7.5)[len(results(9)) :]
    assert body[:SIZE] == other[:SIZE]
    bus, again = answered(12, 2), SegmentedBus()
    again.ask(INVOKE, READ_MULTIPLE, reads(12))
    again.answer_in_segments(INVOKE, READ_MULTIPLE, other, SIZE, 2)
    output = run([*without(bus.steps, "segment 3", "ack 3"), *without(again.steps, "segment 2")])
    assert assembly(output, exchanges(output)[-1].response).missing == (2,)


def test_a_capture_that_begins_inside_a_message_accuses_nobody():
    bus = answered(30, 2)
    at = next(number for number, step in enumerate(bus.steps) if step.name == "segment 2")
    (one,) = exchanges(run(bus.steps[at:]))
    assert (one.verdict, one.request) == (Verdict.OPEN, None)


def test_a_late_answer_in_segments_is_one_late_answer():
    """The request holds the bus for half a second and is given up; then all segments come."""
    bus = answered(12, 2)
    late = [Step(step.name, 700.0 if step.name == "segment 0" else step.silence, step.octets) for step in bus.steps]
    output = run(late)
    asked, answer = exchanges(output)
    assert (asked.verdict, answer.verdict, answer.of) == (Verdict.NO_RESPONSE, Verdict.LATE, asked.id)
    assert assembly(output, answer.response).octets == whole_answer()


def test_an_answer_whose_first_segment_was_damaged_is_not_a_second_answer():
    bus = answered(12, 2)
    at = next(number for number, step in enumerate(bus.steps) if step.name == "segment 0")
    again = Step("segment 0", 1_500.0, bus.steps[at].octets)
    output = run([*spoilt(bus.steps[: at + 1], "segment 0"), again, *bus.steps[at + 1 :]])
    assert Verdict.ANSWERED_TWICE not in {one.verdict for one in output.transactions}
    assert assembly(output, exchanges(output)[-1].response).octets == whole_answer()


# The list line and the tree


def test_line_and_tree_of_the_last_segment_show_the_whole():
    output = run(answered(12, 2).steps)
    last = row(output, exchanges(output)[0].response)
    assert isinstance(last.event, Frame)
    assert "segment 3, last of 4: analog-value,0 present-value=0.5; analog-value,1" in describe(MSTP, last)
    layers = fields_of(MSTP, last.event, Role.RESPONSE)
    whole = layers[-1]
    assert whole.name == "Assembled from segments"
    shown = {field.name: field.value for field in whole.children}
    assert shown["segments"] == "4"
    assert shown["missing"] == "none"
    assert "analog-value,11" in str(whole.children)
    assert (whole.begin, whole.end) == (None, None)  # it stands in no single frame
    assert layers[0].begin == 0
    assert MSTP.fields(last.event, Role.RESPONSE)["bacapp.instance_number"] == ",".join(str(n) for n in range(12))
    assert bytes(MSTP.packet(last.event, Role.RESPONSE)) == last.event.octets


def test_the_tree_of_a_huge_message_ends_with_octets():
    """A thousand values are some seven thousand tags; the line and the values are complete all the same."""
    bus = SegmentedBus()
    bus.ask(INVOKE, READ_MULTIPLE, reads(5))
    bus.answer_in_segments(INVOKE, READ_MULTIPLE, results(1000), 480, 8)
    output = run(bus.steps)
    one = is_clean(output)
    whole = fields_of(MSTP, row(output, one.response).event, Role.RESPONSE)[-1]  # type: ignore[arg-type]
    assert [layer.name for layer in whole.children[-1].children] == ["ComplexACK", "Parameters", "Raw"]
    assert "analog-value,400" in str(whole)
    assert len(told(output, one)) == 1000


# Whatever comes


def frames_of(steps: list[Step]) -> list[Frame]:
    framer, found = MSTP.framer(SESSION.timing), []
    for number, step in enumerate(steps):
        found += framer.feed(Chunk(10**18 + number * 10**8, step.octets))
    return [event for event in [*found, *framer.close()] if isinstance(event, Frame)]


STEPS = [*answered(12, 2).steps, *written(12, 3).steps, *answered(15, 4, server=Party(5, 13, b"\x10")).steps]


@settings(max_examples=examples(150), deadline=None)
@given(st.lists(st.tuples(st.sampled_from(STEPS), st.sampled_from([0.0, 3.0, 300.0, 600.0, 11_000.0, 40_000.0]))))
def test_whatever_passes_each_transaction_closes_once(drawn: list[tuple[Step, float]]):
    output = run([Step(step.name, silence, step.octets) for step, silence in drawn])
    ids = [one.id for one in output.transactions]
    assert sorted(ids) == list(range(1, len(ids) + 1))
    assert {one.placement.tx for one in output.rows if one.placement is not None} == set(ids)
    for one in output.transactions:
        assert one.start <= one.end
        assert one.of is None or one.of < one.id


@settings(max_examples=examples(60), deadline=None)
@given(st.randoms(use_true_random=False), st.integers(0, 30))
def test_what_is_called_whole_is_whole(rng: random.Random, lost: int):
    """Segments of three different answers, in any order, some lost and repeated: never a mixture that was not sent."""
    sent = [answered(n, 2, server=Party(5, 13, bytes((n,)))).steps for n in (12, 13, 14)]
    steps = [step for line in sent for step in line if step.name.startswith("segment")]
    steps = [rng.choice(steps) for _ in steps] + rng.sample(steps, len(steps))
    reassembler = Reassembler()
    for no, event in enumerate(frames_of(steps[min(lost, len(steps) - 1) :])):
        found = reassembler.add(no, event)
        if found is not None and found.complete:
            assert found.octets in {whole_answer(n) for n in (12, 13, 14)}


def test_memory_is_bounded():
    """Thousands of messages that never end, and one that never stops growing."""
    reassembler = Reassembler()
    bus = SegmentedBus()
    piece = bytes(400)
    for number in range(3000):
        header = Apdu(3, 12, number & 0xFF, READ_MULTIPLE, sequence=number // 256, window=1)
        octets = apdus.encode(
            3, piece, invoke_id=header.invoke_id or 0, service=14, flags=12, sequence=(number // 256) & 0xFF
        )
        bus.steps.clear()
        bus.send("segment", Party(5, 7, bytes((number % 250,))), octets, 6, True)
        for event in frames_of(bus.steps):
            reassembler.add(number, event)
    assert len(reassembler._open) <= OPEN_MAX
    for number in range(3000):
        octets = apdus.encode(3, piece, invoke_id=1, service=14, flags=12, sequence=number & 0xFF)
        bus.steps.clear()
        bus.send("segment", bus.server, octets, 6, True)
        for event in frames_of(bus.steps):
            reassembler.add(number, event)
    assert reassembler._octets == sum(one.size for one in reassembler._open.values()) <= OCTETS_MAX
    assert LINE.baud == 38400
