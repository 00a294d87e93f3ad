"""Every register, bit, code, parameter, object, error and printed frame of the devices' manuals, put on a line, and
what the program says of it: by a table of the facts (`facts.tsv`), not by the profiles.
`python -m tests.sniff.manuals.counts` prints them by section.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.sniff.manuals.counts import summed
from tests.sniff.manuals.fact import UNSEEN, Fact, facts
from tests.sniff.manuals.telling import wrong

KNOWN = facts()
DEVICES = list(dict.fromkeys(fact.device for fact in KNOWN))


@pytest.mark.parametrize("device", DEVICES)
def test_what_the_manual_says_is_said(device: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    chosen = [fact for fact in KNOWN if fact.device == device]
    amiss = dict(wrong(chosen, tmp_path))
    with capsys.disabled():
        print(f"\n{device}: {summed(chosen, amiss)}", end=" ")
    assert not amiss


def untrue(fact: Fact) -> Fact:
    """The opposite of a fact."""
    if fact.how.startswith("range"):
        return fact._replace(raw=fact.raw + (-1 if fact.said == "most" else 1))
    if fact.how.startswith("access"):
        return fact._replace(said="read only" if fact.said == "writable" else "writable")
    if fact.how.startswith("check"):
        return fact._replace(said="PR001" if fact.said == "fine" else "fine")
    if fact.how == "n2 without unit":
        return fact._replace(place="AI 9")
    if fact.how in ("profile", "rule"):
        return fact._replace(said=f"{fact.said} not so")
    return fact._replace(said=fact.said.removeprefix("!") if fact.said.startswith("!") else f"!{fact.said}")


@pytest.mark.parametrize("device", DEVICES)
def test_what_is_untrue_is_noticed(device: str, tmp_path: Path) -> None:
    some = {fact.how: fact for fact in KNOWN if fact.device == device and fact.how != UNSEEN}
    lies = [untrue(fact) for fact in some.values()]
    assert {fact.how for fact, _ in wrong(lies, tmp_path)} == some.keys()


def test_the_table_has_every_fact_once() -> None:
    assert len(set(KNOWN)) == len(KNOWN)
    assert {fact.how for fact in KNOWN if not fact.said} <= {"n2 without unit"}
