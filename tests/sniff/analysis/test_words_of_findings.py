"""What findings say is what was seen and no more: whose it is, by how much, and which of a rule's causes are left."""

from __future__ import annotations

from pathlib import Path

import pytest

from dissectors.findings import Finding
from sniff.testing.capture_reading import read_capture

FINDINGS = Path(__file__).parents[3] / "captures/findings"


def found(capture: str, code: str, subject: str = "") -> Finding:
    """The one finding of a capture by this rule (about this subject)."""
    made = read_capture(FINDINGS / f"{capture}.cap.txt").findings
    (one,) = (one for one in made if one.code == code and subject in ("", one.subject))
    return one


@pytest.mark.parametrize(
    ("capture", "code"),
    [
        ("rtu-bit-errors-of-one-station", "LN101"),
        ("rtu-bit-errors-of-the-master", "LN101"),
        ("rtu-bit-errors-of-one-station", "MB005"),
        ("ftdi-write-repeated-at-once", "MB007"),
    ],
)
def test_what_struck_one_alone_a_few_times_is_not_said_to_strike_all(capture: str, code: str) -> None:
    one = found(capture, code)
    assert "whoever sends" not in one.seen
    assert "a cause common to all" not in one.means
    assert "with whom" in one.next


def test_senders_are_listed_in_the_order_of_their_addresses_and_who_is_not_known_last() -> None:
    one = found("ftdi-two-masters-that-ask-the-same", "LN101")
    assert one.seen.endswith("(master: 8, station 1: 12, station 2: 7, station 3: 10, station 4: 8, unknown: 1)")


def test_noise_beside_the_frames_of_one_alone_is_not_said_to_be_beside_everybodys() -> None:
    assert "whoever sends" not in found("line-noise-anywhere-held-back", "LN203").seen
    assert "whoever sends" in found("line-noise-anywhere", "LN203").seen


def test_n2_damage_is_everybodys_only_where_there_is_enough_of_several() -> None:
    assert "too few to say whose" in found("n2-bit-errors-everywhere", "N2004").seen
    assert "too few to say whose" in found("n2-answers-into-the-next-station", "N2004", "bus").seen  # 3 is named
    assert "of each sender about as much" in found("line-hum-beside-n2", "N2004").seen


def test_a_comparison_with_frames_that_were_not_struck_is_not_told() -> None:
    assert "elsewhere" not in found("rtu-answers-into-the-next-station-no-repeats", "MB106").seen


def test_of_the_causes_of_a_rule_only_those_are_told_that_are_left() -> None:
    assert "driver" not in found("n2-checksum-off", "N2012").means
    assert "too soon" in found("n2-last-octet-missing", "N2012").means
    assert "too late" in found("n2-first-octet-of-all-missing", "N2012").means
    assert "adapter" in found("n2-first-octet-of-all-missing", "N2012").means  # all stations have it
    assert "ordered" in found("n2-reset-that-was-ordered", "N2001").means
    assert "not heard" not in found("n2-late-in-another-s-turn", "N2011").means
    assert "damaged" in found("n2-bit-errors-of-the-master", "N2009").means
