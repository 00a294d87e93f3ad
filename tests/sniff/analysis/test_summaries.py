"""Many stretches counted at once are what each is alone."""

from __future__ import annotations

from pathlib import Path

import pytest

from sniff.analysis.summaries import summaries
from sniff.analysis.summary import Summary
from sniff.engine.bulk import BulkEngine
from sniff.formats import read

CAPTURES = Path(__file__).parents[3] / "captures"


@pytest.mark.parametrize("step", [1, 7, 1000])
@pytest.mark.parametrize(
    "name", ["rtu-usual-faults", "mstp-usual-faults", "n2-usual-faults", "findings/line-breaks-of-one-station"]
)
def test_each_stretch_counts_as_if_alone(name: str, step: int) -> None:
    capture = read(CAPTURES / f"{name}.cap.txt")
    engine, line = BulkEngine(capture.session), capture.session.line
    tables = [engine.take(item) for item in capture.blocks()]
    for table in (*tables, engine.close()):
        stops = sorted({*range(0, len(table), step), len(table)})  # the first is empty
        made = summaries(line, table, stops)
        begins = [0, *stops[:-1]]
        for begin, stop, counted in zip(begins, stops, made, strict=True):
            alone = Summary(line)
            if stop > begin or len(table) == 0:
                alone.add_table(table.part(begin, stop))
            assert counted.load.total == alone.load.total
            assert sorted(counted.nodes.nodes.items()) == sorted(alone.nodes.nodes.items())
            for what in ("frames", "damaged", "noise", "octets", "searched", "verdicts", "latency", "marks"):
                assert getattr(counted, what) == getattr(alone, what), what
