"""What the program says of a fact of a manual: in the rows of `show`, in what a profile finds, in `profile show`."""

from __future__ import annotations

import contextlib
import io
import json
import re
from collections.abc import Iterable, Iterator, Sequence
from itertools import accumulate, pairwise
from pathlib import Path
from typing import Any

from dissectors.frame import Chunk
from dissectors.line import MS, LineSettings
from dissectors.profiles import Devices
from dissectors.profiles.packaged import packaged
from sniff.analysis.judging import all_rules
from sniff.analysis.profile_findings import ProfileFindings
from sniff.bus.offline import outputs
from sniff.cli import main
from sniff.engine.engine import Output, Row
from sniff.engine.follow_settings import dissector_for
from sniff.engine.session import Session
from tests.sniff.manuals.fact import UNSEEN, Asked, Exchange, Fact
from tests.sniff.manuals.frames import JUDGED, SHOWN

BETWEEN = 100.0
"""ms from one exchange to the next."""


def wrong(chosen: Sequence[Fact], folder: Path) -> Iterator[tuple[Fact, str]]:
    """The facts of one device that the program does not say, each with what it says."""
    yield from _wrongly_shown(chosen, folder)
    yield from _wrongly_judged(chosen)
    yield from _wrongly_guessed([fact for fact in chosen if fact.how == "bacnet device"], folder)
    described = ran("profile", "show", chosen[0].device).lower().splitlines() if chosen else []
    for fact in chosen:
        if fact.how == "profile" and not any(_holds(line, fact.said.lower().split(" … ")) for line in described):
            yield fact, "no line of `profile show` says it"
        if fact.how == "rule" and fact.said not in (text := _rule(fact.place)):
            yield fact, text
    known = {*SHOWN, *JUDGED, "profile", "rule", UNSEEN}
    yield from ((fact, "asked in no known way") for fact in chosen if fact.how not in known)


def ran(*arguments: str) -> str:
    """What a command prints."""
    told = io.StringIO()
    with contextlib.redirect_stdout(told), contextlib.redirect_stderr(io.StringIO()):
        main(list(arguments))
    return told.getvalue()


def _holds(line: str, parts: Iterable[str]) -> bool:
    """Whether a line has all of the parts, one after the other."""
    at = 0
    for part in parts:
        at = line.find(part, at)
        if at < 0:
            return False
        at += len(part)
    return True


def _rule(code: str) -> str:
    rule = all_rules()[code]
    return f"{rule.explanation} {rule.means} {rule.next}"


# --- what `show` says ---


def _wrongly_shown(chosen: Sequence[Fact], folder: Path) -> Iterator[tuple[Fact, str]]:
    for line, protocol in dict.fromkeys(SHOWN[fact.how][:2] for fact in chosen if fact.how in SHOWN):
        some = [fact for fact in chosen if fact.how in SHOWN and SHOWN[fact.how][:2] == (line, protocol)]
        exchanges = [SHOWN[fact.how].craft(fact) for fact in some]
        path = folder / f"{some[0].device}-{protocol}.cap.txt"
        path.write_text("\n".join(_capture(line, protocol, exchanges)) + "\n", encoding="utf-8")
        text = ran("show", str(path), "--json", "--fields", "-d", f"*={some[0].device}")
        rows = [json.loads(row) for row in text.splitlines()]
        begins = [0, *accumulate(len(one.frames) for one in exchanges)]
        assert len(rows) == begins[-1], f"{path}: {len(rows)} rows of {begins[-1]} frames"
        for fact, exchange, begin in zip(some, exchanges, begins, strict=False):
            row = rows[begin + exchange.told]
            if not _says(fact, row):
                yield fact, everything(row)


def _wrongly_guessed(chosen: Sequence[Fact], folder: Path) -> Iterator[tuple[Fact, str]]:
    """Properties of the device itself by which `profile guess` does not know it."""
    if not chosen:
        return
    line, protocol, craft = SHOWN[chosen[0].how]
    path = folder / f"{chosen[0].device}-guess.cap.txt"
    path.write_text("\n".join(_capture(line, protocol, map(craft, chosen))) + "\n", encoding="utf-8")
    rows = [row for row in ran("profile", "guess", str(path)).splitlines() if chosen[0].device in row]
    why = rows[0] if rows else "no profile"
    yield from ((fact, why) for fact in chosen if f"{fact.place} fits" not in why)


def _capture(line: str, protocol: str, exchanges: Iterable[Exchange]) -> Iterator[str]:
    yield f"#!sniff-capture 1\n# line: {line}\n# protocol: {protocol}\n# start: 2026-03-01T10:00:00Z"
    for exchange in exchanges:
        for at, octets in enumerate(exchange.frames):
            yield f"~{exchange.after if at else BETWEEN} {octets.hex(' ')}"


def _says(fact: Fact, row: dict[str, Any]) -> bool:
    if fact.how == "n2 without unit":
        return all(not one["unit"] for one in row["values"]) and bool(row["values"])
    words = f"{fact.place} {fact.said}" if fact.how == "bacnet device" else fact.said
    told = plain(words.removeprefix("!")) in plain(everything(row))
    return told != fact.said.startswith("!")


def everything(row: dict[str, Any]) -> str:
    """All that is said of a row: its line, and each of its values."""
    values = [f"{one['place']} {one['title'] or ''}: {one['text']} {one['bits']}" for one in row["values"]]
    return " | ".join([row["text"], *values])


def plain(text: str) -> str:
    """Letters and digits alone, and the signs that make another number of them."""
    return re.sub(r"[^a-z0-9.%°-]|(?<!\d)[.-](?!\d)|(?<=[a-z])-", "", text.lower())


# --- what is found ---


def _wrongly_judged(chosen: Sequence[Fact]) -> Iterator[tuple[Fact, str]]:
    for line, protocol in dict.fromkeys(JUDGED[fact.how][:2] for fact in chosen if fact.how in JUDGED):
        some = [fact for fact in chosen if fact.how in JUDGED and JUDGED[fact.how][:2] == (line, protocol)]
        trials = [trial for fact in some for trial in _trials(fact)]
        found = _found(Asked(line, protocol, JUDGED[some[0].how].craft), trials)
        for (fact, due), codes in zip(trials, found, strict=True):
            if not _is_due(due, codes):
                yield fact, f"{fact.raw:g}: found {' '.join(sorted(codes)) or 'nothing'}, due {due}"


def _trials(fact: Fact) -> Iterator[tuple[Fact, str]]:
    """What is put on the line, and what must be found: at the end of a range nothing, one step beyond it PR001."""
    if fact.how.startswith("range"):
        yield fact, "!PR001"
        yield fact._replace(raw=fact.raw + (1 if fact.said == "most" else -1)), "PR001"
    elif fact.how.startswith("access"):
        yield fact, {"read only": "PR003", "writable": "writable", "reserved": "PR002"}[fact.said]
    else:
        yield fact, fact.said


def _is_due(due: str, codes: set[str]) -> bool:
    if due == "fine":
        return not codes
    if due == "writable":
        return not codes & {"PR002", "PR003"}
    return (due.removeprefix("!") in codes) != due.startswith("!")


def _found(asked: Asked, trials: Sequence[tuple[Fact, str]]) -> Iterator[set[str]]:
    """The rules of the device's profile that speak, of each exchange by itself; all on one line."""
    line = LineSettings.parse(asked.line)
    session = Session("facts", line, asked.protocol)
    exchanges = [JUDGED[fact.how].craft(fact) for fact, _ in trials]
    rows: dict[int, Row] = {}
    closed: dict[int, list[Any]] = {}
    for output in outputs(_chunks(exchanges, line), session):
        if isinstance(output, Output):
            rows.update((row.no, row) for row in output.rows)
            for transaction in output.transactions:
                closed.setdefault(transaction.request or transaction.response or 0, []).append(transaction)
    devices = Devices(default=packaged(trials[0][0].device))
    begins = [1, *(1 + end for end in accumulate(len(one.frames) for one in exchanges))]
    assert len(rows) == begins[-1] - 1, f"{asked.protocol}: {len(rows)} rows of {begins[-1] - 1} frames"
    for begin, end in pairwise(begins):
        judge = ProfileFindings(session.timing, dissector_for(session), devices)
        for no in range(begin, end):
            judge.see(no, rows[no].event, rows[no].header, rows[no].placement)
        for transaction in (one for no in range(begin, end) for one in closed.get(no, ())):
            judge.settle(transaction)
        yield {finding.code for finding in judge.findings()}


def _chunks(exchanges: Iterable[Exchange], line: LineSettings) -> Iterator[Chunk]:
    now = 10 * MS
    for exchange in exchanges:
        for at, octets in enumerate(exchange.frames):
            now += int((exchange.after if at else BETWEEN) * MS) + len(octets) * line.char
            yield Chunk(now, octets)
