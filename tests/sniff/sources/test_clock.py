from __future__ import annotations

import time

import pytest

from sniff.sources import clock as module
from sniff.sources.clock import Clock


def test_progress_is_monotonic_from_the_anchor() -> None:
    clock = Clock(1_000_000, 5_000)
    assert clock.at(5_000) == 1_000_000
    assert clock.at(5_250) == 1_000_250
    before = time.monotonic_ns()
    now = clock.now()
    assert clock.at(before) <= now <= clock.at(time.monotonic_ns())


def test_drift_is_what_the_wall_clock_stepped(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = Clock.start()
    real = time.time_ns
    monkeypatch.setattr(module.time, "time_ns", lambda: real() + 7_000_000_000)
    assert abs(clock.drift() - 7_000_000_000) < 100_000_000
