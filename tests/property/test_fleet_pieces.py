"""A recording in pieces tells the same as in one: rows, verdicts, counts, times; and of the rules what does not depend
on what they learnt before the piece."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from dissectors.findings import Severity
from dissectors.frame import Chunk
from sniff.fleet import codec, pieces
from sniff.fleet.archive import NS_PER_S, Task, files_below, tasks_of
from sniff.fleet.bus_day import BusDay
from sniff.fleet.reading import read_task
from sniff.fleet.running import Collecting, do
from sniff.formats import read
from sniff.recording import part
from sniff.recording.rotation import Rotation
from sniff.recording.writer import SharedFile
from sniff.simulation.tap import EXACT, FTDI, TapModel
from tests.sniff.fleet.made_archive import Plan, case, clean, write

SECONDS = 40.0
BUSES: dict[str, TapModel] = {
    "RTU bit errors everywhere": EXACT,
    "RTU station absent": FTDI,
    "ASCII answers lost": EXACT,
    "N2 station absent": EXACT,
    "MS/TP lost token": EXACT,
    "PROFIBUS answers lost": EXACT,
}


@dataclass(frozen=True, repr=False)
class Made:
    """A task, and what it gives when it is read in one go."""

    task: Task
    whole: list[BusDay]


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Made]:
    """In chunks as small as those of a live recording; the last one in parts."""
    folder = tmp_path_factory.mktemp("pieces")
    tasks = {}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(part, "CHUNK_SIZE", 2048)
        for number, (name, tap) in enumerate(BUSES.items()):
            plan = Plan("site", f"bus-{number}", clean("RTU clean, exact", SECONDS), case(name), range(1))
            path = write(folder / f"{number}", plan, 0, SECONDS, tap)
            ((tasks[name],), _) = tasks_of(files_below([str(path)]))
    parts = folder / "parts"
    parts.mkdir()
    rotate(next(iter(tasks.values())).files[0].path, parts)
    ((tasks["in parts"],), _) = tasks_of(files_below([str(parts)]))
    assert len(tasks["in parts"].files) > 3
    return {name: Made(task, read_task(task)) for name, task in tasks.items()}


def rotate(path: str, folder: Path) -> None:
    """The same recording in parts, as `record --rotate` writes them."""
    capture = read(path)
    (recorder,) = SharedFile(folder / "site.mcap", [capture.session], Rotation(count=400)).recorders()
    for item in capture.items():
        assert isinstance(item, Chunk)
        recorder.chunk(item)
        recorder.tick(item.time)
    recorder.finish()
    recorder.close()


def counted(days: list[BusDay]) -> list[dict[str, Any]]:
    """All but what rules say."""
    values = json.loads(codec.encode(days))
    for day in values:
        day.pop("judged")
    return values


@pytest.mark.parametrize("name", [*BUSES, "in parts"])
@settings(max_examples=2, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.data())
def test_pieces_tell_the_same(
    name: str,
    made: dict[str, Made],
    monkeypatch: pytest.MonkeyPatch,
    data: st.DataObject,
) -> None:
    monkeypatch.setattr(pieces, "BEFORE", 10 * NS_PER_S)
    monkeypatch.setattr(pieces, "AFTER", 5 * NS_PER_S)
    task, whole = made[name].task, made[name].whole
    most = data.draw(st.integers(task.size // 5, task.size // 2))
    cut = pieces.cut(task, most)
    assert len(cut) > 1
    collecting = Collecting(cut)
    given_back = [collecting.add(do(piece)) for piece in data.draw(st.permutations(cut))]
    assert given_back[:-1] == [None] * (len(cut) - 1)
    done = given_back[-1]
    assert done is not None
    assert done.failed is None
    assert done.task == task
    assert counted(list(done.days)) == counted(whole)
    (day,), (expected,) = done.days, whole
    assert {one.key for one in day.findings if one.severity >= Severity.WARNING} == {
        one.key for one in expected.findings if one.severity >= Severity.WARNING
    }
