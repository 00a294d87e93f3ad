"""The facts of the devices' manuals, counted: `python -m tests.sniff.manuals.counts [DEVICE …]` prints the table, and
what is wrong.
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Collection, Iterator, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from tests.sniff.manuals.fact import UNSEEN, Fact, facts
from tests.sniff.manuals.telling import wrong


def table(chosen: Sequence[Fact], amiss: Collection[Fact]) -> Iterator[str]:
    """One line a section: facts, right, wrong, not to be seen on a line; and why, one by one."""
    yield f"{'manual':20} {'section':66} {'facts':>6} {'right':>6} {'wrong':>6} {'unseen':>7}"
    sections = dict.fromkeys((fact.device, fact.section) for fact in chosen)
    sums: Counter[str] = Counter()
    for device, section in sections:
        some = [fact for fact in chosen if (fact.device, fact.section) == (device, section)]
        unseen = sum(fact.how == UNSEEN for fact in some)
        bad = sum(fact in amiss for fact in some)
        yield f"{device:20} {section:66} {len(some):6} {len(some) - unseen - bad:6} {bad:6} {unseen:7}"
        sums.update({"facts": len(some), "right": len(some) - unseen - bad, "wrong": bad, "unseen": unseen})
    yield f"{'sum':87} {sums['facts']:6} {sums['right']:6} {sums['wrong']:6} {sums['unseen']:7}"
    for fact in chosen:
        if fact.how == UNSEEN:
            yield f"not to be seen: {fact.device}: {fact.place}: {fact.said}"


def summed(chosen: Sequence[Fact], amiss: Collection[Fact]) -> str:
    """ "2153 facts, 2148 right, 0 wrong, 5 not to be seen"."""
    unseen = sum(fact.how == UNSEEN for fact in chosen)
    right = len(chosen) - unseen - len(amiss)
    return f"{len(chosen)} facts, {right} right, {len(amiss)} wrong, {unseen} not to be seen"


def main(devices: Sequence[str]) -> int:
    """Print the table; 1 where something is wrong."""
    known = facts()
    amiss: dict[Fact, str] = {}
    with TemporaryDirectory() as folder:
        for device in devices or dict.fromkeys(fact.device for fact in known):
            amiss.update(wrong([fact for fact in known if fact.device == device], Path(folder)))
    chosen = [fact for fact in known if not devices or fact.device in devices]
    print("\n".join(table(chosen, amiss.keys())))
    for fact, said in amiss.items():
        print(f"\nwrong: {fact}\n    {said[:300]}")
    return 1 if amiss else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
