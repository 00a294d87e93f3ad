"""The example of a plug-in dissector, as its author would use it: found by its entry point, held to the contract."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Callable
from pathlib import Path

import pytest

from sniff.cli import main
from tests.sniff.testing.other_pytest import pytest_command

EXAMPLE = Path(__file__).parent / "example_plugin"
GROUP = "sniff485.dissectors"
Run = Callable[..., subprocess.CompletedProcess[str]]

CAPTURE = """\
#!sniff-capture 1
# line: 4800,8N1
# protocol: nmea
# start: 2026-03-01T10:00:00Z
+50 "$SDDBT,12.0*74\\r\\n"
+50 "$SDDBT,12.1*74\\r\\n"
+50 "$SDDBT,12.0*74\\r\\n"
"""

UNSHRUNK = """\
from hypothesis import Phase, settings

settings.register_profile("first", phases=[Phase.generate], database=None)
settings.load_profile("first")
"""
"""The first failing example is enough here: finding the smallest takes seconds."""


USE = """
from sniff.simulation.scenarios import bursts, scenario
from sniff.testing.crafting import craft
print(craft("nmea", body=b"SDDBT,12.0").decode().strip())
print(sum(len(burst.sent) for burst in bursts(scenario("nmea", faults=False), 1.99)))
"""

SEVERAL = """
import contextlib, io, json, sys
from sniff.cli import main
said = []
for words in json.loads(sys.argv[1]):
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            code = main(words)
        except SystemExit as end:
            code = end.code
    said.append({"code": code, "out": out.getvalue(), "err": err.getvalue()})
print(json.dumps(said))
"""
"""Several commands in one process: starting it is most of what one costs."""


@pytest.fixture
def installed(tmp_path: Path) -> Path:
    """A folder with the plug-in as an installer would leave it: modules, and a record of its entry points."""
    place = shutil.copytree(EXAMPLE, tmp_path / "site", ignore=shutil.ignore_patterns("__pycache__", ".*"))
    project = tomllib.loads((EXAMPLE / "pyproject.toml").read_text())["project"]
    record = place / "sniff485_nmea-1.dist-info"
    record.mkdir()
    (record / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {project['name']}\nVersion: {project['version']}\n")
    points = "".join(f"{name} = {target}\n" for name, target in project["entry-points"][GROUP].items())
    (record / "entry_points.txt").write_text(f"[{GROUP}]\n{points}")
    return place


@pytest.fixture
def run(installed: Path) -> Run:
    environment = {key: value for key, value in os.environ.items() if not key.startswith(("PYTEST", "COV"))}
    environment["PYTHONPATH"] = str(installed)

    def python(*arguments: object) -> subprocess.CompletedProcess[str]:
        module, *rest = arguments
        is_pytest = module == "pytest"
        command = pytest_command(*rest, hypothesis=True) if is_pytest else [sys.executable, "-m", *map(str, arguments)]
        return subprocess.run(command, cwd=installed, env=environment, capture_output=True, text=True, timeout=100)

    return python


def test_its_framer_passes_the_contract(run: Run) -> None:
    ran = run("pytest", "test_sniff485_nmea.py")
    assert ran.returncode == 0, ran.stdout
    assert "8 passed" in ran.stdout


def test_a_broken_framer_fails_it_and_says_why(run: Run, installed: Path) -> None:
    module = installed / "sniff485_nmea.py"
    broken = module.read_text().replace("== check_of(", "!= check_of(")
    assert broken != module.read_text()
    module.write_text(broken)
    (installed / "conftest.py").write_text(UNSHRUNK)
    ran = run("pytest", "-k", "clean", "test_sniff485_nmea.py")
    assert ran.returncode == 1, ran.stdout
    assert "AssertionError: assert [" in ran.stdout, "a failure inside the suite shows its values"


def test_commands_know_the_protocol(run: Run, installed: Path) -> None:
    (installed / "boat.cap.txt").write_text(CAPTURE)
    (installed / "several.py").write_text(SEVERAL)
    fields = ("-T", "fields", "-e", "nmea.sentence", "-Y", 'nmea.sentence == "sddbt"')
    commands = [
        ["show", "boat.cap.txt"], ["show", "boat.cap.txt", *fields], ["--help"], ["check", "boat.cap.txt"],
        ["snapshot", "boat.cap.txt"], ["show", "-p", "no-such", "boat.cap.txt"],
    ]  # fmt: skip
    ran = run("several", json.dumps(commands))
    assert ran.returncode == 0, ran.stderr
    shown, named, helped, checked, written, refused = json.loads(ran.stdout)
    assert shown["code"] == 0, shown["err"]
    assert shown["out"].count("$SDDBT,12.0*74") == 2
    assert named["out"].split() == ["sddbt"] * 3, named["err"]
    assert "NMEA 0183" in helped["out"]
    assert checked["code"] == 0, checked["err"]
    assert written["code"] == 0, written["err"]
    assert "DAMAGED check" in (installed / "boat.expect.txt").read_text()
    assert "nmea" in refused["err"]


def test_it_is_simulated_and_crafted(run: Run, installed: Path) -> None:
    (installed / "use.py").write_text(USE)
    ran = run("use")
    assert ran.stdout.split() == ["$SDDBT,12.0*74", "20"], ran.stderr


@pytest.mark.parametrize("command", ["show", "info", "stats", "check", "points", "snapshot", "diff", "anonymise"])
def test_a_capture_of_a_protocol_that_is_not_installed_is_one_clear_line(
    command: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    capture = tmp_path / "boat.cap.txt"
    capture.write_text(CAPTURE)
    files = [capture, capture] if command == "diff" else [capture]
    options = {"snapshot": ["--check"], "anonymise": ["-o", tmp_path / "out.cap.txt"]}.get(command, [])
    assert main([command, *map(str, (*files, *options))]) in (2, 3)
    said = capsys.readouterr().err
    assert said.count("\n") == 1, said
    assert "nmea" in said
    assert "modbus-rtu" in said
