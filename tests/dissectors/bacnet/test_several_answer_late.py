"""Several stations that answer when their askers have given up: one cause, told once, of the bus."""

from __future__ import annotations

from tests.dissectors.bacnet.ring_script import Step, data, rounds, script, spoil, token

READ = "01040003010c0c020004d2194d"


def asked(station: int, by: int = 1) -> Step:
    return (2, data(by, station, READ, expects=True))


def late(station: int) -> list[Step]:
    """It answers into the token that 1 passes when it has given up; the token is passed again."""
    return [asked(station), (270, spoil(token(1, 2), 5)), (30, token(1, 2)), (2, token(2, 5)), (2, token(5, 1))]


def heard(times: int, *late_ones: int) -> list[Step]:
    steps = rounds(20, 1, 2, 5)
    for _ in range(times):
        for station in late_ones:
            steps += [*late(station), *rounds(100, 1, 2, 5, use=9)]
    return steps


def test_what_strikes_behind_requests_to_several_is_one_finding() -> None:
    read = script(heard(4, 2, 5))
    assert read.graves() == {("MS308", "bus")}
    assert read.of("MS308").stations == (1, 2, 5)  # 1 is hit
    assert "to MAC 2, 5" in read.of("MS308").seen


def test_one_that_is_off_stands_beside_it() -> None:
    steps = heard(4, 2, 5)
    for _ in range(6):
        steps += [asked(60), (270, token(1, 2)), (2, token(2, 5)), (2, token(5, 1)), *rounds(100, 1, 2, 5, use=9)]
    assert script(steps).graves() >= {("MS308", "bus"), ("MS301", "1 → 60")}


def test_one_alone_is_named() -> None:
    assert script(heard(6, 5)).graves() == {("MS308", "MAC 5")}
