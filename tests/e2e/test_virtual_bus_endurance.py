"""A simulated bus for a long time through everything that a live capture runs: memory must not grow with it.

The whole hour, with its times, is tests/bench/test_simulated_hour.py.
"""

from __future__ import annotations

import gc
import sys
from pathlib import Path

import pytest

from dissectors import registry
from dissectors.frame import Chunk
from sniff.bus.rows import Store
from sniff.engine.engine import Engine
from sniff.recording.writer import Recorder
from sniff.simulation.scenarios import scenario, simulate
from sniff.simulation.tap import FTDI_LOW_LATENCY
from tests.seeds import IS_SEARCH

WARM, WHOLE = 10, 45  # simulated seconds
KEEP = 500  # rows: full long before the warm-up ends


@pytest.mark.parametrize(
    ("recording", "kept"),
    # a kept row is over ten; what the rules and the register series remember fills up to its bounds meanwhile
    # (analysis alone, where one searches: what it keeps is kept with a recording too)
    [(True, 5.0), (False, 4.5)] if IS_SEARCH else [(True, 5.0)],
)
def test_memory_does_not_grow_with_the_length_of_a_capture(recording: bool, kept: float, tmp_path: Path) -> None:
    plan = scenario("modbus-rtu-busy", seed=5)
    session, items = simulate(plan, WHOLE, FTDI_LOW_LATENCY)
    dissector = registry.get(plan.protocol)
    engine, store = Engine(dissector, session.timing), Store(session, dissector, keep=KEEP)
    recorder = Recorder(tmp_path / "long.mcap", session) if recording else None
    warm: tuple[int, int] | None = None
    for item in items:
        assert isinstance(item, Chunk)  # this adapter stays plugged in
        store.add(engine.feed(item))
        if recorder is not None:
            recorder.chunk(item)
        if warm is None and item.time > WARM * 10**9:
            warm = (_blocks(), store.last_no)
    assert warm is not None
    grown, frames = _blocks() - warm[0], store.last_no - warm[1]
    if recorder is not None:
        recorder.close()
        assert recorder.lost_octets == 0
    assert frames > 3_000
    assert len(store) <= KEEP * 1.1
    assert grown / frames < kept, "blocks of memory kept for each frame"


def _blocks() -> int:
    """Blocks of memory in use by Python objects."""
    gc.collect()
    return sys.getallocatedblocks()
