"""Who is at fault on a ring, and who is not: each with the alternative that must be excluded."""

from __future__ import annotations

import pytest

from dissectors.bacnet.envelope import frame
from dissectors.bacnet.frame_types import FrameType
from dissectors.bacnet.ring_events import RingEventKind
from dissectors.bacnet.rules import RULES
from dissectors.findings import Severity, with_consequences
from dissectors.findings import found as found_by_rule
from dissectors.frame import Flaw, Frame
from dissectors.line import LineSettings, Timing
from dissectors.tracker import Verdict
from tests.dissectors.bacnet.ring_script import Step, data, found, poll, rounds, script, spoil, token

READ = "010400030 10c0c020004d2194d".replace(" ", "")
VALUE = "01003 0010c0c020004d2194d3e75030041313f".replace(" ", "")


def test_a_token_used_late_accuses_the_slow_station_alone():
    """5 begins when 1 has already looked for another one: for a moment both have a token."""
    steps: list[Step] = []
    for _ in range(6):
        steps += rounds(10, 1, 5, 8)
        steps += [(2, token(1, 5)), (30, token(1, 5)), (30, poll(1, 6)), (5, token(5, 8)), (2, token(8, 1))]
    read = script(steps)
    assert read.graves() == {("MS103", "MAC 5")}
    assert "two tokens for a moment" in read.of("MS103").seen
    assert read.of("MS102").cause == ("MS103", "MAC 5")
    assert read.ring.nodes[1].use.most < 3_000_000
    assert not any(what is RingEventKind.TWO_TOKENS for what, _ in read.ring.happened)


def both_used(times: int, damage: int = 6) -> list[Step]:
    """8 begins after 1 has repeated its token, and then uses the repeat too, while 20 speaks."""
    steps: list[Step] = []
    for _ in range(times):
        steps += [*rounds(8, 1, 8, 20), (2, token(1, 8)), (31, token(1, 8)), (6, token(8, 20))]
        steps += [(2, spoil(token(20, 1), damage)), (27, token(8, 20)), (2, token(20, 1))]
    return [*steps, *rounds(8, 1, 8, 20)]


@pytest.mark.parametrize("damage", [3, 4, 6, 7])
def test_a_station_that_uses_a_token_and_its_repeat_is_slow(damage: int):
    read = script(both_used(4, damage))
    assert read.graves() == {("MS103", "MAC 8")}
    assert "4 times only after its neighbour had repeated the token, up to 39.1 ms" in read.of("MS103").seen
    assert read.of("MS102").cause == read.of("MS401").cause == ("MS103", "MAC 8")


def test_a_station_that_speaks_twice_after_a_repeated_token_is_slow():
    """What it sends for the second token comes whole."""
    steps: list[Step] = []
    for _ in range(4):
        steps += [*rounds(8, 1, 8, 20), (2, token(1, 8)), (31, token(1, 8)), (6, token(8, 20)), (1.2, token(8, 20))]
        steps += [(2, token(20, 1))]
    assert ("MS103", "MAC 8") in script(steps).graves()


def test_a_station_deaf_to_the_first_token_is_not_slow():
    """Its neighbour's frames are damaged now and then, repeated token or not."""
    steps: list[Step] = []
    for no in range(12):
        hit = token(20, 1) if no % 3 else spoil(token(20, 1), 6)
        steps += [*rounds(2, 1, 8, 20), (2, token(1, 8)), (31, token(1, 8)), (2, token(8, 20)), (2, hit)]
        steps += [(2, token(1, 8)), (2, token(8, 20)), (2, spoil(token(20, 1), 6))]
    assert "MS103" not in {code for code, _ in script(steps).graves()}


def test_damage_between_a_token_and_the_poll_after_it_may_have_been_its_use():
    """8 used the token, though nobody understood it, and is not said to have left or come back."""
    steps = rounds(10, 1, 8, 20)
    for _ in range(4):
        steps += [(2, token(1, 8)), (2, spoil(token(8, 20), 6)), (30, poll(1, 9)), (25, poll(1, 8)), (2, found(8, 1))]
        steps += [(2, token(1, 8)), (2, token(8, 20)), (2, token(20, 1)), *rounds(10, 1, 8, 20)]
    happened = script(steps).ring.happened
    assert not {what for what, _ in happened} & {RingEventKind.LEFT, RingEventKind.REJOINED}


def test_a_poll_after_a_token_that_failed_is_no_use_of_it():
    steps = rounds(10, 1, 5, 8)
    for _ in range(5):
        steps += [(2, token(1, 5)), (30, token(1, 5)), (30, poll(1, 6)), (25, poll(1, 7)), (25, poll(1, 8))]
        steps += [(2, found(8, 1)), (2, token(1, 8)), (2, token(8, 1)), *rounds(5, 1, 8)]
    assert script(steps).ring.nodes[1].use.most < 3_000_000


def test_a_second_token_names_only_who_made_it():
    """9 passes a token that it does not have; the station that gets it, and the one that polls, are innocent."""
    steps = rounds(5, 1, 5, 9)
    for _ in range(5):
        steps += [(2, poll(1, 2)), (4, token(9, 5)), (2, token(5, 9)), (2, token(9, 1)), *rounds(3, 1, 5, 9)]
    read = script(steps)
    assert {code for code, _ in read.graves()} == {"MS104"}
    assert read.of("MS104").seen.startswith("MAC 9 sent")
    assert {mac for what, mac in read.ring.happened if what is RingEventKind.TWO_TOKENS} == {9}


@pytest.mark.parametrize("mac", [200, 77])
def test_a_slave_that_speaks_unasked(mac: int):
    steps = rounds(3, 1, 3)
    for _ in range(3):
        steps += [(2, data(1, 255)), (3, data(mac, 255, "01001000c4020000c822 01e09100225d95".replace(" ", "")))]
        steps += rounds(3, 1, 3)
    assert script(steps).graves() == {("MS111", f"MAC {mac}")}


def test_no_token_seen_none_lost():
    read = script([(700, poll(1, 2 + no % 100)) for no in range(60)])
    assert read.graves() == {("MS203", "MAC 1")}


def joined(first: int, steps_of_joining: list[Step], *ring: int) -> list[Step]:
    return [
        *rounds(10, 0, 7),
        (2, poll(0, first)),
        (2, found(first, 0)),
        (2, token(0, first)),
        *steps_of_joining,
        *rounds(60, *ring),
    ]


def test_a_station_past_which_the_token_goes():
    read = script(joined(3, [(2, token(3, 0))], 0, 3))
    assert read.graves() == {("MS110", "MAC 7")}
    assert "MAC 3 passes the token on to MAC 0 and polls nobody, never 4 … 127" in read.of("MS110").seen


def test_several_stations_past_which_one_passes_the_token_are_its_doing():
    last: list[Step] = [(2, token(0, 3)), (2, token(3, 5)), (2, token(5, 9))]
    read = script([*rounds(10, 0, 3, 5, 9), *last, (2, token(9, 5)), *rounds(60, 5, 9)])
    assert read.graves() == {("MS112", "MAC 9")}
    assert "on to MAC 5, past MAC 0, 3," in read.of("MS112").seen
    under = {one.subject for one in read.findings if one.cause == ("MS112", "MAC 9")}
    assert under == {"MAC 0", "MAC 3"}


def test_a_station_that_was_looked_for_is_not_shut_out():
    """It may have been switched off just then; or its poll was damaged."""
    search: list[Step] = [(2 if address == 4 else 25, poll(3, address)) for address in (*range(4, 11), 0)]
    read = script(joined(3, [*search, (2, found(0, 3)), (2, token(3, 0))], 0, 3))
    assert read.graves() == set()


def test_a_station_that_missed_its_token_is_not_shut_out():
    lost: list[Step] = [(2, token(0, 7)), (30, token(0, 7)), (30, poll(0, 8)), (25, poll(0, 9)), (25, poll(0, 3))]
    read = script(
        [*rounds(10, 0, 3, 7), (2, token(0, 3)), (2, token(3, 0)), *lost, (2, found(3, 0)), *rounds(60, 0, 3)]
    )
    assert "MS110" not in {code for code, _ in read.graves()}


def test_a_test_of_the_own_address_that_nobody_answers():
    ask = frame(FrameType.TEST_REQUEST, 64, 64, bytes(range(16)))
    read = script([*rounds(3, 1, 3), (2, token(1, 64)), (2, ask), (256, token(64, 1)), *rounds(3, 1, 3)])
    assert read.findings == ()
    (tested,) = (one for one in read.transactions if one.kind == "test-request")
    assert tested.verdict is Verdict.DATA


@pytest.mark.parametrize(("echo", "graves"), [(range(16), set()), (range(16, 32), {("MS501", "MAC 64")})])
def test_a_test_of_the_own_address_that_is_answered(echo: range, graves: set[tuple[str, str]]):
    """The same octets: the number is taken, the newcomer leaves it. Others: somebody else has it and talks over it."""
    ask, answer = (frame(kind, 64, 64, bytes(octets)) for kind, octets in ((3, range(16)), (4, echo)))
    read = script([*rounds(3, 1, 3), (2, token(1, 64)), (2, ask), (5, answer), (2, token(64, 1)), *rounds(3, 1, 3)])
    assert read.graves() == graves


def test_an_answer_to_a_request_that_was_heard_damaged():
    ask, answer = data(2, 5, READ, expects=True), data(5, 2, VALUE)
    read = script([(10, token(5, 2)), (2, spoil(ask, 12)), (20, answer), (2, token(2, 5)), (2, token(5, 2))])
    (asked,) = (one for one in read.transactions if one.request == 1)
    assert (asked.verdict, asked.response, asked.station) == (Verdict.ANSWERED, 2, 5)
    assert read.ring.nodes[5].replies == 1
    assert read.graves() == set()
    alone = script([(10, token(5, 2)), (2, spoil(ask, 12)), (260, token(2, 5)), (2, token(5, 2))])
    assert [one.verdict for one in alone.transactions if one.request == 1] == [Verdict.DAMAGED_REQUEST]
    assert alone.graves() == set()


def test_damage_after_a_poll_to_an_empty_address_is_nobodys_answer():
    steps = rounds(3, 1, 5)
    for _ in range(5):
        steps += [(2, poll(1, 3)), (25, spoil(token(1, 5), 3)), (2, token(5, 1)), *rounds(2, 1, 5)]
    read = script(steps)
    assert {one.verdict for one in read.transactions if one.station == 3 and one.kind == "poll-for-master"} == {
        Verdict.DATA
    }
    assert 3 not in {place.source for place in read.placements if place is not None}
    assert not any(subject == "MAC 3" for _, subject in read.graves())


def test_repeated_damage_proves_no_second_station():
    """Whatever it is that spoils 5's answers, its address is not taken twice."""
    steps = rounds(5, 2, 5)
    for place in range(9, 19):
        answer = spoil(data(5, 2, VALUE), place)
        steps += [(2, data(2, 5, READ, expects=True)), (20, answer), *rounds(2, 2, 5)]
    read = script(steps)
    assert read.graves() == {("MS402", "MAC 5")}
    assert "10 of them answers" in read.of("MS402").seen


@pytest.mark.parametrize("cut", [1, 2])
@pytest.mark.parametrize("extended", [False, True])
def test_answers_that_lack_their_end(cut: int, extended: bool):
    answer = frame(33, 2, 5, bytes.fromhex(VALUE)) if extended else data(5, 2, VALUE)
    steps = rounds(5, 2, 5)
    for _ in range(5):
        steps += [(2, data(2, 5, READ, expects=True)), (20, answer[:-cut]), *rounds(2, 2, 5)]
    read = script(steps)
    damaged = [event for event in read.events if isinstance(event, Frame) and not event.ok]
    assert len(damaged) == 5
    assert read.graves() == {("MS405", "MAC 5")}
    if cut == 2 and not extended:  # nothing is left of its check that would put it right
        return
    assert {event.repair.flaw for event in damaged if event.repair} == {
        [Flaw.LAST_MISSING, Flaw.LAST_TWO_MISSING][cut - 1]
    }
    assert all(event.repair and event.repair.octets == answer for event in damaged)


def test_answers_cut_anywhere_do_not_lack_their_end():
    steps = rounds(5, 2, 5)
    for lost in (1, 2, 4, 6, 3, 5):
        steps += [(2, data(2, 5, READ, expects=True)), (20, data(5, 2, VALUE)[:-lost]), *rounds(2, 2, 5)]
    assert script(steps).graves() == {("MS402", "MAC 5")}


def test_noise_that_hits_everybody_is_the_bus():
    steps: list[Step] = []
    for no in range(300):
        pair = rounds(1, 1, 5, 9)
        if no % 4 == 0:
            at = no // 4 % 3
            pair[at] = (2, spoil(pair[at][1], no % 8, 1 << no % 7))
        steps += pair
    assert script(steps).graves() == {("MS401", "bus")}


@pytest.mark.parametrize(("latency", "judged"), [(17.5, True), (50, False)])
def test_a_limit_that_is_passed_whatever_the_adapter_hides(latency: float, judged: bool):
    """60 ms − 17.5 ms is more than 15 ms; 60 ms − 50 ms is not."""
    steps = rounds(30, 1, 5)
    for _ in range(6):
        steps += [(2, token(1, 5)), (60, token(5, 1)), *rounds(4, 1, 5)]
    assert script(steps, latency).graves() == ({("MS103", "MAC 5")} if judged else set())


def test_reads_that_a_busy_computer_held_back_are_nobodys_lateness():
    """Several stations are late at once, and their frames come in one read."""
    steps = rounds(30, 1, 5, 9)
    for _ in range(10):
        steps += [(2, token(1, 5)), (50, token(5, 9)), (0, token(9, 1)), (0, token(1, 5)), *rounds(3, 5, 9, 1)]
    assert script(steps).graves() == set()


def test_an_answer_that_comes_late_is_not_lost_as_well():
    steps = rounds(5, 2, 5, 9)
    for _ in range(5):
        steps += [(2, data(2, 5, READ, expects=True)), (260, token(2, 5)), (2, token(5, 9))]
        steps += [(2, data(5, 2, VALUE)), (2, token(9, 2)), *rounds(3, 2, 5, 9)]
    read = script(steps)
    assert {code for code, _ in read.graves()} == {"MS302"}


def test_what_a_loss_costs_is_said():
    """After each lost token 1 polls up to 127 before it finds 0: seconds without a token."""
    steps = rounds(20, 0, 1)
    for _ in range(3):
        steps += [(2, token(0, 1)), (510, poll(1, 2)), *((25.0, poll(1, address)) for address in range(3, 128))]
        steps += [(25, poll(1, 0)), (2, found(0, 1)), (2, token(1, 0)), *rounds(30, 0, 1)]
    read = script(steps)
    assert {code for code, _ in read.graves()} == {"MS101"}
    assert "polled up to 127 for a successor after a loss" in read.of("MS201").seen
    assert "stood still for up to 3.4" in read.of("MS201").seen


def test_an_impatient_station_is_not_two():
    """It never waits for the answer to its polls: one rhythm, one station."""
    steps: list[Step] = []
    for no in range(60):
        steps += [*rounds(2, 1, 5), (2, poll(1, 10 + no % 50)), (3, token(1, 5)), (2, token(5, 1))]
    read = script(steps)
    assert ("MS204", "MAC 1") in read.graves()
    assert "MS501" not in {code for code, _ in read.graves()}


def test_two_rhythms_are_two_stations():
    steps: list[Step] = []
    for no in range(60):
        wait = 3 if no % 2 else 25
        steps += [*rounds(2, 1, 5), (2, poll(1, 10 + no % 50)), (wait, token(1, 5)), (2, token(5, 1))]
    assert ("MS501", "MAC 1") in script(steps).graves()


def test_a_storm_of_broadcasts():
    steps: list[Step] = []
    for _ in range(400):
        steps += [(2, data(1, 255)), (2, data(1, 255)), *rounds(4, 1, 5)]
    assert script(steps).graves() == {("MS602", "MAC 1")}


def test_a_station_that_has_the_line_most_of_the_time_is_a_fact():
    steps: list[Step] = []
    for _ in range(100):
        steps += [*((2.0, data(1, 5, "01000001" + "00" * 40)) for _ in range(10)), *rounds(3, 1, 5, 9)]
    read = script(steps)
    assert read.graves() == set()
    assert read.of("MS601").severity is Severity.INFO
    assert "up to 10 frames" in read.of("MS601").seen


def lost(silence: float, maker: int, holder: int = 8) -> list[Step]:
    """The token of `holder` is gone; `maker` begins anew after so many ms as the reads show them."""
    steps: list[Step] = []
    for _ in range(3):
        steps += [*rounds(6, 1, 8, 20), (2, token(1, 8))]
        steps += [(silence, poll(maker, holder)), (4, found(holder, maker)), (2, token(maker, holder))]
        steps += [(2, token(8, 20)), (2, token(20, 1))]
    return steps


@pytest.mark.parametrize("silence", [490, 500, 510, 700])
def test_a_lost_token_through_an_adapter_that_holds_reads_back(silence: float):
    """490 ms as read may be 507: nobody but the one with a new token sends after so long a silence."""
    read = script(lost(silence, 20), latency=17.5)
    assert read.of("MS101").subject == "MAC 8"
    assert read.of("MS101").count == 3
    assert "MS104" not in {code for code, _ in read.graves()}


@pytest.mark.parametrize("silence", [600, 1900, 5000])
def test_a_ring_that_goes_on_where_it_was_has_lost_no_token(silence: float):
    """Whoever makes a token looks for a successor first; here all were silent, or the tap was deaf."""
    for then in ([(silence, token(8, 20))], [(silence, token(20, 1)), (2, token(1, 8)), (2, token(8, 20))]):
        read = script([*rounds(6, 1, 8, 20), (2, token(1, 8)), *then, *rounds(6, 20, 1, 8)])
        assert {code for code, _ in read.graves()} <= {"LN304"}
        assert "went on where it was" in read.of("MS101").seen
        assert read.of("MS101").subject == "bus"


@pytest.mark.parametrize("latency", [0, 17.5])
@pytest.mark.parametrize(("begun", "named"), [(6, "MAC 8"), (4, "bus")])
def test_who_breaks_off_its_frame_had_the_token(latency: float, begun: int, named: str):
    """Six octets of a frame of MAC 8 say whose it is, four do not; then silence, and 1 makes a token."""
    steps: list[Step] = []
    for _ in range(2):
        steps += [*rounds(6, 1, 8, 20), (2, token(1, 8)), (2, data(8, 20)[:begun])]
        steps += [(520, poll(1, 8)), (4, found(8, 1)), (2, token(1, 8)), (2, token(8, 20)), (2, token(20, 1))]
    read = script(steps, latency=latency)
    assert read.of("MS101").subject == named


@pytest.mark.parametrize(("silence", "named"), [(1000, "MAC 8"), (1030, "bus"), (1900, "bus"), (2100, "bus")])
def test_a_silence_that_no_other_master_leaves_names_nobody(silence: float, named: str):
    """MAC 1 makes a token after 510 ms, if it is alive; here it had been off as well. That all were off together is
    only said of what no address explains."""
    finding = script(lost(silence, 1, 8)).of("MS101")
    assert finding.subject == named
    assert ("silent together" in finding.seen) == (silence > 2000)


def test_a_silence_that_cannot_be_500_ms_loses_no_token():
    """At 470 ms it is a second token, whatever the adapter does."""
    read = script(lost(470, 20), latency=17.5)
    assert not [what for what, _ in read.ring.happened if what is RingEventKind.LOST_TOKEN]
    assert read.ring.of(RingEventKind.TWO_TOKENS, 20).count == 3


@pytest.mark.parametrize("silence", [490, 510])
def test_one_that_had_the_token_has_not_surely_made_a_new_one(silence: float):
    """8 has the token, or 1 has just passed it: either may go on, unless even the shortest reading is 500 ms."""
    for maker in (1, 8):
        read = script(lost(silence, maker, 20), latency=17.5)
        assert not [what for what, _ in read.ring.happened if what is RingEventKind.LOST_TOKEN]


def _question(number: int) -> tuple[str, str]:
    """A ReadProperty and its answer, with that invoke id."""
    return READ[:8] + f"{number:02x}" + READ[10:], VALUE[:6] + f"{number:02x}" + VALUE[8:]


@pytest.mark.parametrize("latency", [0, 17.5])
def test_who_answers_what_others_are_asked_has_no_second_token(latency: float):
    """19 answers the requests to 12, behind its answers or in their place: the invoke id says so."""
    steps: list[Step] = []
    for at in range(6):
        ask, value = _question(at + 1)
        steps += [*rounds(4, 3, 12, 19), (2, data(3, 12, ask, expects=True))]
        if at % 2:
            steps.append((6, data(12, 3, value)))
        steps += [(3, data(19, 3, value)), (5 if at % 2 else 270, token(3, 12)), (2, token(12, 19)), (2, token(19, 3))]
    read = script(steps, latency)
    assert read.graves() == {("MS306", "MAC 19"), ("MS301", "3 → 12")}
    assert read.of("MS306").seen == "answered 6 times what MAC 12 was asked"
    assert not any(what in (RingEventKind.UNHEARD, RingEventKind.TWO_TOKENS) for what, _ in read.ring.happened)


def test_an_answer_with_another_id_is_for_a_question_that_was_not_heard():
    steps: list[Step] = []
    for at in range(6):
        ask, value = _question(at + 1)
        steps += [*rounds(4, 3, 12, 19), (2, data(3, 12, ask, expects=True)), (6, data(12, 3, value))]
        steps += [(20, data(19, 3, _question(at + 90)[1])), (3, token(3, 12)), (2, token(12, 19)), (2, token(19, 3))]
    assert not any(one.code == "MS306" for one in script(steps).findings)


def test_a_token_to_itself_is_never_repeated():
    """Whoever passes the token to itself uses it by doing so again, however slowly."""
    read = script([(4 + at % 3 * 12, token(3, 3)) for at in range(60)], 17.5)
    assert not read.graves()
    assert {one.code for one in read.findings} == {"MS107"}


def _asks(late: tuple[int, ...], patience: float = 200) -> list[Step]:
    """3 asks 12 with each second token, and `late` of the reads of its requests come 30 ms late; 12 takes long."""
    steps: list[Step] = []
    for at in range(60):
        slow = 30 if at in late else 0
        steps += [(5 + slow, data(3, 12, READ, expects=True)), (patience - slow, data(12, 3, VALUE)), (3, token(3, 12))]
        steps += [*rounds(1, 12, 3, use=2), *rounds(1, 3, 12, use=2)]
    return steps


def test_a_request_that_was_read_late_makes_nobody_slow():
    """Nothing comes behind it for so long that the read may have been late."""
    assert not script(_asks((20, 30, 40, 50))).graves()


def test_requests_that_are_late_so_often_are_the_station_s():
    assert ("MS103", "MAC 3") in script(_asks(tuple(range(5, 55, 2)))).graves()


def test_a_millisecond_over_the_limit_says_nothing_of_an_adapter_that_nobody_named():
    steps = [step for at in range(120) for step in rounds(1, 3, 12, use=16.5 if at % 4 == 0 else 3)]
    unnamed = Timing(LineSettings(38400), 0, is_told=False)
    assert not {code for code, _ in script(steps, timing=unnamed).graves()}
    slow = [step if at % 8 else (21.0, step[1]) for at, step in enumerate(steps)]
    assert ("MS103", "MAC 3") in script(slow, timing=unnamed).graves()


def test_a_late_answer_with_the_same_id_is_the_station_s_own():
    """A client that gives all its requests one id: 19 was asked before, and is late."""
    steps: list[Step] = []
    for _ in range(6):
        steps += [*rounds(4, 3, 12, 19), (2, data(3, 19, READ, expects=True)), (262, token(3, 12)), (2, token(12, 19))]
        steps += [(2, token(19, 3)), (2, data(3, 12, READ, expects=True)), (6, data(12, 3, VALUE))]
        steps += [(4, data(19, 3, VALUE)), (3, token(3, 12)), (2, token(12, 19)), (2, token(19, 3))]
    read = script(steps)
    assert read.graves() == {("MS302", "3 → 19")}


def test_a_master_alone_with_its_slaves_is_only_noted():
    """They answer, so the line is sound in both directions, and there is no other master."""
    steps: list[Step] = []
    for turn in range(260):
        steps += [(2, data(3, 130, READ, expects=True)), (8, data(130, 3, VALUE))] if turn % 50 == 0 else []
        steps.append((27, poll(3, (3 + turn % 127 + 1) % 128)))
    read = script(steps)
    assert read.graves() == set()
    assert read.of("MS109").severity is Severity.NOTE
    assert "6 answers to what it asked" in read.of("MS109").seen


def test_what_cut_tokens_and_polls_cost_stands_under_them():
    """Nobody can use or answer them: their sender polls on, and the rounds get longer."""
    made = [
        found_by_rule(RULES[code], subject, "", first=0, last=1)
        for code, subject in (("MS108", "bus"), ("MS201", "MAC 9"), ("MS201", "MAC 5"), ("MS405", "MAC 9"))
    ]
    caused = {(one.code, one.subject) for one in with_consequences(made, RULES) if one.cause == ("MS405", "MAC 9")}
    assert caused == {("MS108", "bus"), ("MS201", "MAC 9")}
