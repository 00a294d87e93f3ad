from __future__ import annotations

import time

import pytest

from sniff.sources import clock as module
from sniff.sources.clock import Clock


def test_progress_is_monotonic_from_the_anchor() -> None:
    clock = Clock(1_000_000, 5_000)
    assert clock.at(5_000) == 1_000_000
    assert clock.at(5_250) == 1_000_250
    before = Clock.start().monotonic
    now = clock.now()
    assert clock.at(before) <= now <= clock.at(Clock.start().monotonic)


def test_drift_is_what_the_wall_clock_stepped(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = Clock.start()
    real = time.time_ns
    monkeypatch.setattr(module.time, "time_ns", lambda: real() + 7_000_000_000)
    assert abs(clock.drift() - 7_000_000_000) < 100_000_000


@pytest.mark.skipif(not hasattr(time, "CLOCK_BOOTTIME"), reason="this system has no clock that goes on in its sleep")
def test_clock_goes_on_while_the_machine_sleeps(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = Clock.start()
    real, slept = time.clock_gettime_ns, 3600 * 1_000_000_000  # the plain monotonic clock stands still meanwhile
    monkeypatch.setattr(module.time, "clock_gettime_ns", lambda which: real(which) + slept)
    wall = time.time_ns
    monkeypatch.setattr(module.time, "time_ns", lambda: wall() + slept)
    assert clock.now() - clock.wall >= slept
    assert abs(clock.drift()) < 100_000_000
