"""One frame that the tap misses costs its own transaction and no other: verdicts and roles of all others stay."""

from __future__ import annotations

from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from dissectors.modbus.simulated_master import read_holding, write_register, write_registers

REGISTER = st.integers(0, 0xFFFF)


def copies(unit):
    """Exchanges whose answer repeats the request: direction is not in the octets."""
    return st.one_of(
        st.builds(lambda a, v: write_register(unit, a, v), REGISTER, REGISTER),
        st.builds(
            lambda a, on: bytes((unit, 5)) + a.to_bytes(2, "big") + (b"\xff\0" if on else b"\0\0"),
            REGISTER,
            st.booleans(),
        ),
        st.builds(
            lambda a, m: bytes((unit, 22)) + a.to_bytes(2, "big") + m, REGISTER, st.binary(min_size=4, max_size=4)
        ),
        st.builds(lambda data: bytes((unit, 8, 0, 0)) + data, st.binary(min_size=2, max_size=2)),
    ).map(lambda adu: (adu, adu))


def sure(unit):
    """Exchanges whose direction the octets tell."""
    return st.one_of(
        st.builds(
            lambda start, values: (read_holding(unit, start, len(values) // 2), bytes((unit, 3, len(values))) + values),
            REGISTER,
            st.binary(min_size=2, max_size=20).map(lambda octets: octets[: len(octets) & ~1]),
        ),
        st.builds(
            lambda start, values: (write_registers(unit, start, values), write_registers(unit, start, values)[:6]),
            REGISTER,
            st.lists(REGISTER, min_size=1, max_size=4),
        ),
        st.builds(
            lambda start, code: (read_holding(unit, start, 2), bytes((unit, 0x83, code))), REGISTER, st.integers(1, 4)
        ),
    )


UNITS = (1, 2, 3)
EXCHANGE = st.sampled_from(UNITS).flatmap(lambda unit: st.one_of(sure(unit), copies(unit)))
TIMES = st.tuples(st.floats(6, 12), st.floats(25, 60))  # ms: answer, pause


@st.composite
def traffic(draw):
    """Exchanges as (request, answer, ms to the answer, ms of pause before); the first ones teach."""
    learning = [
        exchange
        for unit in UNITS
        for exchange in (
            (read_holding(unit, 0, 1), bytes((unit, 3, 2, 0, unit))),
            (write_registers(unit, 9, [1]), write_registers(unit, 9, [1])[:6]),
        )
    ] * 3
    heartbeat = draw(st.sampled_from(UNITS).flatmap(copies))
    body = draw(st.lists(st.one_of(EXCHANGE, st.just(heartbeat)), min_size=2, max_size=25))
    times = draw(st.lists(TIMES, min_size=len(learning) + len(body), max_size=len(learning) + len(body)))
    return [(*exchange, *time) for exchange, time in zip(learning + body, times, strict=True)]


def play(paper_bus, exchanges, missing=None):
    """Track all frames but one; transactions by the numbers that their frames have when none is missing."""
    bus = paper_bus()
    for request, answer, after, pause in exchanges:
        bus.exchange(request, answer, answer=after, pause=pause)
    numbers = [no for no in range(len(bus.events)) if no != missing]
    bus.events = [bus.events[no] for no in numbers]
    reading = bus.run()
    placed = dict(zip(numbers, reading.placements, strict=True))
    found = {}
    for transaction in reading.transactions:
        frames = tuple(numbers[no - 1] for no in (transaction.request, transaction.response) if no is not None)
        found[frames] = transaction
    return placed, found


@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(exchanges=traffic(), data=st.data())
def test_a_missed_frame_inverts_nothing(paper_bus, exchanges, data):
    missing = data.draw(st.integers(36, 2 * len(exchanges) - 1), label="missing frame")
    placed, found = play(paper_bus, exchanges, missing)
    hit = missing // 2
    for no, (request, answer, *_) in enumerate(exchanges):
        if no == hit:
            continue
        frames = (2 * no, 2 * no + 1)
        assert placed[frames[0]].role.value == "request", f"exchange {no}"
        assert placed[frames[1]].role.value == "response", f"exchange {no}"
        assert frames in found, f"exchange {no} is torn apart"
        expected = "exception" if answer[1] & 0x80 else "answered"
        repeats = no == hit + 1 and exchanges[hit][0] == request
        allowed = {expected, "retry"} if repeats else {expected}  # a request repeated after nothing is a retry
        assert found[frames].verdict.value in allowed


@settings(max_examples=25, deadline=None)
@given(exchanges=traffic())
def test_a_clean_bus_is_read_as_it_is(paper_bus, exchanges):
    placed, found = play(paper_bus, exchanges)
    assert [placed[no].role.value for no in range(2 * len(exchanges))] == ["request", "response"] * len(exchanges)
    for no, (_, answer, *_) in enumerate(exchanges):
        assert found[2 * no, 2 * no + 1].verdict.value == ("exception" if answer[1] & 0x80 else "answered")


@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(octets=st.lists(st.binary(max_size=12), max_size=30), data=st.data())
def test_any_events_any_times(paper_bus, octets, data):
    """Total: every frame is in exactly one transaction, whatever comes and whenever."""
    bus = paper_bus()
    for some in octets:
        kind = data.draw(st.sampled_from(("say", "damage", "cut", "noise")))
        gap = data.draw(st.floats(-50, 9000))
        if kind == "noise":
            bus.noise(some or b"\0", gap)
        elif kind == "cut":
            bus.cut(some, data.draw(st.integers(0, len(some) + 1)), gap)
        else:
            getattr(bus, kind)(some, gap)
    reading = bus.run()
    ids = [transaction.id for transaction in reading.transactions]
    assert ids == list(range(1, len(ids) + 1)), "ids ascend from 1 and each closes once"
    for no, placement in enumerate(reading.placements, 1):
        if placement is not None:
            assert placement.no == no
            assert 1 <= placement.tx <= len(ids)


@example(line="115200,8N1", latency=0)
@example(line="1200,8E1", latency=0)
@settings(max_examples=20, deadline=None)
@given(line=st.sampled_from(("9600,8N1", "19200,8E1", "115200,8E1")), latency=st.integers(0, 16_000_000))
def test_other_lines_and_adapters(paper_bus, line, latency):
    bus = paper_bus(line=line, latency=latency)
    for value in range(6):
        bus.exchange(read_holding(1, 0, 1), bytes((1, 3, 2, 0, 0)), answer=30)
        bus.exchange(write_register(1, 0, value), write_register(1, 0, value), answer=33)
    assert bus.run().verdicts == ["answered"] * 12
