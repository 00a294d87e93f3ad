"""What is wrong with a command line is one line that says where to read more."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from tests.sniff.cli.conftest import Ran

CLEAN = Path(__file__).parents[3] / "captures" / "rtu-clean.cap.txt"


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("show",), "sniff485 show: the following arguments are required: FILE; `sniff485 show --help` says more"),
        (("show", CLEAN, "--bogus"), "sniff485: show: does not know --bogus; `sniff485 show --help` says "),
        (("show", CLEAN, "--bo\x1bgus"), "sniff485: show: does not know --bo\\x1bgus; "),
        (("check", "--format", "\x1b[2J", CLEAN), "sniff485 check: argument --format: invalid choice: '\\x1b[2J' "),
        (("stats", CLEAN, "nodes", "--every", "5s"), "sniff485: --every is the length of a row of load, "),
        (("stats", CLEAN, "--duration", "5s"), "sniff485: --duration is for a port; "),
        (("check", CLEAN, "--duration", "5s"), "sniff485: --duration is for a port; "),
        (("points", CLEAN, "--duration", "5s"), "sniff485: --duration is for a port; "),
    ],
)
def test_it_is_one_line(words: tuple[object, ...], said: str, sniff485: Callable[..., Ran]) -> None:
    ran = sniff485(*words)
    assert (ran.code, ran.out) == (2, "")
    assert ran.err.startswith(said)
    assert len(ran.err.splitlines()) == 1
