"""The pytest plugin, used as its users would: a project of its own, run by pytest in another process."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests.sniff.testing.other_pytest import pytest_command

EXAMPLE = Path(__file__).parent / "example_project"
Run = Callable[..., subprocess.CompletedProcess[str]]


@pytest.fixture
def project(tmp_path: Path) -> Path:
    return shutil.copytree(EXAMPLE, tmp_path / "project")


@pytest.fixture
def run(project: Path) -> Run:
    def pytest_in(*arguments: str) -> subprocess.CompletedProcess[str]:
        environment = {key: value for key, value in os.environ.items() if not key.startswith(("PYTEST", "COV"))}
        return subprocess.run(
            pytest_command(*arguments), cwd=project, env=environment, capture_output=True, text=True, timeout=100
        )

    return pytest_in


def test_the_example_project_passes(run: Run) -> None:
    ran = run("--sniff-strict")
    assert ran.returncode == 0, ran.stdout
    assert "6 passed" in ran.stdout


def test_a_changed_capture_fails_with_a_diff_and_update_accepts_it(project: Path, run: Run) -> None:
    path = project / "captures" / "poll.cap.txt"
    path.write_text(path.read_text().replace("01 83 02 C0 F1", "01 83 02 C0 F2"))
    ran = run("captures")
    assert ran.returncode == 1
    assert "-    6" in ran.stdout
    assert "+    6" in ran.stdout
    assert "DAMAGED" in ran.stdout
    assert "--sniff-update" in ran.stdout
    assert run("--sniff-update", "captures").returncode == 0
    path.write_text(path.read_text() + "# another comment\n")
    assert run("captures").returncode == 0


def test_a_capture_without_expectation_is_an_error_only_when_strict(project: Path, run: Run) -> None:
    (project / "captures" / "poll.expect.txt").unlink()
    assert "no tests ran" in run("captures").stdout
    ran = run("--sniff-strict", "captures")
    assert ran.returncode == 1
    assert "no expectation" in ran.stdout


def test_a_damaged_capture_is_said_without_a_traceback(project: Path, run: Run) -> None:
    (project / "captures" / "poll.cap.txt").write_text("#!sniff-capture 1\n+0 01 0G\n")
    ran = run("captures")
    assert ran.returncode == 1
    assert "poll.cap.txt:2" in ran.stdout
    assert "Traceback" not in ran.stdout
    assert "accept it" not in ran.stdout  # there is nothing to accept


def test_captures_elsewhere_are_left_alone(project: Path, run: Run) -> None:
    other = project / "other"
    shutil.copytree(project / "captures", other)
    listed = run("--collect-only").stdout
    assert "captures/poll.cap.txt" in listed
    assert "other" not in listed


def test_loading_the_plugin_loads_nothing_heavy() -> None:
    heavy = ("textual", "numpy", "scapy", "mcap", "hypothesis")
    code = f"import sys, sniff.testing.plugin; print([name for name in {heavy} if name in sys.modules])"
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True)
    assert ran.stdout.strip() == "[]"


def test_virtual_bus_and_replay_give_ports(virtual_bus: Callable, replay: Callable, tmp_path: Path) -> None:
    bus = virtual_bus("modbus-rtu", faults=False)
    pid = bus.pid
    assert Path(bus.tap()).exists()
    with bus:  # it runs already
        assert bus.pid == pid
    path = tmp_path / "poll.cap.txt"
    path.write_text((EXAMPLE / "captures" / "poll.cap.txt").read_text())
    assert b"".join(_read(replay(path, speed=100), 31)) == bytes.fromhex(
        "010300000002C40B 01030400D7001ACBC0 00 010300000002C40B 0103000000".replace(" ", "")
    )


def _read(port: str, count: int) -> Iterator[bytes]:
    with open(port, "rb", buffering=0) as stream:
        while count > 0:
            octets = stream.read(count)
            count -= len(octets)
            yield octets
