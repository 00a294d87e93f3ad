"""A device that was told to be silent by DeviceCommunicationControl: that it does not answer has its cause."""

from __future__ import annotations

import pytest

from dissectors.bacnet import MSTP
from dissectors.bacnet.findings import judge
from dissectors.bacnet.told_silent import ToldSilent
from dissectors.findings import Finding
from dissectors.frame import Frame
from tests.dissectors.bacnet.make_ring_captures import ordered_to_be_silent
from tests.dissectors.bacnet.ring_script import Step, script

_AFTER = "no answer to 5 requests, all after MAC 3 had told it to be silent"


def _said(steps: list[Step]) -> Finding:
    read, silent = script(steps), ToldSilent()
    for no, event in enumerate(read.events):
        silent.see(no, event, MSTP.peek(event) if isinstance(event, Frame) else None)
    (finding,) = (one for one in silent.told(judge(read.ring)) if one.code == "MS301")
    return finding


@pytest.mark.parametrize(
    ("order", "seen"),
    [("1901", f"{_AFTER} until it is told otherwise"), ("090a1901", f"{_AFTER} for 10 min")],
)
def test_who_was_told_to_be_silent(order: str, seen: str) -> None:
    assert _said(ordered_to_be_silent(order)).seen == seen


@pytest.mark.parametrize("steps", [ordered_to_be_silent("1902"), ordered_to_be_silent("1901", refused=True)])
def test_who_was_not(steps: list[Step]) -> None:
    """To begin nothing by itself is no silence; a wrong password is no order."""
    assert _said(steps).seen == "no answer to 5 requests"


def test_what_was_missed_before_or_after_is_not_explained() -> None:
    silence = ordered_to_be_silent("1901")
    assert _said(silence[-35:] + silence).seen == "no answer to 10 requests"
    assert _said([*silence, *ordered_to_be_silent("1900")]).seen == "no answer to 10 requests"
