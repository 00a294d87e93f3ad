"""The contract of outlets: never waited for, dropped from with a count; what each makes of what it is told."""

from __future__ import annotations

import json
import os
import threading
from pathlib import Path

import pytest

from sniff.outlet_settings import FileSettings, SettingsError
from sniff.outlets import json_lines
from sniff.outlets.outlet import AT_THE_END, Outlet, close_all
from sniff.outlets.stream import StreamOutlet
from tests.sniff.outlets.given import KeptOutlet, finding, numbers, state, value


def test_one_that_hangs_holds_nobody_up_and_loses_the_oldest_with_a_count() -> None:
    outlet = KeptOutlet(most=100)
    outlet.start()
    for number in range(300):
        outlet.tell([value(float(number))])
    outlet.go.set()
    outlet.close(60)
    assert outlet.sent + outlet.dropped == 300
    assert outlet.dropped >= 199
    assert [one.sample.value.value for one in outlet.got][-100:] == [float(one) for one in range(200, 300)]  # type: ignore[union-attr]


def test_its_end_is_not_waited_for() -> None:
    outlet = KeptOutlet()
    outlet.start()
    outlet.tell([value()] * 50)
    outlet.close(0.0)
    assert outlet.dropped >= 49
    outlet.go.set()


def test_several_that_hang_take_no_longer_than_one(monkeypatch: pytest.MonkeyPatch) -> None:
    now = 0.0

    class Hanging(KeptOutlet):
        def close(self, patience: float = AT_THE_END) -> None:
            nonlocal now
            assert all(one.closing for one in outlets), "they end at the same time"
            now += patience

    monkeypatch.setattr("sniff.outlets.outlet.time.monotonic", lambda: now)
    outlets = [Hanging() for _ in range(3)]
    close_all(outlets)
    assert now == AT_THE_END


def test_one_that_breaks_is_said_and_breaks_nothing() -> None:
    class Broken(Outlet):
        def _run(self) -> None:
            raise RuntimeError("the password is geheim")

    said: list[str] = []
    outlet = Broken("broken", said.append)
    outlet.start()
    outlet.tell([value()])
    outlet.close(60)
    assert said == ["broken: ended: RuntimeError"]
    assert outlet.dropped == 1


def lines_into(path: str, **more: int) -> StreamOutlet:
    return StreamOutlet("json", FileSettings(path), json_lines.line, lambda text: None, **more)


def test_lines_go_into_a_file_and_behind_what_is_there(tmp_path: Path) -> None:
    path = tmp_path / "values.jsonl"
    path.write_text('{"record": "older"}\n')
    outlet = lines_into(str(path))
    outlet.start()
    outlet.tell([value(), finding(), numbers(), numbers(station="3"), state()])
    outlet.close(60)
    records = [json.loads(line) for line in path.read_text().splitlines()]
    assert [one["record"] for one in records] == ["older", "value", "finding", "health", "health", "state"]
    assert (records[1]["point"], records[1]["value"], records[1]["unit"]) == ("output-frequency", 60.0, "Hz")
    assert "device" not in records[3]
    assert records[4]["device"] == "3"
    assert outlet.sent == 5


def test_a_file_is_bounded(tmp_path: Path) -> None:
    path = tmp_path / "values.jsonl"
    for turn in range(4):
        outlet = lines_into(str(path), most_size=4000)
        outlet.start()
        outlet.tell([value(float(turn))] * 10)
        outlet.close(60)
        assert outlet.sent == 10
    assert sorted(one.name for one in tmp_path.iterdir()) == ["values.jsonl", "values.jsonl.1"]
    assert all(one.stat().st_size < 4000 for one in tmp_path.iterdir())
    assert json.loads(path.read_text().splitlines()[-1])["value"] == 3.0


@pytest.mark.parametrize("anew", [False, True])
def test_a_full_file_that_somebody_moved_away_is_begun_anew(tmp_path: Path, anew: bool) -> None:
    path, moved = tmp_path / "values.jsonl", tmp_path / "values.jsonl.1"
    outlet = lines_into(str(path), most_size=4000)
    outlet._write(["x" * 3000])
    path.rename(moved)
    if anew:
        path.touch()
    assert outlet._write(["y" * 3000])
    assert outlet.trouble == ""
    assert moved.read_text() == "x" * 3000 + "\n"
    assert path.read_text() == "y" * 3000 + "\n"
    os.close(outlet._descriptor)


def test_a_file_that_cannot_be_begun_anew_is_no_other_file(tmp_path: Path) -> None:
    path = tmp_path / "values.jsonl"
    outlet = lines_into(str(path), most_size=4000)
    outlet._write(["x" * 3000])
    (tmp_path / "values.jsonl.1").mkdir()
    assert outlet._write(["y" * 3000])
    assert "Is a directory" in outlet.trouble
    other = os.open(tmp_path / "other", os.O_WRONLY | os.O_CREAT)
    outlet._write(["z" * 3000])
    os.close(other)
    assert (tmp_path / "other").read_text() == ""
    os.close(outlet._descriptor)


def test_a_pipe_that_nobody_reads_holds_nobody_up(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    outlet = lines_into(str(pipe))
    outlet.start()
    told = 0
    while not outlet.dropped:  # the pipe and the box are full then
        outlet.tell([value()] * 500)
        told += 500
        assert told < 1_000_000
    outlet.close(0.05)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    while outlet._thread.is_alive():  # what hung in it goes on
        try:
            os.read(reader, 1 << 20)
        except BlockingIOError:
            outlet._thread.join(0.01)
    os.close(reader)


def test_nobody_reads_standard_output_any_more(monkeypatch: pytest.MonkeyPatch) -> None:
    read, write = os.pipe()
    os.close(read)
    said: list[str] = []
    outlet = StreamOutlet("json", FileSettings("-"), json_lines.line, said.append)
    outlet._descriptor = write
    outlet.start()
    outlet.tell([value()])
    outlet.tell([value()])
    outlet.close(60)
    os.close(write)
    assert said == ["json: -: Broken pipe"]
    assert (outlet.sent, outlet.dropped) == (0, 2)


def test_a_file_that_cannot_be_written_is_said_at_once(tmp_path: Path) -> None:
    with pytest.raises(SettingsError, match="Is a directory"):
        lines_into(str(tmp_path))


def test_what_a_terminal_obeys_is_escaped_and_no_number_is_no_json() -> None:
    line = json_lines.line(value("\x1b[31m\u202e", name="a\nb"))
    assert line is not None
    assert line.isprintable()
    assert json.loads(line)["point"] == "a\nb"
    assert json.loads(json_lines.line(value(float("nan"))) or "")["value"] == "nan"


def test_threads_end() -> None:
    assert not [one for one in threading.enumerate() if one.name in ("broken",)]
