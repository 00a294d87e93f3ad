"""An hour of 115200 Bd without a pause, and an hour of ordinary polling, through engine, store and recorder.

    python -m pytest tests/bench/test_simulated_hour.py -o norecursedirs=.venv -s

says how much processor time it took, how fast that is against the bus's own time, and how much memory it needed.
"""

from __future__ import annotations

import os
import time
from pathlib import Path

import pytest

from dissectors import registry
from dissectors.frame import Chunk
from sniff.bus.rows import Store
from sniff.engine.engine import Engine
from sniff.recording.writer import Recorder
from sniff.simulation.scenarios import scenario, simulate
from sniff.simulation.tap import FTDI_LOW_LATENCY, TapModel

HOUR = 3600
KEEP = 100_000


@pytest.mark.slow
@pytest.mark.timeout(3600)
@pytest.mark.parametrize(("name", "tap"), [("modbus-rtu-busy", FTDI_LOW_LATENCY), ("modbus-rtu", FTDI_LOW_LATENCY)])
def test_an_hour_in_flat_memory(name: str, tap: TapModel, tmp_path: Path) -> None:
    plan = scenario(name, seed=11)
    simulated = _simulation_alone(name, tap)
    session, items = simulate(plan, HOUR, tap)
    dissector = registry.get(plan.protocol)
    engine, store = Engine(dissector, session.timing), Store(session, dissector, keep=KEEP)
    recorder = Recorder(tmp_path / "hour.mcap", session)
    began = time.process_time()
    memory: dict[int, int] = {}
    for item in items:
        if isinstance(item, Chunk):
            recorder.chunk(item)
            store.add(engine.feed(item))
        else:
            recorder.line(item)
        minute = item.time // (60 * 10**9)
        if minute not in memory:
            memory[minute] = _resident()
    store.add(engine.close())
    recorder.close()
    took = time.process_time() - began
    octets, frames = recorder.octets, store.last_no
    half, end = memory[30], memory[59]
    print(
        f"\n{name}: {frames} frames, {octets / 1e6:.1f} MB in {took:.0f} s of processor time, {simulated:.0f} s of it "
        f"the simulation; "
        f"{HOUR / (took - simulated):.0f} times as fast as the bus; "
        f"MB of memory after a minute {memory[1] / 1e6:.0f}, half an hour {half / 1e6:.0f}, the hour {end / 1e6:.0f}"
    )
    assert end < half + 16_000_000


def _simulation_alone(name: str, tap: TapModel) -> float:
    began = time.process_time()
    for _ in simulate(scenario(name, seed=11), HOUR, tap)[1]:
        pass
    return time.process_time() - began


def _resident() -> int:
    with open("/proc/self/statm", encoding="ascii") as statm:
        return int(statm.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")
