"""`sniff485 box`: all buses for ever; ports that come and go, power cuts, a capture that dies, a service manager."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import textwrap
from collections.abc import Iterator
from pathlib import Path

import pytest

from dissectors.modbus.envelope import seal_rtu
from sniff.box.status import State
from sniff.recording.reader import buses_of
from sniff.recording.rotation import parts

pytest.importorskip("termios")

from tests.e2e.box_bench import ROOT, Bench, bench
from tests.e2e.recording_bus import capture_processes, wait_until
from tests.e2e.running import rest_of

POLL, ANSWER = seal_rtu(b"\1\3\0\0\0\2"), seal_rtu(b"\1\3\4\0\1\0\2")


@pytest.fixture
def box(tmp_path: Path) -> Iterator[Bench]:
    with bench(tmp_path, "boiler", "roof") as made:
        made.sockets["boiler"].plug()
        yield made


def test_ports_come_and_go_and_it_says_so(box: Bench) -> None:
    boiler, roof = box.sockets.values()
    process = box.start()
    box.manager.until("WATCHDOG=1")
    boiler.send(POLL + ANSWER)
    wait_until(lambda: box.bus("boiler").octets == len(boiler.sent), "the octets are not on the status page")
    assert box.bus("boiler").state is State.HEARD
    assert box.bus("roof").state is State.DOWN
    assert box.bus("roof").why == "no such port"
    assert not box.status().is_well

    roof.plug()
    wait_until(lambda: box.bus("roof").state is not State.DOWN, "the port was never found")
    roof.send(POLL)
    wait_until(lambda: box.bus("roof").state is State.HEARD, "nothing was heard")
    assert box.status().is_well

    boiler.unplug()
    wait_until(lambda: box.bus("boiler").state is State.DOWN, "nobody noticed")
    assert box.bus("boiler").downs == 1
    roof.send(ANSWER)
    box.until_written()
    wait_until(lambda: box.bus("roof").octets == len(roof.sent), "the octets are not on the status page")

    words = [sys.executable, "-m", "sniff", "box", "status"]
    asked = subprocess.run(words, cwd=box.folder, env=box.environment(), capture_output=True, text=True)
    assert asked.returncode == 1, asked.stderr
    assert "DOWN" in asked.stdout
    told = subprocess.run([*words, "--json"], cwd=box.folder, env=box.environment(), capture_output=True, text=True)
    assert json.loads(told.stdout)["buses"][1]["octets"] == len(roof.sent)

    second = subprocess.run([*words[:-1]], cwd=box.folder, env=box.environment(), capture_output=True, text=True)
    assert second.returncode == 2
    assert f"box site runs already: process {process.pid}" in second.stderr

    box.manager.hear()
    assert box.end(process) == 0, box.said
    assert "STOPPING=1" in box.manager.hear()
    assert all(one.completeness().whole for one in buses_of(box.folder / "parts" / "site-0001.mcap"))
    assert not box.page.exists()


def test_after_a_power_cut_the_cut_part_is_closed(box: Bench) -> None:
    boiler, roof = box.sockets.values()
    roof.plug()
    process = box.start()
    boiler.send(POLL + ANSWER)
    roof.send(POLL)
    box.until_written()
    for pid in (process.pid, box.capture()):  # as the power does
        os.kill(pid, signal.SIGKILL)
    rest_of(process)
    (number, cut), *_ = parts(box.folder / "parts" / "site.mcap")
    assert not buses_of(cut)[0].completeness().whole

    process = box.start()
    wait_until(lambda: box.status().recovered, "nothing is said of the cut part")
    (told,) = box.status().recovered
    assert (told.name, told.closed) == (cut.name, True)
    boiler.send(POLL)
    box.until_written()
    assert box.end(process) == 0, box.said
    assert f"{cut.name} was cut where an earlier run ended" in box.said
    for capture in buses_of(cut):
        assert capture.completeness().whole
        assert capture.session.notes["recovered"] == told.text
    assert [number for number, _ in parts(box.folder / "parts" / "site.mcap")] == [number, number + 1]


def test_a_capture_that_dies_is_begun_anew(box: Bench) -> None:
    boiler, roof = box.sockets.values()
    roof.plug()
    process = box.start()
    boiler.send(POLL)
    wait_until(lambda: box.bus("boiler").octets == len(POLL), "the octets are not on the status page")
    dead = box.capture()
    os.kill(dead, signal.SIGKILL)
    wait_until(lambda: box.status().restarts == 1 and box.status().recording, "no capture was begun anew")
    assert box.capture() != dead
    assert "SIGKILL" in box.status().last_restart
    boiler.send(ANSWER)
    wait_until(lambda: box.bus("boiler").octets == len(boiler.sent), "what came before is not counted any more")
    wait_until(lambda: [one.closed for one in box.status().recovered] == [True], "its part was left cut")
    assert box.end(process) == 0, box.said


CLOCK = """
    import os, time

    real = time.time_ns

    def time_ns():
        return real() + (86_400_000_000_000 if os.path.exists(os.environ["CLOCK_IS_SET"]) else 0)

    time.time_ns = time_ns
"""


def test_a_clock_that_is_set_costs_nothing(box: Bench) -> None:
    boiler, roof = box.sockets.values()
    roof.plug()
    (box.folder / "sitecustomize.py").write_text(textwrap.dedent(CLOCK))
    box.more = {"CLOCK_IS_SET": str(box.folder / "set"), "PYTHONPATH": os.pathsep.join((str(box.folder), str(ROOT)))}
    process = box.start()
    for one in (boiler, roof):
        one.send(POLL + ANSWER)
    wait_until(lambda: box.status().is_well, "not all is well")
    before = box.status()
    (box.folder / "set").touch()  # the first answer of a time server
    wait_until(lambda: box.status().clock_offset > 86_000 * 10**9, "nobody noticed")
    for one in (boiler, roof):
        one.send(POLL + ANSWER)
    box.until_written()
    wait_until(lambda: box.bus("roof").octets == len(roof.sent), "the octets are not on the status page")
    after = box.status()
    assert after.is_well
    assert after.now - before.now > 86_000 * 10**9
    assert after.since - before.since > 86_000 * 10**9
    assert {one.code for bus in after.buses for one in bus.findings} <= {"LN007"}
    assert box.end(process) == 0, box.said


def test_under_a_supervisor_that_only_starts_it_again(box: Bench) -> None:
    """A box that is killed leaves its capture, which goes on; the next one takes its place."""
    boiler, roof = box.sockets.values()
    roof.plug()
    command = f"until {sys.executable} -m sniff box; do echo again >&2; done"
    shell = box.spawn(["sh", "-c", command])
    box.manager.until("READY=1")
    first, capture = box.status().pid, box.capture()
    boiler.send(POLL)
    box.manager.words.clear()
    os.kill(first, signal.SIGKILL)
    roof.send(POLL)  # nobody but the capture is there
    box.manager.until("READY=1")
    assert box.status().pid != first
    assert capture not in capture_processes(box.folder)
    boiler.send(ANSWER)
    box.until_written()
    os.kill(box.status().pid, signal.SIGTERM)
    said = rest_of(shell)[1]
    assert shell.returncode == 0, said
    assert said.count("again") == 1
    assert f"capture process {capture} of the box before went on without it" in said
