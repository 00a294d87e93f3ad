"""A run over a part of an archive says nothing of the rest, and leaves what the whole run said."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from sniff.cli import fleet, main

ILL = Path(__file__).parents[3] / "captures" / "rtu-usual-faults.cap.txt"


def test_what_was_not_looked_at_is_neither_gone_nor_new(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = tmp_path / "archive"
    for site in ("east", "west"):
        (folder / site).mkdir(parents=True)
        shutil.copy(ILL, folder / site / "x.cap.txt")
    asked = ["fleet", "--workers", "1", "--json", "--index", str(tmp_path / "x.sqlite")]

    def told(*more: str) -> list[dict[str, object]]:
        main([*asked, *more])
        return [json.loads(line) for line in capsys.readouterr().out.splitlines()]

    told(str(folder))
    for less in (("--since", "2090-01-01", str(folder)), (str(folder / "east"),)):
        assert not [one for one in told(*less) if "gone" in one]
    again = told(str(folder))
    assert not [one for one in again if "gone" in one]
    findings = [one for bus in again for one in bus.get("findings", ())]  # type: ignore[attr-defined]
    assert findings
    assert {one["since_last_run"] for one in findings} == {"stays"}


@pytest.mark.parametrize(
    ("word", "hours"),
    [("2026-01-02", 0), ("2026-01-02T02:00+02:00", 0), ("2026-01-02T02:00", 2), ("2026-01-02T02Z", 2)],
)
def test_a_zone_that_is_said_counts(word: str, hours: int) -> None:
    assert fleet._day(word) == 1_767_312_000_000_000_000 + hours * 3600 * 10**9
