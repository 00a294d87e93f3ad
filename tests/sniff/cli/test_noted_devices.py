"""A capture that names its devices: every command that can say more because of it does, and flags win."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from sniff.testing import read_capture, render

Run = Callable[..., Any]
CAPTURE = Path(__file__).parents[3] / "captures" / "findings" / "drive-trips.cap.txt"


@pytest.fixture
def named(tmp_path: Path) -> Callable[[str], Path]:
    """A capture of two drives, one of which has tripped, that says of them what is given."""

    def write(*devices: str) -> Path:
        lines = [line for line in CAPTURE.read_text().splitlines() if not line.startswith("# device:")]
        lines[1:1] = [f"# device: {device}" for device in devices]
        path = tmp_path / "named.cap.txt"
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")
        return path

    return write


def test_check_points_and_show_know_the_devices(sniff485: Run, named: Callable[..., Path]) -> None:
    path = named("2=teco-e510")
    checked = sniff485("check", path)
    assert checked.code == 1
    assert "code 17, external fault 01" in checked.out
    assert "external fault 01" in sniff485("points", path).out
    assert "external fault 01" in sniff485("show", path).out
    assert "external fault" not in sniff485("points", named()).out
    assert sniff485("check", named()).code == 0


def test_a_flag_wins(sniff485: Run, named: Callable[..., Path]) -> None:
    path = named("2=teco-e510")
    assert "PR004" in sniff485("check", path, "--only", "PR").out
    assert "PR004" not in sniff485("check", path, "-d", "2=automationdirect-acn").out
    assert "PR004" in sniff485("check", named("2=automationdirect-acn"), "-d", "2=teco-e510").out


def test_a_device_that_is_not_known_here_is_said(sniff485: Run, named: Callable[..., Path]) -> None:
    path = named("1=teco-e510", "2=no-such-drive")
    ran = sniff485("check", path, "--fail-on", "never")
    assert ran.code == 0
    assert "2=no-such-drive" in ran.err
    assert "-d" in ran.err
    reading = read_capture(path)
    assert reading.devices == {"1": "teco-e510"}
    assert reading.unknown_devices == ("2=no-such-drive",)
    assert "# devices not known here: '2=no-such-drive'" in render(reading)


@pytest.mark.parametrize("suffix", ["cap.txt", "mcap", "pcapng"])
def test_formats_with_a_session_keep_them(
    suffix: str, sniff485: Run, named: Callable[..., Path], tmp_path: Path
) -> None:
    other = tmp_path / f"other.{suffix}"
    assert sniff485("convert", named("2=teco-e510"), other).code == 0
    assert read_capture(other).devices == {"2": "teco-e510"}
    assert "PR004" in {finding.code for finding in read_capture(other).findings}


def test_convert_notes_what_the_flag_says(sniff485: Run, named: Callable[..., Path], tmp_path: Path) -> None:
    other = tmp_path / "other.cap.txt"
    assert sniff485("convert", named(), other, "-d", "2=teco-e510").code == 0
    assert "# device: 2=teco-e510" in other.read_text()
