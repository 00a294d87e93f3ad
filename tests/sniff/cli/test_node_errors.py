"""What was wrong with answers is said of who answered; a damaged request is the frame of who asked."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

OURS = Path(__file__).parents[3] / "captures"


@pytest.mark.parametrize("way", [[], ["--reference"]], ids=["columns", "rows"])
def test_a_token_that_was_cut_is_no_error_of_who_was_to_have_it(sniff485: Callable[..., Any], way: list[str]) -> None:
    told = json.loads(sniff485("info", "--json", *way, str(OURS / "mstp-usual-faults.cap.txt")).out)
    nodes = {node["address"]: (node["damaged"], node["errors"]) for node in told["nodes"]}
    assert nodes[2] == (1, {})
    assert nodes[5] == (0, {})


@pytest.mark.parametrize("way", [[], ["--reference"]], ids=["columns", "rows"])
def test_what_was_wrong_with_an_answer_is_said_of_who_answered(sniff485: Callable[..., Any], way: list[str]) -> None:
    told = json.loads(sniff485("info", "--json", *way, str(OURS / "mstp-noisy-ftdi.cap.txt")).out)
    assert [node["errors"] for node in told["nodes"]].count({}) >= 3
    told = json.loads(sniff485("info", "--json", *way, str(OURS / "n2-noisy-ftdi.cap.txt")).out)
    assert told["nodes"][0]["errors"]


def test_how_often_an_error_was_is_told_from_the_numbers_in_it(sniff485: Callable[..., Any]) -> None:
    path = OURS / "findings" / "line-a-drive-still-speaks-bacnet.cap.txt"
    counts = json.loads(sniff485("info", "--json", path).out)["nodes"][0]["errors"]
    said = sniff485("info", path).out
    often = max(counts, key=lambda error: counts[error])
    assert any(character.isdigit() for character in often)
    assert f"{counts[often]} × {often}; " in said
