"""A log without times: how soon the master went on is not known."""

from __future__ import annotations

from pathlib import Path

from dissectors.n2.envelope import make_answer, make_command
from sniff.testing.capture_reading import read_capture


def test_a_station_that_is_off_is_not_taken_for_one_that_the_tap_does_not_hear(tmp_path: Path) -> None:
    """The master tries it once, and goes on to another one."""
    lines: list[bytes] = []
    for at in range(20):
        lines += [make_command(f"01110A{at % 4:02X}"), make_answer("0042480000"), make_command("0904")]
        lines += [make_command(f"02110A{at % 4:02X}"), make_answer("0042480000")]
    path = tmp_path / "n2.hex"
    path.write_text("".join(f"{line.hex(' ').upper()}\n" for line in lines))
    told = {(one.code, one.subject) for one in read_capture(path).findings}
    assert ("N2005", "station 9") in told
    assert not any(code == "N2015" for code, _ in told)
