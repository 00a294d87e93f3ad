"""What the pytest plugin says where something is missing: expectations, kinds of frames, their parts."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest

from sniff.testing import craft, expectation_path, read_capture, render
from sniff.testing.crafting import makers
from sniff.testing.naming import is_capture
from tests.sniff.testing.other_pytest import pytest_command

CAPTURE = "#!sniff-capture 1\n# line: 19200,8E1\n# protocol: modbus-rtu\n+0 01 03 00 00 00 02 C4 0B\n"


def pytest_in(folder: Path, *arguments: str) -> str:
    environment = {key: value for key, value in os.environ.items() if not key.startswith(("PYTEST", "COV"))}
    command = pytest_command(*arguments)
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, timeout=100).stdout


@pytest.fixture
def project(tmp_path: Path) -> Path:
    (tmp_path / "pyproject.toml").write_text('[tool.pytest.ini_options]\nsniff_captures = ["captures"]\n')
    (tmp_path / "captures").mkdir()
    (tmp_path / "captures" / "poll.cap.txt").write_text(CAPTURE)
    return tmp_path


def test_captures_without_expectation_are_said(project: Path) -> None:
    (project / "test_other.py").write_text("def test_it():\n    pass\n")
    ran = pytest_in(project)
    assert f"1 capture without expectation: sniff485 snapshot {Path('captures/poll.cap.txt')} writes it" in ran
    assert "1 passed" in ran
    pytest_in(project, "--sniff-update")
    ran = pytest_in(project)
    assert "without expectation" not in ran
    assert "2 passed" in ran


def test_a_log_of_which_something_is_expected_is_a_test(project: Path) -> None:
    """And a protocol that is not known is one line."""
    log, unknown = project / "captures" / "x.log", project / "captures" / "poll.cap.txt"
    log.write_text("01 03 00 00 00 02 C4 0B\n")
    unknown.write_text(CAPTURE.replace("modbus-rtu", "modbus-rt"))
    expectation_path(unknown).write_text("")
    assert not is_capture(log)
    expectation_path(log).write_text(render(read_capture(log)))
    assert is_capture(log)
    assert not is_capture(expectation_path(log))
    ran = pytest_in(project)
    assert "1 failed, 1 passed" in ran
    assert "poll.cap.txt: protocol 'modbus-rt' is not installed" in ran
    assert "Traceback" not in ran
    assert "def runtest" not in ran


def test_many_are_counted(project: Path) -> None:
    for number in range(5):
        (project / "captures" / f"more-{number}.cap.txt").write_text(CAPTURE)
    ran = pytest_in(project)
    assert "6 captures without expectation: sniff485 snapshot " in ran
    assert " and 3 more writes it" in ran


def test_an_unknown_kind_lists_those_there_are() -> None:
    with pytest.raises(ValueError, match="'nix': expected one of modbus-rtu, modbus-ascii, n2, n2-answer, mstp"):
        craft("nix")


@pytest.mark.parametrize("parts", [{"station": 1}, {}, {"text": "0A4", "unit": 1}, {"text": b"0A4"}])
def test_wrong_parts_list_the_right_ones(parts: dict[str, object]) -> None:
    with pytest.raises(ValueError, match=r"craft 'n2': .*; its parts are text: str$"):
        craft("n2", **parts)


def test_the_readme_shows_every_kind_as_it_works() -> None:
    readme = (Path(__file__).parents[3] / "sniff" / "testing" / "README.md").read_text(encoding="utf-8")
    shown = [part.split("`")[0] for part in readme.split("`craft(")[1:]]
    examples = [f"craft({one}" for one in shown if "…" not in one]
    assert all(eval(one, {"craft": craft}) for one in examples)
    assert {one.split('"')[1] for one in examples} == {*makers()}
