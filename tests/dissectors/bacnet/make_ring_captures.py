"""Makes captures of rings by hand, each after one fault or one thing that looks like a fault and is none.

python -m tests.dissectors.bacnet.make_ring_captures captures/findings && pytest --sniff-update captures
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

from dissectors.bacnet.envelope import frame
from tests.dissectors.bacnet.ring_script import Step, data, found, poll, rounds, spoil, token

READ = "0104000301 0c0c020004d2194d".replace(" ", "")
VALUE = "010030010c0c020004d2194d3e75030041313f"
LIST = "01040002010c0c020000051 94c".replace(" ", "")
_OBJECT = "c400800000"
SEGMENTS = (f"01043c0100010c0c02000005194c3e{_OBJECT * 6}", f"0104380101010c{_OBJECT * 4}3f")
"""A list of objects in two segments."""

I_AM = "01001000c4020000c82201e09100215d"
_HEAD = "#!sniff-capture 1\n# line: 38400,8N1\n# protocol: mstp\n# start: 2026-03-01T10:00:00Z\n"


def used_late() -> list[Step]:
    """11 begins when 4 has already taken its token back."""
    steps = rounds(6, 4, 11, 30)
    for _ in range(3):
        steps += [(2, token(4, 11)), (28, token(4, 11)), (28, poll(4, 12)), (6, token(11, 30)), (2, token(30, 4))]
        steps += rounds(6, 4, 11, 30)
    return steps


def used_twice() -> list[Step]:
    """14 begins when 6 has repeated its token, and uses the repeat too, over the frame of 33."""
    steps = rounds(9, 6, 14, 33)
    for _ in range(4):
        steps += [(2, token(6, 14)), (33, token(6, 14)), (4, token(14, 33)), (2, spoil(token(33, 6), 4, 0x20))]
        steps += [(26, token(14, 33)), (2, token(33, 6)), *rounds(9, 6, 14, 33)]
    return steps


def lost_behind_damage() -> list[Step]:
    """What 14 made of its token was damaged for everybody: it has not left, and does not come back."""
    steps = rounds(9, 6, 14, 33)
    for _ in range(3):
        steps += [
            (2, token(6, 14)),
            (2, spoil(token(14, 33), 6)),
            (30, poll(6, 7)),
            (25, poll(6, 14)),
            (3, found(14, 6)),
        ]
        steps += [(2, token(6, 14)), (2, token(14, 33)), (2, token(33, 6)), *rounds(9, 6, 14, 33)]
    return steps


def cut_in_header() -> list[Step]:
    """27 lets go within the header of its tokens now and then; whose turn it was says that it was 27."""
    steps: list[Step] = []
    for keep in (4, 5, 4, 6):
        steps += [*rounds(6, 8, 27, 61), (2, token(8, 27)), (2, token(27, 61)[:keep]), (24, token(27, 61))]
        steps += [(2, token(61, 8))]
    return steps + rounds(6, 8, 27, 61)


def header_spoilt() -> list[Step]:
    """Of tokens of 27 more than one octet is wrong; they stand alone in their place, half a preamble before them."""
    steps: list[Step] = []
    for places in ((1, 2), (1, 2, 3), (0, 2), (0, 1)):
        octets = token(27, 61)
        for at in places:
            octets = spoil(octets, at, 0x6B)
        steps += [*rounds(6, 8, 27, 61), (2, token(8, 27)), (2, octets), (2, token(61, 8))]
    return steps + rounds(6, 8, 27, 61)


def lost_behind_an_adapter() -> list[Step]:
    """19 loses its token; 44 makes a new one, by the reads less than 500 ms later: the adapter held one back."""
    steps = rounds(5, 3, 19, 44)
    for silence in (489, 494, 506):
        steps += [(2, token(3, 19)), (silence, poll(44, 3)), (4, found(3, 44)), (2, token(44, 3))]
        steps += [(2, token(3, 19)), (2, token(19, 44)), (2, token(44, 3)), *rounds(5, 3, 19, 44)]
    return steps


def data_without_first_octet() -> list[Step]:
    """Answers of 31 whose first octet is missing or wrong: what they say is proved by both checks, and is shown."""
    steps: list[Step] = []
    for octets in (data(31, 12, VALUE)[1:], spoil(data(31, 12, VALUE), 0), data(31, 12, VALUE)[2:]):
        steps += [*rounds(4, 12, 31), (2, data(12, 31, READ, expects=True)), (18, octets)]
    return steps + rounds(4, 12, 31)


def shut_out() -> list[Step]:
    """40 joins, polls 41 alone, and passes to 6 past 90."""
    joins: list[Step] = [(2, poll(6, 40)), (3, found(40, 6)), (2, token(6, 40)), (2, poll(40, 41)), (25, token(40, 6))]
    return [*rounds(8, 6, 90), *joins, *rounds(40, 6, 40)]


def slave_speaks() -> list[Step]:
    """150 answers Who-Is by itself."""
    steps: list[Step] = []
    for _ in range(3):
        steps += [*rounds(3, 7, 22), (2, data(7, 255)), (4, data(150, 255, I_AM)), (2, token(7, 22)), (2, token(22, 7))]
    return steps


def one_instance_twice() -> list[Step]:
    """22 and 40 say that they are the same device."""
    steps: list[Step] = []
    for _ in range(2):
        steps += [*rounds(3, 7, 22, 40), (2, data(7, 255)), (2, token(7, 22)), (3, data(22, 255, I_AM))]
        steps += [(2, token(22, 40)), (3, data(40, 255, I_AM)), (2, token(40, 7))]
    return steps + rounds(3, 7, 22, 40)


def last_octet_missing() -> list[Step]:
    """12 asks 31, whose answers end one octet early."""
    steps: list[Step] = []
    for _ in range(5):
        steps += [*rounds(4, 12, 31), (2, data(12, 31, READ, expects=True)), (18, data(31, 12, VALUE)[:-1])]
    return steps + rounds(4, 12, 31)


def number_is_free() -> list[Step]:
    """70 asks whether its number is taken; nobody answers."""
    ask = frame(3, 70, 70, bytes(range(0x40, 0x50)))
    joins: list[Step] = [(2, poll(9, 70)), (3, found(70, 9)), (2, token(9, 70)), (2, ask), (257, token(70, 2))]
    return [*rounds(3, 2, 9), (2, token(2, 9)), *joins, *rounds(3, 2, 9, 70)]


def number_is_taken() -> list[Step]:
    """70 asks whether its number is taken; another one answers with octets of its own."""
    ask, other = frame(3, 70, 70, bytes(range(0x40, 0x50))), frame(4, 70, 70, bytes(range(0x60, 0x70)))
    joins: list[Step] = [(2, token(9, 70)), (2, ask), (6, other), (2, token(70, 2))]
    return [*rounds(3, 2, 9), (2, token(2, 9)), *joins, *rounds(3, 2, 9, 70)]


def slow_polls() -> list[Step]:
    """3 polls two or three times in a second, and there is no token."""
    return [(400 + no * 37 % 300, poll(3, 4 + no)) for no in range(40)]


def impatient() -> list[Step]:
    """8 does not wait for the answer to its polls."""
    steps: list[Step] = []
    for no in range(6):
        steps += [*rounds(12, 8, 25), (2, poll(8, 9 + no)), (3, token(8, 25)), (2, token(25, 8))]
    return steps


def not_taken_in() -> list[Step]:
    """33 answers the polls of 25 at once, which passes its token to 8 all the same; and a router does not know 5."""
    steps: list[Step] = []
    for _ in range(4):
        steps += [*rounds(3, 8, 25), (2, token(8, 25)), (2, poll(25, 33)), (3, found(33, 25)), (2, token(25, 8))]
        steps += [(2, token(8, 25)), (2, data(25, 8, "018003010005")), (2, token(25, 8))]
    return steps + rounds(3, 8, 25)


def polls_on() -> list[Step]:
    """8 polls one address after another with one token, though 25 has its token each time."""
    steps: list[Step] = []
    for _ in range(2):
        steps += [
            *rounds(8, 8, 25),
            *[(2.0 if no == 26 else 24.0, poll(8, no)) for no in range(26, 70)],
            (24, token(8, 25)),
        ]
        steps += [(2, token(25, 8))]
    return steps + rounds(8, 8, 25)


def storm() -> list[Step]:
    """5 sends Who-Is without pause."""
    steps: list[Step] = []
    for _ in range(460):
        steps += [(2, data(5, 255)), (2, data(5, 255)), (2, token(5, 60)), (14, token(60, 5))]
    return steps


def one_hog() -> list[Step]:
    """2 sends ten frames with each token."""
    steps: list[Step] = []
    for _ in range(75):
        many = [(2.0, data(2, 14, "0100100409631901" + "2e6520" + "5a" * 32 + "2f")) for _ in range(10)]
        steps += [*many, (2, token(2, 14)), (2, token(14, 2))]
    return steps


def held_read() -> list[Step]:
    """A busy computer: now and then three frames of three stations come in one late read."""
    steps = rounds(20, 3, 17, 52)
    for _ in range(4):
        steps += [
            (2, token(3, 17)),
            (47, token(17, 52)),
            (0, token(52, 3)),
            (0, token(3, 17)),
            *rounds(5, 17, 52, 3)[:-1],
        ]
    return steps


def request_damaged() -> list[Step]:
    """A request that only the listener got damaged, and its answer."""
    asked: list[Step] = [(2, spoil(data(12, 31, READ, expects=True), 14)), (18, data(31, 12, VALUE))]
    return [*rounds(4, 12, 31), *asked, *rounds(4, 12, 31)]


def after_an_empty_poll() -> list[Step]:
    """Damage after polls to an address that nobody has."""
    steps: list[Step] = []
    for at in (2, 4):
        steps += [*rounds(3, 12, 31), (2, poll(12, 20)), (25, spoil(token(12, 31), at)), (2, token(31, 12))]
    return steps + rounds(3, 12, 31)


def tokens_not_heard() -> list[Step]:
    """The tap misses three tokens of 27: 61 goes on as after them, and nobody repeats or polls."""
    steps: list[Step] = []
    for _ in range(3):
        steps += [*rounds(8, 8, 27, 61), (2, token(8, 27)), (6, token(61, 8))]
    return steps + rounds(8, 8, 27, 61)


def station_not_heard() -> list[Step]:
    """27 is too weak here: 61 goes on as after its token, and nobody repeats or polls."""
    return [(2, token(8, 27)), *[(6, token(61, 8)), (2, token(8, 27))] * 30]


def segments_that_ask() -> list[Step]:
    """Segments of an answer are sent as frames that expect a reply, and acknowledged at once, without the token."""
    steps: list[Step] = []
    for _ in range(4):
        steps += [*rounds(3, 12, 31), (2, data(12, 31, LIST, expects=True)), (2, frame(7, 12, 31)), (2, token(12, 31))]
        steps += [(2, data(31, 12, SEGMENTS[0], expects=True)), (4, data(12, 31, "0100400100" + "01"))]
        steps += [
            (2, data(31, 12, SEGMENTS[1], expects=True)),
            (4, data(12, 31, "0100400101" + "01")),
            (2, token(31, 12)),
        ]
    return steps


def questions_not_understood() -> list[Step]:
    """Requests of 31 whose header only the listener got damaged; they are answered as if nothing had been."""
    steps: list[Step] = []
    asked = data(31, 12, READ, expects=True)
    for at in (2, 4, 7):
        steps += [*rounds(4, 12, 31, 40), (2, token(12, 31)), (2, spoil(asked, at)), (18, data(12, 31, VALUE))]
        steps += [(2, token(31, 40)), (2, token(40, 12)), *rounds(4, 12, 31, 40)]
        steps += [
            (2, token(12, 31)),
            (2, spoil(asked, at)),
            (5, frame(7, 31, 12)),
            (2, token(31, 40)),
            (2, token(40, 12)),
        ]
    return steps


def last_two_octets_missing() -> list[Step]:
    """31 lets go two octets early where it answers polls; it comes into no ring."""
    steps: list[Step] = []
    for _ in range(5):
        steps += [
            *rounds(4, 12, 20),
            (2, token(12, 20)),
            (2, poll(20, 31)),
            (2, found(31, 20)[:-2]),
            (24, token(20, 12)),
        ]
    return steps + rounds(4, 12, 20)


def answers_for_others() -> list[Step]:
    """19 answers what 12 is asked, too: now behind it, now in its place."""
    steps: list[Step] = []
    for at in range(6):
        ask, value = (f"{octets[:at_id]}{at + 1:02x}{octets[at_id + 2 :]}" for octets, at_id in ((READ, 8), (VALUE, 6)))
        steps += [*rounds(4, 3, 12, 19), (2, data(3, 12, ask, expects=True))]
        if at % 2:
            steps.append((6, data(12, 3, value)))
        steps += [(3, data(19, 3, value)), (5 if at % 2 else 262, token(3, 12)), (2, token(12, 19)), (2, token(19, 3))]
    return steps + rounds(4, 3, 12, 19)


def taken_for_anothers() -> list[Step]:
    """19 answers what 12 is asked, and 3 takes that and goes on: 12 had no time, and is innocent."""
    steps: list[Step] = []
    for at in range(5):
        ask, value = (f"{octets[:at_id]}{at + 1:02x}{octets[at_id + 2 :]}" for octets, at_id in ((READ, 8), (VALUE, 6)))
        steps += [*rounds(3, 3, 12, 19), (2, data(3, 12, ask, expects=True)), (4, data(19, 3, value))]
        steps += [(2, token(3, 12)), *([(3.0, data(12, 3, value))] if at == 4 else [])]
        steps += [(2, token(12, 19)), (2, token(19, 3))]
    return steps + rounds(3, 3, 12, 19)


def misfits() -> list[Step]:
    """31 sends class and code of errors between tags, as Unsigned, and answers that are cut short."""
    steps: list[Step] = []
    for answer in ("50010c0e910291200f", "50010c21029120", VALUE[4:-4], "50010c0e910291200f"):
        steps += [*rounds(2, 12, 31), (2, data(12, 31, READ, expects=True)), (9, data(31, 12, "0100" + answer))]
    return steps + rounds(2, 12, 31)


def never_answered() -> list[Step]:
    """31 promises its answers for later, and sends none."""
    steps: list[Step] = []
    for at in range(3):
        ask = f"{READ[:8]}{at + 1:02x}{READ[10:]}"
        steps += [*rounds(2, 12, 31), (2, data(12, 31, ask, expects=True)), (6, frame(7, 12, 31))]
    return steps + [(240, octets) for _ in range(23) for octets in (token(12, 31), token(31, 12))]


def too_long() -> list[Step]:
    """12 takes 50 octets at once, and 31 sends it a name of 60."""
    name = f"30010c0c020004d2194d3e753d00{'41' * 60}3f"
    once = [*rounds(8, 12, 31), (2.0, data(12, 31, READ.replace("0003", "0000"), expects=True))]
    return [*once, (9, data(31, 12, "0100" + name))] * 3 + rounds(3, 12, 31)


def polls_astray() -> list[Step]:
    """40, the last of its ring, looks below its own address instead of behind it."""
    steps: list[Step] = []
    for to in (9, 10, 11, 12):
        steps += [*rounds(4, 5, 40), (2, token(5, 40)), (2, poll(40, to)), (25, token(40, 5))]
    return steps + rounds(4, 5, 40)


def two_ways_to_one_network() -> list[Step]:
    """4 and 6 both say that they lead to networks 2001 and 2002."""
    announced = "01800107d107d2"
    once = [*rounds(3, 4, 6, 20), (2.0, data(4, 255, announced)), (2, token(4, 6)), (2, data(6, 255, announced))]
    return [*once, (2, token(6, 20)), (2, token(20, 4))] * 3 + rounds(3, 4, 6, 20)


def ordered_to_be_silent(order: str = "1901", *, refused: bool = False) -> list[Step]:
    """3 tells 12 by DeviceCommunicationControl to be silent, which it is from then on."""
    answer = "01005001119104911a" if refused else "0100200111"
    steps = [
        *rounds(4, 3, 12, 19),
        (2.0, data(3, 12, f"010400030111{order}", expects=True)),
        (5.0, data(12, 3, answer)),
    ]
    for at in range(5):
        ask = f"{READ[:8]}{at + 20:02x}{READ[10:]}"
        steps += [*rounds(1, 3, 12, 19), (2, data(3, 12, ask, expects=True)), (260, token(3, 12))]
        steps += [(2, token(12, 19)), (2, token(19, 3))]
    return steps


def clock(source: int, time: str, *, utc: bool = False) -> bytes:
    """Tells everybody the time of the last day of 2023; `time`: four octets."""
    return data(source, 255, f"010010{'09' if utc else '06'}a47b0c1f07b4{time}")


def two_clocks() -> list[Step]:
    """3 and 19 tell the time, and are 85 minutes apart."""
    steps: list[Step] = []
    for _ in range(3):
        steps += [*rounds(3, 3, 12, 19), (2, clock(3, "0c1e0000")), *rounds(1, 3, 12, 19)[:2]]
        steps += [(2, clock(19, "0b050000")), (2, token(19, 3))]
    return steps + rounds(3, 3, 12, 19)


def each_frame_twice() -> list[Step]:
    """A converter gives back what it hears, behind an adapter that hides how soon; now and then in the next read."""
    steps: list[Step] = []
    asked: list[Step] = [(2, data(3, 12, READ, expects=True)), (6, data(12, 3, VALUE))]
    for at, (silence, octets) in enumerate([*rounds(12, 3, 12, 19), *asked, *rounds(4, 3, 12, 19)]):
        steps += [(silence, octets), (14 if at % 9 == 8 else 0, octets)]
    return steps


def two_routers_and_numbers() -> list[Step]:
    """4 and 6 both pass on what comes from network 2001, broadcasts too, and say that this network is 5 and 9."""
    steps: list[Step] = []
    for hops in (254, 253, 254):
        from_there = f"0128ffff0007d10105{hops:02x}1008"
        steps += [*rounds(3, 4, 6, 20), (2, data(4, 255, from_there)), (2, data(4, 255, "018013000501"))]
        steps += [(2, token(4, 6)), (2, data(6, 255, from_there)), (2, data(6, 255, "018013000901"))]
        steps += [(2, token(6, 20)), (2, token(20, 4))]
    return steps + rounds(3, 4, 6, 20)


def answers_elsewhere() -> list[Step]:
    """12 sends its answers to everybody; 3 takes that for another token and lets go of its own, as it must."""
    steps: list[Step] = []
    for at in range(4):
        ask, value = (f"{octets[:at_id]}{at + 1:02x}{octets[at_id + 2 :]}" for octets, at_id in ((READ, 8), (VALUE, 6)))
        steps += [*rounds(3, 3, 12, 19), (2, data(3, 12, ask, expects=True)), (6, data(12, 255, value))]
        steps += [(510, poll(3, 11)), (24, poll(3, 12)), (3, found(12, 3)), *rounds(1, 3, 12, 19)]
    return steps + rounds(3, 3, 12, 19)


def answers_with_another_number() -> list[Step]:
    """12 answers whatever it is asked with invoke id 0."""
    value = f"{VALUE[:6]}00{VALUE[8:]}"
    steps: list[Step] = []
    for at in range(4):
        ask = f"{READ[:8]}{at + 20:02x}{READ[10:]}"
        steps += [*rounds(3, 3, 12, 19), (2, data(3, 12, ask, expects=True)), (6, data(12, 3, value))]
    return steps + rounds(3, 3, 12, 19)


def never_uses_it() -> list[Step]:
    """40 answers the polls of 19 and is silent when it gets the token."""
    steps: list[Step] = []
    for _ in range(4):
        steps += [*rounds(20, 3, 12, 19), (2, token(3, 12)), (2, token(12, 19)), (2, poll(19, 40)), (3, found(40, 19))]
        steps += [(2, token(19, 40)), (24, token(19, 40)), (24, poll(19, 41)), (24, poll(19, 42)), (24, token(19, 3))]
    return steps + rounds(20, 3, 12, 19)


def token_to_itself() -> list[Step]:
    """3 believes to be alone, and passes the token to itself; the adapter hides how soon."""
    return [(4 + at % 3 * 9, token(3, 3)) for at in range(60)]


MADE = {
    "ms-tp-token-used-after-it-was-given-up": used_late,
    "ms-tp-token-and-its-repeat-both-used": used_twice,
    "ms-tp-use-of-the-token-damaged": lost_behind_damage,
    "ms-tp-cut-within-the-header": cut_in_header,
    "ms-tp-header-with-more-than-one-octet-spoilt": header_spoilt,
    "ms-tp-lost-token-behind-an-adapter": lost_behind_an_adapter,
    "ms-tp-answers-without-their-first-octet": data_without_first_octet,
    "ms-tp-shut-out-of-the-ring": shut_out,
    "ms-tp-slave-speaks-unasked": slave_speaks,
    "ms-tp-one-device-instance-twice": one_instance_twice,
    "ms-tp-last-octet-missing": last_octet_missing,
    "ms-tp-number-is-free": number_is_free,
    "ms-tp-number-is-taken": number_is_taken,
    "ms-tp-slow-between-polls": slow_polls,
    "ms-tp-does-not-wait-for-answers-to-polls": impatient,
    "ms-tp-answers-to-polls-not-taken": not_taken_in,
    "ms-tp-polls-on-with-one-token": polls_on,
    "ms-tp-broadcast-storm": storm,
    "ms-tp-one-uses-most-of-the-line": one_hog,
    "ms-tp-reads-held-back": held_read,
    "ms-tp-tokens-not-heard": tokens_not_heard,
    "ms-tp-station-not-heard": station_not_heard,
    "ms-tp-request-heard-damaged": request_damaged,
    "ms-tp-damage-after-a-poll-to-nobody": after_an_empty_poll,
    "ms-tp-segments-that-ask": segments_that_ask,
    "ms-tp-questions-not-understood-here": questions_not_understood,
    "ms-tp-last-two-octets-missing": last_two_octets_missing,
    "ms-tp-answers-what-others-are-asked": answers_for_others,
    "ms-tp-answers-in-place-of-another": taken_for_anothers,
    "ms-tp-parameters-that-do-not-fit": misfits,
    "ms-tp-postponed-and-never-answered": never_answered,
    "ms-tp-answers-longer-than-asked-for": too_long,
    "ms-tp-polls-beyond-its-successor": polls_astray,
    "ms-tp-two-routers-to-one-network": two_ways_to_one_network,
    "ms-tp-token-to-itself-behind-an-adapter": token_to_itself,
    "ms-tp-ordered-to-be-silent": ordered_to_be_silent,
    "ms-tp-two-clocks": two_clocks,
    "ms-tp-each-frame-twice-behind-an-adapter": each_frame_twice,
    "ms-tp-two-routers-pass-on-from-one-network": two_routers_and_numbers,
    "ms-tp-answers-to-another-address": answers_elsewhere,
    "ms-tp-answers-with-another-number": answers_with_another_number,
    "ms-tp-never-uses-its-token": never_uses_it,
}


LATENCY = dict.fromkeys((name for name in MADE if name.endswith("behind-an-adapter")), 17.5)
"""ms, of captures that come through an adapter that holds reads back."""


def text(steps: Sequence[Step], latency: float = 0) -> str:
    """The capture file; steps without silence come in the read before."""
    lines: list[tuple[float, bytes]] = []
    for silence, octets in steps:
        if not silence and lines:
            lines[-1] = lines[-1][0], lines[-1][1] + octets
        else:
            lines.append((silence, octets))
    told = f"# latency: {latency}\n# latency-from: simulated\n" if latency else ""
    return _HEAD + told + "".join(f"~{f'{silence:g}':<8} {octets.hex(' ').upper()}\n" for silence, octets in lines)


if __name__ == "__main__":
    for name, make in MADE.items():
        (Path(sys.argv[1]) / f"{name}.cap.txt").write_text(text(make(), LATENCY.get(name, 0)), encoding="utf-8")
