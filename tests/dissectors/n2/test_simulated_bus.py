"""A simulated bus, listened to: values read back are those held, each fault gets its finding, a clean bus none."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import lru_cache

import pytest

from dissectors.findings import Finding, Severity
from dissectors.frame import Chunk, Frame
from dissectors.line import LineSettings, Timing
from dissectors.n2 import N2, interpret
from dissectors.n2.f510 import POINTS
from dissectors.n2.findings import N2Findings
from dissectors.n2.framing import judge
from dissectors.n2.rules import RULES
from dissectors.n2.simulated import (
    Follower,
    Job,
    Master,
    command,
    overriding,
    reading,
    readings,
    releasing,
)
from dissectors.simulated import Send
from dissectors.simulated_faults import BitFlips, DuplicateAddress, Fault, LateResponse, LostResponse, NoiseInGaps
from dissectors.tracker import Transaction, Verdict
from sniff.simulation.tap import EXACT, MODELS, Tap, TapModel
from sniff.simulation.wire import Burst, Party, Wire
from tests.faults.interference import Interference

MS = 1_000_000
S = 1_000 * MS
LINE = LineSettings.parse("9600,8N1")
FAST = 20 * MS  # between an answer and the next command, so that a test sees more of them


@dataclass
class Heard:
    """All that a listener made of a bus."""

    frames: dict[int, Frame] = field(default_factory=dict)
    transactions: list[Transaction] = field(default_factory=list)
    findings: tuple[Finding, ...] = ()
    octets: int = 0

    def codes(self) -> set[str]:
        return {f.code for f in self.findings}

    def verdicts(self) -> set[Verdict]:
        return {t.verdict for t in self.transactions}


def listen(wire: Wire, until: int, timing: Timing | None = None, model: TapModel = EXACT) -> Heard:
    """Run a bus and listen to it through an adapter."""
    return heard_of(wire.run(until), timing, model)


def heard_of(bursts: Iterable[Burst], timing: Timing | None = None, model: TapModel = EXACT) -> Heard:
    """Listen through an adapter to what a bus carried."""
    timing = timing or Timing(LINE, model.latency(LINE))
    framer, tracker, found, heard, no = N2.framer(timing), N2.tracker(timing), N2Findings(timing), Heard(), 0

    def take(events: Iterable) -> None:
        nonlocal no
        for event in events:
            no += 1
            header = N2.peek(event) if isinstance(event, Frame) else None
            tracked = tracker.track(no, event, header)
            if header is not None:
                heard.frames[no] = event
                N2.text(event, header, header.role)
            heard.octets += len(event.octets)
            found.see(no, event, header, tracked.placement)
            close(tracked.closed)

    def close(transactions: Iterable[Transaction]) -> None:
        for transaction in transactions:
            heard.transactions.append(transaction)
            found.settle(transaction)

    for item in Tap(LINE, model).tap(bursts):
        if isinstance(item, Chunk):
            take(framer.feed(item))
    take(framer.close())
    close(tracker.close())
    heard.findings = found.findings()
    return heard


def bus(stations: Sequence[Follower], masters: Sequence[Master], faults: Sequence[Fault] = (), seed: int = 1) -> Wire:
    parties = [Party(f"master {n}", master, answers=False) for n, master in enumerate(masters, 1)]
    parties += [Party(f"station {s.address}", s) for s in stations]
    return Wire(LINE, parties, faults, seed, start=S)


def every_point(*addresses: int) -> list[Job]:
    return [job for address in addresses for job in readings(address)]


# --- a clean bus ------------------------------------------------------------------------------------------------------


def test_the_points_are_those_of_the_manual():
    counts = {region: sum(p.region == region for p in POINTS) for region in (1, 2, 3, 4)}
    assert counts == {1: 15, 2: 10, 3: 34, 4: 5}
    assert all(p.low <= p.initial <= p.high for p in POINTS)
    for region, count in counts.items():
        assert [p.number for p in POINTS if p.region == region] == list(range(1, count + 1))


class Watched(Follower):
    """A follower whose process changes all the time, and which remembers what it held at each read."""

    def __init__(self, address: int) -> None:
        super().__init__(address)
        self.held: list[tuple[int, int, int, float]] = []
        self.heard = 0

    def hear(self, now, octets, quiet):
        self.heard += 1
        self.set(1, 13, (self.heard * 7 % 1000) / 10)
        self.set(2, 5, self.heard // 50 % 2)
        if octets[3:4] == b"1" and int(octets[1:3], 16) == self.address and judge(octets)[1] is None:
            region, number = int(octets[4:5], 16), int(octets[5:7], 16)
            self.held.append((self.address, region, number, self.value(region, number)))
        return super().hear(now, octets, quiet)


def test_half_a_day_of_polling_reads_back_what_was_held():
    stations = [Watched(1), Watched(17)]
    master = Master(every_point(1, 17), line=LINE, delay=10 * S)
    wire = bus(stations, [master])
    master.ask(overriding(1, 3, 1, 42.5), overriding(1, 4, 1, 1), releasing(1, 3, 1), releasing(1, 4, 1))
    heard = listen(wire, 43_200 * S)
    assert heard.findings == ()
    assert heard.verdicts() <= {Verdict.ANSWERED, Verdict.OPEN}
    read = []
    for transaction in heard.transactions:
        if transaction.kind == "read-attribute" and transaction.response is not None:
            got = interpret(heard.frames[transaction.request], heard.frames[transaction.response])
            read.append((got.station, got.region, got.object, got.value))
    held = {address: [h for h in s.held if h[0] == address] for s in stations for address in [s.address]}
    assert len(read) > 2000
    for address, values in held.items():
        assert [r for r in read if r[0] == address] == values[: len([r for r in read if r[0] == address])]
        assert len(values) - len([r for r in read if r[0] == address]) <= 1
    assert (1, 1, 10, 42.5) in read


def test_the_life_cycle_of_a_follower():
    drive = Follower(1)

    def ask(body: str) -> bytes:
        (send,) = drive.hear(0, command(1, body), True)
        return send.octets

    assert ask("04") == b"N00\r"
    assert ask("F") == b"A1061\r"
    reports = []
    while (report := ask("05")) != b"A\r":
        assert len(report) <= 204
        reports.append(report)
    assert len(reports) > 3
    drive.set(2, 3, 1)
    first = ask("04")
    assert first == b"A203402A\r" or first.startswith(b"A20340")
    assert ask("04") == first, "not acknowledged: told again"
    assert ask("05") == b"A\r"
    assert ask("08") == b"A\r"
    assert ask("110A03") == b"N00\r"


@pytest.mark.parametrize(
    ("body", "reply"),
    [
        ("116303", b"N11\r"),  # no AI 99
        ("110104", b"N11\r"),  # reserved by JCI
        ("1101", b"N05\r"),
        ("2101" + "03" + "42480000", b"N12\r"),
        ("2101" + "01" + "0D", b"A\r"),
        ("2441" + "03" + "003C", b"N11\r"),  # no BO 65
        ("2401" + "03" + "003C", b"A\r"),
        ("720301" + "43FA0000", b"N10\r"),  # 500 Hz
        ("720302" + "42480000", b"N12\r"),
        ("720301" + "42480000", b"A\r"),
        ("720101" + "42480000", b"A\r"),  # answered without action
        ("730301", b"A\r"),
        ("0001", b"A\r"),
        ("F1", b"N05\r"),
        ("9", b"N01\r"),
        ("3", b"N01\r"),
    ],
)
def test_what_a_follower_refuses(body, reply):
    drive = Follower(1)
    drive.hear(0, command(1, "F"), True)
    (send,) = drive.hear(0, command(1, body), True)
    assert send.octets == reply


def test_a_follower_keeps_to_itself():
    drive = Follower(1)
    assert drive.hear(0, command(2, "F"), True) == ()
    assert drive.hear(0, b"\xff\x00", True) == ()
    assert drive.hear(0, b">01", True) == ()
    assert drive.hear(0, b">01F00\r", True)[0].octets == b"N02\r"


# --- faults -----------------------------------------------------------------------------------------------------------


def quick(jobs: Sequence[Job], **settings: int) -> Master:
    return Master(jobs, line=LINE, **{"delay": FAST, **settings})


def test_a_bus_without_faults_has_no_findings():
    heard = listen(bus([Follower(1), Follower(2)], [quick(every_point(1, 2))]), 100 * S)
    assert heard.findings == ()
    assert len(heard.transactions) > 1000


@lru_cache(1)
def clean_bursts() -> tuple[Burst, ...]:
    return tuple(bus([Follower(1), Follower(2)], [quick(every_point(1, 2))]).run(30 * S))


@pytest.mark.parametrize("name", MODELS)
def test_no_adapter_makes_findings_where_there_are_none(name):
    heard = heard_of(clean_bursts(), model=MODELS[name])
    assert heard.findings == ()
    assert heard.verdicts() <= {Verdict.ANSWERED, Verdict.OPEN}
    assert len(heard.transactions) > 250


@pytest.mark.parametrize("name", MODELS)
def test_whatever_the_adapter_no_value_goes_to_the_wrong_point(name):
    faults = [LostResponse(0.03), BitFlips(0.001), NoiseInGaps(0.05)]
    stations = [Watched(1), Watched(2)]
    heard = listen(bus(stations, [quick(every_point(1, 2))], faults), 30 * S, model=MODELS[name])
    held = {s.address: {(r, n): set() for _, r, n, _ in s.held} for s in stations}
    for station in stations:
        for address, region, number, value in station.held:
            held[address][region, number].add(value)
    read = 0
    for transaction in heard.transactions:
        if transaction.kind == "read-attribute" and transaction.verdict in (Verdict.ANSWERED, Verdict.RETRY):
            got = interpret(heard.frames[transaction.request], heard.frames[transaction.response])
            assert got.value in held[got.station][got.region, got.object]
            read += 1
    assert read > 80


def test_a_reset_is_found():
    drive = Follower(1)
    wire = bus([drive], [quick(every_point(1))])
    assert listen(wire, 30 * S).findings == ()
    drive.reset()
    heard = listen(wire, 60 * S)
    assert heard.codes() == {"N2001"}
    assert heard.findings[0].subject == "station 1"


def test_a_point_that_does_not_exist_is_found():
    heard = listen(bus([Follower(1)], [quick([reading(1, 1, 99), reading(1, 1, 1)])]), 30 * S)
    assert [(f.code, f.subject) for f in heard.findings] == [("N2002", "station 1, AI 99")]
    assert "current value" in heard.findings[0].seen
    assert Verdict.EXCEPTION in heard.verdicts()


def test_a_slow_station_is_found():
    jobs = every_point(1)
    heard = listen(bus([Follower(1, delay=300 * MS)], [quick(jobs, timeout=800 * MS)]), 30 * S)
    assert heard.codes() == {"N2003"}
    assert listen(bus([Follower(1, delay=240 * MS)], [quick(jobs, timeout=800 * MS)]), 30 * S).findings == ()


def test_slowness_is_not_judged_beyond_what_the_adapter_allows():
    def hear(delay: int, latency: int) -> set[str]:
        wire = bus([Follower(1, delay=delay)], [quick(every_point(1), timeout=800 * MS)])
        return listen(wire, 30 * S, Timing(LINE, latency)).codes()

    assert hear(260 * MS, 0) == {"N2003"}
    assert hear(260 * MS, 17 * MS) == set()
    assert hear(300 * MS, 17 * MS) == {"N2003"}


def test_damaged_frames_are_found_at_their_station():
    faults = [BitFlips(0.01, parties=("station 2",))]
    heard = listen(bus([Follower(1), Follower(2)], [quick(every_point(1, 2))], faults), 120 * S)
    assert {f.subject for f in heard.findings if f.code == "N2004"} == {"station 2"}
    assert Verdict.DAMAGED_ANSWER in heard.verdicts()


def test_a_lost_answer_is_found_and_inverts_nothing():
    heard = listen(bus([Follower(1)], [quick(every_point(1))], [LostResponse(0.05)]), 120 * S)
    assert heard.codes() == {"N2005"}
    assert {Verdict.NO_RESPONSE, Verdict.RETRY} <= heard.verdicts()
    for t in heard.transactions:
        if t.response is not None and t.kind == "read-attribute":
            got = interpret(heard.frames[t.request], heard.frames[t.response])
            assert got.value is not None


def test_a_station_that_is_not_there_is_an_error():
    heard = listen(bus([Follower(1)], [quick(every_point(1, 9))]), 60 * S)
    (finding,) = heard.findings
    assert (finding.code, finding.subject, finding.severity) == ("N2005", "station 9", Severity.ERROR)


def test_an_override_left_on_a_point_is_found():
    master = quick([reading(1, 1, 10)], delay=S)
    wire = bus([Follower(1)], [master])
    master.ask(overriding(1, 3, 1, 42.5), overriding(1, 4, 1, 1))
    assert listen(wire, 500 * S).findings == ()
    master = quick([reading(1, 1, 10)], delay=S)
    wire = bus([Follower(1)], [master])
    master.ask(overriding(1, 3, 1, 42.5), overriding(1, 4, 1, 1), releasing(1, 4, 1))
    heard = listen(wire, 1000 * S)
    assert [(f.code, f.subject) for f in heard.findings] == [("N2006", "station 1, AO 1")]
    assert "42.5" in heard.findings[0].seen


def test_two_masters_are_found():
    masters = [quick(every_point(1)), quick(every_point(1, 2), delay=47 * MS, timeout=310 * MS, start=1300 * MS)]
    heard = listen(bus([Follower(1), Follower(2)], masters), 120 * S)
    assert "N2007" in heard.codes()


class Twin(Follower):
    """A drive with an address that another one has; it answers `after` ns behind that one, with values of its own."""

    def __init__(self, address: int, after: int, base: float = 0.5) -> None:
        super().__init__(address)
        self.delay += after
        for point in POINTS:
            if point.region in (1, 3) and point.number not in (5, 6, 7):
                self.set(point.region, point.number, base + point.number)


def test_a_double_address_is_found():
    wire = bus([Follower(1), Twin(1, after=32 * MS)], [quick(every_point(1), delay=100 * MS)])
    heard = listen(wire, 60 * S)
    assert {(f.code, f.subject, f.severity) for f in heard.findings if f.severity >= Severity.WARNING} >= {
        ("N2008", "station 1", Severity.ERROR)
    }


def test_the_same_answer_again_proves_no_second_station():
    faults = [DuplicateAddress("station 1", by=250 * MS)]
    heard = listen(bus([Follower(1)], [quick(every_point(1), delay=600 * MS)], faults), 60 * S)
    assert {(f.code, f.severity) for f in heard.findings} == {("N2013", Severity.WARNING)}


def test_damage_alone_is_no_second_station():
    faults = [BitFlips(0.02), NoiseInGaps(0.5)]
    heard = listen(bus([Follower(1), Follower(2)], [quick(every_point(1, 2))], faults), 120 * S)
    assert not heard.codes() & {"N2007", "N2008", "N2013"}
    assert Verdict.ANSWERED_TWICE not in heard.verdicts()


def test_a_refusal_is_found():
    heard = listen(bus([Follower(1)], [quick([overriding(1, 3, 2, 1.0), reading(1, 1, 1)])]), 30 * S)
    assert [(f.code, f.seen.split(":")[1]) for f in heard.findings] == [("N2009", " N12 read-only")]


def test_a_master_that_starts_again_is_found():
    drive = Follower(1)
    first, second = quick(every_point(1)), quick(every_point(1), start=40 * S)
    wire = bus([drive], [first, second])
    first_half = listen(wire, 30 * S)
    assert first_half.findings == ()
    job = Job(1, command(1, "F"))
    master = quick([reading(1, 1, 1)])
    master.ask(job)
    heard = listen(bus([Follower(1)], [master]), 30 * S)
    assert heard.codes() == {"N2010"}


def test_a_late_answer_is_not_also_lost():
    faults = [LateResponse(0.03, by=300 * MS)]
    heard = listen(bus([Follower(1)], [quick(every_point(1), delay=100 * MS)], faults), 200 * S)
    counts = {f.code: f.count for f in heard.findings}
    assert counts.keys() <= {"N2011", "N2005"}
    assert counts["N2011"] > 50
    assert counts.get("N2005", 0) <= 1  # where the repeat was answered late too, one of the two remains


@pytest.mark.parametrize("latency", [0, 17 * MS])
def test_a_late_answer_in_the_turn_of_another_is_the_late_ones(latency):
    """Station 2 answers after the master has turned to station 1; nobody else is accused."""
    faults = [LateResponse(0.05, by=300 * MS, parties=("station 2",))]
    masters = [quick(every_point(1, 2), delay=60 * MS, retries=0)]
    heard = listen(bus([Follower(1), Follower(2)], masters, faults), 200 * S, Timing(LINE, latency))
    graves = {(f.code, f.subject) for f in heard.findings if f.severity >= Severity.WARNING}
    assert ("N2011", "station 2") in graves
    assert {subject for _, subject in graves} == {"station 2"}


def test_noise_everywhere_is_the_bus():
    heard = listen(bus([Follower(1), Follower(2)], [quick(every_point(1, 2))], [BitFlips(0.004)]), 120 * S)
    assert {f.subject for f in heard.findings if f.code == "N2004"} == {"bus"}


@lru_cache(3)
def slow_bursts(delay: int) -> tuple[Burst, ...]:
    return tuple(bus([Follower(1), Follower(2, delay=delay)], [quick(every_point(1, 2), timeout=3 * S)]).run(120 * S))


@pytest.mark.parametrize("delay", [300 * MS, 900 * MS, 2500 * MS])
@pytest.mark.parametrize("model", MODELS.values(), ids=lambda m: m.name)
def test_a_slow_station_that_the_master_waits_for_is_no_fault(delay, model):
    heard = heard_of(slow_bursts(delay), model=model)
    assert [f for f in heard.findings if f.severity >= Severity.WARNING] == []


class Scanner:
    """A commissioning tool that asks every address once who it is (and once more), and does not wait long."""

    def __init__(self, addresses: Sequence[int], timeout: int, tries: int = 2) -> None:
        self.left = [command(address, "F") for address in addresses for _ in range(tries)]
        self.timeout, self.due = timeout, S

    def hear(self, now: int, octets: bytes, quiet: bool) -> tuple[Send, ...]:
        self.due = now + 5 * MS
        return ()

    def wake(self, now: int) -> tuple[Send, ...]:
        if now < self.due or not self.left:
            return ()
        octets = self.left.pop(0)
        self.due = now + len(octets) * LINE.char + self.timeout
        return (Send(now, octets),)

    def next_wake(self) -> int | None:
        return self.due if self.left else None


@pytest.mark.parametrize("timeout", [50 * MS, 300 * MS])
@pytest.mark.parametrize("model", MODELS.values(), ids=lambda m: m.name)
def test_a_scan_over_absent_addresses_is_no_fault(model, timeout):
    parties = [Party("tool", Scanner(range(1, 100), timeout), answers=False)]
    parties += [Party(f"station {a}", Follower(a)) for a in (5, 42)]
    heard = listen(Wire(LINE, parties, (), 1, start=S), 120 * S, model=model)
    assert len(heard.transactions) == 198
    assert [f for f in heard.findings if f.severity >= Severity.WARNING] == []


def test_noise_loses_no_octet_and_no_exchange():
    heard = listen(bus([Follower(1)], [quick(every_point(1))], [NoiseInGaps(0.3)]), 60 * S)
    assert sum(v is Verdict.ANSWERED for v in (t.verdict for t in heard.transactions)) > 300
    assert "N2007" not in heard.codes()


def test_a_catalogue_entry_for_each_finding():
    assert all(code == rule.code and rule.explanation and rule.next for code, rule in RULES.items())


def test_nobody_heard_but_a_master_that_waits_is_one_finding_about_the_bus():
    heard = listen(bus([], [quick([reading(3, 1, 1), reading(4, 1, 1)])]), 60 * S)
    assert [(f.code, f.subject, f.severity) for f in heard.findings] == [("N2005", "bus", Severity.ERROR)]


def test_stray_octets_in_place_of_a_few_answers_make_nobody_of_them():
    master = quick([reading(3, 1, 1), reading(4, 1, 1)])
    stray = Interference(S, jitter=None, octets=(1, 3))
    parties = [Party("master", master, answers=False), Party("stray", stray, answers=False)]
    heard = listen(Wire(LINE, parties, (), 1), 60 * S)
    assert [(f.code, f.subject) for f in heard.findings if f.severity >= Severity.WARNING] == [("N2005", "bus")]


@pytest.mark.parametrize("until", range(3, 15))
def test_one_command_that_is_not_answered_is_no_error(until):
    """However the capture ends: of the next one to that station nobody knows yet what becomes."""
    master = quick([reading(1, 1, 1), reading(9, 1, 1)], retries=0, timeout=300 * MS)
    heard = listen(bus([Follower(1)], [master]), S + until * 100 * MS)
    asked = [f.severity for f in heard.findings if f.code == "N2005" and f.count == 1]
    assert set(asked) <= {Severity.NOTE}
