"""An archive judged: who is ill since when, the same by any number of workers and in any order, an index that knows."""

from __future__ import annotations

import json
import os
import random
import re
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from threading import Thread

import pytest

from dissectors import registry
from dissectors.frame import Chunk
from dissectors.histogram import Histogram
from dissectors.line import LineSettings
from sniff.analysis.judging import Judging
from sniff.analysis.summary import Summary
from sniff.bus.offline import survey
from sniff.cli import main
from sniff.engine.capture import CaptureError
from sniff.engine.session import Session
from sniff.fleet import codec, running
from sniff.fleet import index as index_module
from sniff.fleet.answer import Answer, Change, Fresh, answer, marks
from sniff.fleet.archive import FileState, Task, files_below, tasks_of
from sniff.fleet.bus_day import Archive, BusDay, Judged, empty_summary
from sniff.fleet.drift import DriftSureness
from sniff.fleet.html import page as html_page
from sniff.fleet.index import Index
from sniff.fleet.reading import read_task
from sniff.fleet.text import page
from sniff.fleet.values import COLUMNS, as_values, rows
from sniff.formats import read
from sniff.recording.rotation import Rotation
from sniff.recording.writer import SharedFile
from tests.sniff.fleet.made_archive import FAULTS, Plan, plans, write, wrong_in

SECONDS, DAYS, BUSES = 12.0, 3, 11
Made = tuple[Path, list[Plan]]


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Made:
    folder = tmp_path_factory.mktemp("archive")
    planned = plans(BUSES, FAULTS, DAYS, SECONDS)
    for plan in planned:
        for day in range(DAYS):
            write(folder, plan, day, SECONDS)
    return folder, planned


@pytest.fixture(scope="module")
def days(made: Made) -> list[BusDay]:
    tasks, unreadable = tasks_of(files_below([str(made[0])]))
    assert not unreadable
    return [day for task in tasks for day in read_task(task)]


def whole(days: list[BusDay]) -> Archive:
    archive = Archive()
    for day in days:
        archive.add(day)
    return archive


def values_of(found: Answer) -> str:
    return json.dumps(list(as_values(found)), sort_keys=True)


def test_exactly_the_ill_buses_are_named_on_exactly_their_days(made: Made, days: list[BusDay]) -> None:
    archive = whole(days)
    found = answer(archive)
    assert list(wrong_in(found, archive, made[1])) == []
    assert len(found.buses) == BUSES
    worst = [(not bus.is_ill, bus.health.score) for bus in found.buses]
    assert worst == sorted(worst)
    assert {bus.bus for bus in found.buses if bus.troubles} == {plan.bus for plan in made[1] if plan.fault is not None}


def test_the_answer_does_not_depend_on_order(days: list[BusDay]) -> None:
    days = [*days, *(replace(day, day="2026-03-01") for day in days)]  # several captures a bus and day, some ill
    expected = values_of(answer(whole(days)))
    for seed in range(4):
        shuffled = random.Random(seed).sample(days, len(days))
        assert values_of(answer(whole(shuffled))) == expected


def test_a_copy_counts_once_and_is_named(days: list[BusDay]) -> None:
    """A recording and the file in which what was found in it is kept."""
    copies = [replace(day, sources=tuple(f"{path}-found" for path in day.sources)) for day in days]
    once = answer(whole(days))
    for given in ([*days, *copies], [*copies, *days]):
        twice = answer(whole(given))
        assert [(bus.days, bus.troubles) for bus in twice.buses] == [(bus.days, bus.troubles) for bus in once.buses]
        notes = {note for bus in twice.buses for note in bus.notes}
        assert sum("hold the same octets: counted once" in note for note in notes) == len(days)


def test_two_recordings_in_which_nothing_was_heard_are_two() -> None:
    silent = BusDay("", "b", "p", "modbus-rtu", "2026-03-01", "9600,8N1", empty_summary("9600,8N1"), sources=("a",))
    archive = whole([silent, replace(silent, sources=("b",))])
    (day,) = archive.days.values()
    assert (day.sources, day.notes) == (("a", "b"), ())


def test_what_the_index_keeps_is_what_was_read(days: list[BusDay]) -> None:
    again = codec.decode(codec.encode(days))
    assert codec.encode(again) == codec.encode(days)
    assert values_of(answer(whole(again))) == values_of(answer(whole(days)))
    assert [day.findings for day in again] == [day.findings for day in days]


@pytest.mark.skipif(not running.available(), reason="Dask is not installed")
def test_processes_give_the_same_and_no_scapy_is_beside_dask(made: Made, days: list[BusDay]) -> None:
    program = (
        "import sys\n"
        "from sniff.cli import main\n"
        f"main(['fleet', '--no-index', '--workers', '2', '--json', {str(made[0])!r}])\n"
        "print(sorted(name for name in sys.modules if name.split('.')[0] in ('scapy', 'textual')))\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    *told, loaded = done.stdout.splitlines()
    assert loaded == "[]"
    assert [json.loads(line) for line in told] == json.loads(values_of(answer(whole(days))))


def test_a_second_run_reads_only_what_is_new(
    made: Made, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "archive"
    shutil.copytree(made[0], folder)
    for path in folder.rglob("day-*.mcap"):
        if path.name != "day-1.mcap" or path.parent.name not in ("trunk-00", "trunk-01", "trunk-04", "trunk-05"):
            path.unlink()
    read: list[str] = []
    whole_do = running.do
    monkeypatch.setattr(running, "do", lambda task: read.append(task.files[0].path) or whole_do(task))
    asked = ["fleet", "--workers", "1", "--json", str(folder)]
    main(asked)
    first = capsys.readouterr().out
    assert len(read) == 4
    read.clear()
    looked: list[str] = []
    whole_look = index_module.look
    monkeypatch.setattr(index_module, "look", lambda file: looked.append(file.path) or whole_look(file))
    main(asked)
    assert (read, looked) == ([], [])
    assert _without_freshness(capsys.readouterr().out) == _without_freshness(first)
    shutil.copy(made[0] / "north/trunk-00/day-3.mcap", folder / "north/trunk-00/day-3.mcap")
    main(asked)
    assert read == looked == [str(folder / "north/trunk-00/day-3.mcap")]
    said = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    fresh = {one["since_last_run"] for bus in said for one in bus.get("findings", ())}
    assert fresh == {"new"}
    read.clear()
    other = {"modbus-rtu": "another"}
    whole_code = index_module.code_of
    monkeypatch.setattr(index_module, "code_of", lambda protocol: other.get(protocol) or whole_code(protocol))
    main(asked)
    assert {Path(path).parent.name for path in read} == {"trunk-00", "trunk-01"}  # only what that code reads


def _without_freshness(text: str) -> list[dict[str, object]]:
    said = [json.loads(line) for line in text.splitlines()]
    for bus in said:
        for one in bus.get("findings", ()):
            one.pop("since_last_run")
    return said


def test_new_and_gone_since_the_run_before(days: list[BusDay]) -> None:
    early = answer(whole([day for day in days if day.day == "2026-03-01"]))
    later = answer(whole(days), marks(early))
    assert {one.fresh for bus in later.buses for one in bus.troubles} == {Fresh.NEW}
    again = answer(whole(days), marks(later))
    assert {one.fresh for bus in again.buses for one in bus.troubles} == {Fresh.STAYS}
    well = answer(whole([day for day in days if not day.findings]), marks(later))
    assert set(well.gone) == marks(later)


def test_a_file_that_cannot_be_read_is_told_with_its_reason(
    made: Made, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.copy(made[0] / "north/trunk-00/day-1.mcap", tmp_path / "a.mcap")
    (tmp_path / "b.mcap").write_bytes(b"no recording")
    cut = (made[0] / "south/trunk-01/day-1.mcap").read_bytes()
    (tmp_path / "c.mcap").write_bytes(cut[: len(cut) // 2])
    os.utime(tmp_path / "c.mcap", (0, 0))
    (tmp_path / "growing.mcap").write_bytes(cut[: len(cut) // 2])
    assert main(["fleet", "--no-index", "--workers", "1", str(tmp_path)]) == 3
    out = capsys.readouterr().out
    assert f"not read: {tmp_path}/b.mcap: no byte log" in out
    assert "c.mcap" not in out
    assert "growing" not in out
    assert "trunk-01" in out


def test_no_such_folder_is_said(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["fleet", "/nowhere"]) == 3
    assert "/nowhere: no such file or folder" in capsys.readouterr().err


def test_workers_load_no_scapy(made: Made) -> None:
    """Its licence and Dask's libraries stay in processes of their own."""
    program = (
        "import sys\n"
        "from sniff.fleet.archive import FileState, Task, files_below, tasks_of\n"
        "from sniff.fleet.running import do\n"
        f"tasks, _ = tasks_of(files_below([{str(made[0])!r}]))\n"
        "assert all(do(task).failed is None for task in tasks[::5])\n"
        "print(sorted(name for name in sys.modules if name.split('.')[0] in ('scapy', 'textual')))\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_the_pages_say_it(days: list[BusDay]) -> None:
    found = answer(whole(days))
    text = "\n".join(page(found))
    assert "11 buses of 3 sites, 2026-03-01 … 2026-03-03: 6 with something wrong, 5 well" in text
    assert re.search("MB001 station 4, since 03-02, 2 days, [0-9]+×: no answer to any of", text)
    for width, height in ((80, 24), (60, 10), (20, 3)):
        screen = list(page(found, len(found.buses), width, height))
        assert max(map(len, screen)) <= width
        assert len(screen) <= max(height, 8)
    assert sum("trunk-" in line for line in page(found, len(found.buses))) == BUSES
    html = html_page(found)
    assert "<script" not in html
    assert "http" not in html
    assert html.count("<tr><td>") >= BUSES
    links = re.findall('href="#(bus[0-9]+)"', html)
    assert len(links) >= 6
    assert all(f'id="{link}"' in html for link in links)


def test_the_table_has_stations_that_are_there_and_what_is_wrong(days: list[BusDay]) -> None:
    table = [dict(zip(COLUMNS, row, strict=True)) for row in rows(whole(days))]
    ring = {row["station"] for row in table if row["protocol"] == "mstp"} - {None}
    assert ring
    assert len(ring) < 10  # of 128 that are polled for
    ill = {row["bus"] for row in table if row["findings"]}
    assert ill == {bus.bus for bus in answer(whole(days)).buses if bus.troubles}


def test_hostile_names_are_inert(days: list[BusDay]) -> None:
    evil = [replace(day, bus="\x1b]0;x\x07<img src=x>") for day in days[:1]]
    found = answer(whole(evil))
    assert "\x1b" not in "\n".join(page(found))
    assert "<img" not in html_page(found)


def copied(day: BusDay) -> BusDay:
    return codec.decode(codec.encode([day]))[0]


def slowed(day: BusDay, milliseconds: int) -> BusDay:
    """The same day with other response times."""
    slow = copied(day)
    for node in slow.summary.nodes:
        node.latency = Histogram()
        for _ in range(200):
            node.latency.add(milliseconds * 1_000_000)
    return slow


def test_stations_that_come_and_go(days: list[BusDay]) -> None:
    day = next(one for one in days if one.protocol == "modbus-rtu" and one.health().bus.score == 100)
    without = copied(day)
    gone = max(without.summary.nodes.nodes)
    del without.summary.nodes.nodes[gone]
    found = answer(whole([
        replace(without, day="2026-03-01"), replace(day, day="2026-03-02"), replace(day, day="2026-03-04"),
        replace(day, day="2026-03-06"), replace(without, day="2026-03-07"),
    ]))  # fmt: skip
    (bus,) = found.buses
    assert bus.missing == ("2026-03-03", "2026-03-05")
    changes = {(one.station, one.change, one.day) for one in bus.changes if one.station == gone}
    assert changes == {(gone, Change.CAME, "2026-03-02"), (gone, Change.WENT, "2026-03-06")}


def test_a_station_that_slows_down_is_told_with_how_sure(days: list[BusDay]) -> None:
    day = next(one for one in days if one.protocol == "modbus-rtu" and one.health().bus.score == 100)
    for times, sure in (([10, 10, 20], DriftSureness.UNSURE), ([10, 12, 14, 17, 20, 22, 25], DriftSureness.SURE)):
        made = [replace(slowed(day, each), day=f"2026-03-{at:02}") for at, each in enumerate(times, 1)]
        (bus,) = answer(whole(made)).buses
        assert {(one.change, one.drift and one.drift.sure) for one in bus.changes} == {(Change.SLOWER, sure)}
    assert "sure: 1 in 2520 by chance" in "\n".join(page(answer(whole(made))))
    assert "ms in 30 days" in html_page(answer(whole(made)))
    late = [replace(slowed(day, 100 * each), day=f"2026-03-{at:02}") for at, each in enumerate(times, 1)]
    assert "<td class=n>1100<td class=n>2350<td class=n>+7500<" in html_page(answer(whole(late)))
    steady = [replace(slowed(day, 10 + at % 2), day=f"2026-03-{at:02}") for at in range(1, 20)]
    (bus,) = answer(whole(steady)).buses
    assert bus.changes == ()
    assert {one.sure for one in bus.drifts} == {DriftSureness.UNSURE}


def test_buses_that_record_nothing(days: list[BusDay]) -> None:
    """One hears nothing any more, another is not recorded any more, a third never was but twice."""
    day = next(one for one in days if one.protocol == "modbus-rtu" and one.health().bus.score == 100)
    session = Session(day.bus, LineSettings.parse(day.line), day.protocol)
    nothing = Judged(0, "x", Judging(session, registry.get(day.protocol)).judgement())
    deaf = replace(day, summary=empty_summary(day.line), busy=0, first=None, last=None, judged=(nothing,))
    found = answer(whole([
        *(replace(day, bus="well", day=f"2026-03-{at:02}") for at in range(1, 9)),
        *(replace(day if at < 7 else deaf, bus="deaf", day=f"2026-03-{at:02}") for at in range(1, 9)),
        *(replace(day, bus="stopped", day=f"2026-03-{at:02}") for at in range(1, 5)),
        *(replace(day, bus="weekly", day=f"2026-03-{at:02}") for at in (1, 7)),
    ]))  # fmt: skip
    buses = {bus.bus: bus for bus in found.buses}
    assert {name for name, bus in buses.items() if bus.is_ill} == {"deaf", "stopped"}
    assert buses["deaf"].silent == ("2026-03-07", "2026-03-08")
    assert [(one.finding.code, one.days) for one in buses["deaf"].troubles] == [("LN002", buses["deaf"].silent)]
    assert buses["stopped"].stopped == "2026-03-04"
    text = "\n".join(page(found))
    assert "nothing was heard on 2026-03-07, 2026-03-08" in text
    assert "no capture since 2026-03-04, while other buses go on" in text


def test_two_runs_at_once_do_not_harm_the_index(tmp_path: Path) -> None:
    """Both read, both keep what they found, and each sees all of it afterwards."""
    path = tmp_path / "x.sqlite"
    tasks = [Task("site", (FileState(f"{number}.mcap", 1, 1),), "n2") for number in range(30)]

    def run(mine: list[Task]) -> None:
        index = Index(path)
        for task in mine:
            index.put(task, [])
            index.flush()
        index.say(["folder"], ["something"])

    threads = [Thread(target=run, args=(tasks[at::2] + tasks[:3],)) for at in (0, 1)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert all(found is not None for _, found in Index(path).known(tasks))
    assert Index(path).said_before(["folder"]) == {"something"}


def test_what_is_known_of_a_file_is_forgotten_when_it_changes(made: Made, tmp_path: Path) -> None:
    index = Index(tmp_path / "x.sqlite")
    (site, file), *_ = files_below([str(made[0] / "north/trunk-00")])
    first = tasks_of([(site, file)], look=index.look())
    index.keep_looks()
    assert tasks_of([(site, file)], look=index.look()) == first
    changed = FileState(str(tmp_path / "not there"), file.size, file.changed)
    assert tasks_of([(site, changed)], look=index.look())[1][0].why.startswith("no such file")
    with index._reach() as base:
        base.execute("UPDATE file SET begins = 'nonsense'")
    assert tasks_of([(site, file)], look=index.look()) == first


def known(index: Index, task: Task) -> list[BusDay] | None:
    ((_, days),) = index.known([task])
    return days


def test_an_index_of_somebody_else_is_refused_or_read_again(made: Made, tmp_path: Path) -> None:
    (tmp_path / "x.sqlite").write_bytes(b"this is no data base at all, " * 100)
    with pytest.raises(CaptureError, match="cannot be used"):
        Index(tmp_path / "x.sqlite")
    tasks, _ = tasks_of(files_below([str(made[0] / "north/trunk-00")]))
    index = Index(tmp_path / "y.sqlite")
    index.put(tasks[0], read_task(tasks[0]))
    index.flush()
    assert known(index, tasks[0]) is not None
    with index._reach() as base:
        base.execute("""UPDATE task SET days = '[{"site": 1}]'""")
    assert known(index, tasks[0]) is None
    with index._reach() as base:
        base.execute("UPDATE task SET days = '[1, null]'")
    assert known(index, tasks[0]) is None
    day = json.loads(codec.encode(read_task(tasks[0])))
    day[0]["summary"]["nodes"] = []
    with index._reach() as base:
        base.execute("UPDATE task SET days = ?", (json.dumps(day),))
    assert known(index, tasks[0]) is None
    index.say(["folder"], ["something"])
    with index._reach() as base:
        base.execute("UPDATE said SET value = '{'")
    assert index.said_before(["folder"]) is None


def test_a_folder_that_cannot_be_looked_into_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tmp_path / "north" / "trunk"
    folder.mkdir(parents=True)
    listed = os.scandir

    def refusing(path: str) -> object:
        if Path(path) == folder:
            raise PermissionError(13, "Permission denied", str(path))
        return listed(path)

    monkeypatch.setattr(os, "scandir", refusing)
    _, unreadable = tasks_of(files_below([str(tmp_path)]))
    assert [(one.site, one.file.path, one.why) for one in unreadable] == [
        ("north", str(folder), "a folder that cannot be looked into")
    ]


@pytest.mark.skipif(sys.platform != "linux", reason="names are text elsewhere")
def test_names_that_are_no_text_and_names_like_patterns(tmp_path: Path, made: Made) -> None:
    folder = tmp_path / "plant [2]"
    folder.mkdir()
    (_, file), *_ = files_below([str(made[0] / "north/trunk-00")])
    shutil.copy(file.path, os.fsencode(folder / "caf") + b"\xe9.mcap")
    found = files_below([str(folder)])
    assert [state.size for _, state in found] == [file.size]
    index = Index(tmp_path / "x.sqlite")
    for _ in range(2):
        tasks, _ = tasks_of(found, look=index.look())
        index.keep_looks()
        index.put(tasks[0], [])
        index.flush()
        index.forget_all_but(tasks)
    assert known(index, tasks[0]) == []


def test_a_recording_of_several_buses_is_several_buses(made: Made, tmp_path: Path) -> None:
    """One file for all ports of a site, in parts that were copied on another day than they were recorded."""
    captures = [
        read(made[0] / f"{site}/{bus}/day-2.mcap") for site, bus in (("north", "trunk-00"), ("south", "trunk-10"))
    ]
    file = SharedFile(tmp_path / "site.mcap", [one.session for one in captures], Rotation(count=300))
    recorders = file.recorders()
    items = sorted(
        ((item.time, bus, item) for bus, one in enumerate(captures) for item in one.items()), key=lambda one: one[:2]
    )
    for time, bus, item in items:
        assert isinstance(item, Chunk)
        recorders[bus].chunk(item)
        recorders[1 - bus].tick(time)
    for recorder in recorders:
        recorder.finish()
    for recorder in recorders:
        recorder.close()
    assert len(recorders[0].paths) > 2
    tasks, unreadable = tasks_of(files_below([str(tmp_path)]))
    assert not unreadable
    assert [task.bus for task in tasks] == ["trunk-00", "trunk-10"]
    assert all(len(task.files) == len(recorders[0].paths) for task in tasks)
    told = {day.bus: day for task in tasks for day in read_task(task)}
    for capture in captures:
        alone = Summary(capture.session.line)
        survey(capture, capture.session, alone)
        day = told[capture.session.bus]
        assert (day.summary.frames, day.summary.octets, day.notes) == (alone.frames, alone.octets, ())


def test_since_leaves_out_days_before_it(made: Made, capsys: pytest.CaptureFixture[str]) -> None:
    main(["fleet", "--no-index", "--workers", "1", "--json", "--since", "2026-03-03", str(made[0] / "north")])
    said = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert {day["day"] for bus in said for day in bus["days"]} == {"2026-03-03"}
