"""Stray octets, counted at whoever sent beside them: whose they are, told once. Pure."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import replace

from dissectors.findings import Finding, Severity, Tally, as_consequence, counted, times, together
from sniff.analysis.appended import Behind, appended_to, as_appended
from sniff.analysis.breaks import LEVELS
from sniff.analysis.line_rules import LINE_RULES as RULES
from sniff.analysis.sender_findings import BUS, MASTER, NoteIf, Sender, Senders
from sniff.analysis.shares import only_struck, standing_out

AHEAD_LEAST, AHEAD = 5, 0.9
"""So many of them, and of all of them, between a request and its answer."""

INSTEAD_LEAST, INSTEAD = 3, 0.7
"""So many stray octets, and of all of them, in place of one station's answers: they are its own."""


def strays_found(senders: Senders, instead: Counter[str], ahead: Counter[str], note_if: NoteIf) -> Iterator[Finding]:
    """Stray octets: of a sender that has more than its share of them, else of the bus, told once. `instead`: how many
    came in place of an answer, by the station that was asked; `ahead`: before how many answers some stood apart."""
    by_name = _settled(senders.by_name)
    own: list[tuple[str, str]] = []
    common: dict[str, list[str]] = {"LN201": [], "LN202": []}
    only: dict[str, bool] = {}  # whether chance would hardly have struck one sender alone
    for code, names in common.items():
        counts = {
            name: (one.stray[code].count if code in one.stray else 0, float(one.frames))
            for name, one in by_name.items()
            if name != BUS
        }
        out = standing_out(counts, MASTER)
        only[code] = len(counts) == 1 or bool(only_struck(counts))
        if not senders.beside:  # what lies in the silence before it asks is no sign of the master
            out.discard(MASTER)
        own += [(name, code) for name in sorted(out)]
        names += sorted(name for name, (count, _) in counts.items() if count and name not in out)
        if BUS in by_name and code in by_name[BUS].stray:  # beside a frame of nobody knows whom
            names.append(BUS)
    silence = by_name[BUS].stray.get("LN203") if BUS in by_name else None
    among = {code: together(by_name[name].stray[code] for name in names) for code, names in common.items()}
    total = sum(tally.count for tally in among.values()) + (silence.count if silence is not None else 0)
    for code, names in common.items():
        alone = names[0] if len(names) == 1 else BUS
        if code == "LN201" and alone == MASTER and not senders.beside:
            continue
        if alone != BUS and only[code] and 2 * among[code].count > total:  # nobody else is struck
            own += [(names[0], code)]
            total -= among.pop(code).count
    of_own = 0
    told: list[tuple[Finding, set[int]]] = []
    for name, code in own:
        record = by_name[name]
        of_own += record.stray[code].count
        found = _stray_finding(code, name, record.values, record.stray[code], record.frames, note_if)
        if code == "LN202":
            found = _of_sender(found, record, bool(by_name.keys() - {BUS, MASTER}))
        told.append((found, {value for rule, value in record.values if rule == code}))
        yield found
    if total:
        found, values = _of_all(senders, by_name, among, silence, common, note_if)
        found = _before_answers(_of_one_asked(found, instead, senders), ahead, senders)
        theirs = [one for one, own_values in told if values.keys() <= own_values and total <= one.count]
        if theirs:  # the same octets, seen apart from the frame
            yield as_consequence(found, theirs[0], RULES)
        else:
            yield replace(found, severity=Severity.NOTE) if 3 * total <= of_own else found  # most likely theirs too


def _settled(by_name: Mapping[str, Sender]) -> dict[str, Sender]:
    """The senders, where the master puts octets behind its frames itself: those of frames that nobody answers are its
    own, too, and so are those behind frames of nobody knows whom, where no station is heard: a write that is sent again
    may be its answer."""
    made = dict(by_name)
    master, unknown = made.get(MASTER), made.get(BUS)
    if master is None or unknown is None:
        return made
    behind = [master.behind, master.joined]
    frames = master.frames
    alone = made.keys() == {BUS, MASTER} and unknown.behind.tally.count > 0
    if alone:
        behind.append(unknown.behind)
        frames += unknown.frames
    octets = sum((one.octets for one in behind), Counter[bytes]())
    if appended_to(octets, sum(one.tally.count for one in behind), frames) is None:
        return made
    joined, apart = master.joined.tally, dict(unknown.stray)
    if (silence := apart.pop("LN203", None)) is not None and silence.count > joined.count:
        apart["LN203"] = replace(silence, count=silence.count - joined.count)
    if alone:
        apart.pop("LN202", None)
    made[BUS] = replace(unknown, stray=apart)
    made[MASTER] = replace(
        master,
        frames=frames,
        stray={**master.stray, "LN202": together(one.tally for one in behind if one.tally.count)},
        behind=Behind(octets=octets),
    )
    return made


def _of_sender(finding: Finding, record: Sender, others: bool) -> Finding:
    """What is found of strays behind one sender's frames: are they its own doing? `others`: stations are heard."""
    octets = appended_to(record.behind.octets, finding.count, record.frames)
    if octets is None:
        return finding
    return as_appended(finding, octets, record.frames, others if finding.subject == MASTER else None)


def _of_one_asked(finding: Finding, instead: Counter[str], senders: Senders) -> Finding:
    """What is found of silence, of the station in place of whose answers it is; that others are asked too is known."""
    ((name, count),) = instead.most_common(1) or (("", 0),)
    others = len(senders.by_name.keys() - {BUS, MASTER, name})
    if finding.code != "LN203" or not others or count < max(INSTEAD_LEAST, INSTEAD * finding.count):
        return finding
    return replace(
        finding,
        subject=name,
        severity=Severity.NOTE,  # that it does not answer is told by the protocol's rules
        seen=f"{finding.seen}; {count} of them in place of its answers",
        means="something is connected at this address and moves the line: a driver without data, the end of an answer",
        next="its supply, its driver's direction control, its connection",
    )


def _before_answers(finding: Finding, ahead: Counter[str], senders: Senders) -> Finding:
    """What is found of silence, where nearly all stand between a request and its answer: of one station, where others
    have hardly any."""
    ((name, count),) = ahead.most_common(1) or (("", 0),)
    if finding.code != "LN203" or finding.subject != BUS or ahead.total() < max(AHEAD_LEAST, AHEAD * finding.count):
        return finding
    words = f"{finding.seen}; {ahead.total()} of them between a request and its answer"
    means = f"a driver that moves the line before it sends, or lets go with a jerk; or {finding.means}"
    told = replace(finding, seen=words, means=means)
    others = sum(one.frames for other, one in senders.by_name.items() if other not in (BUS, MASTER, name))
    alone = count >= AHEAD * ahead.total() and 2 * count > senders.by_name[name].frames
    if not alone or others < AHEAD_LEAST:
        return told
    settle = "its driver's direction control and turnaround; bias"
    return replace(told, subject=name, next=settle)


def _of_all(
    senders: Senders,
    by_name: Mapping[str, Sender],
    among: dict[str, Tally],
    silence: Tally | None,
    names: dict[str, list[str]],
    note_if: NoteIf,
) -> tuple[Finding, Counter[int]]:
    """One finding about noise that no sender stands out by, and the octets that it is."""
    values: Counter[tuple[str, int]] = Counter()
    for code in among:
        for name in names[code]:
            values.update({key: n for key, n in by_name[name].values.items() if key[0] == code})
    if silence is not None:
        values.update({key: n for key, n in by_name[BUS].values.items() if key[0] == "LN203"})
        among = {**among, "LN203": silence}
    tally = together(among.values())
    code = max(among, key=lambda one: among[one].count)
    if among[code].count < 0.85 * tally.count:
        code = "LN203"
    values = Counter({(code, value): count for (_, value), count in values.items()})
    parts = {"LN201": "before", "LN202": "after", "LN203": "away from"}
    spread = ", ".join(f"{among[one].count} {word}" for one, word in parts.items() if one in among and among[one].count)
    finding = _stray_finding(code, BUS, values, tally, senders.frames, note_if)
    beside = {name for code in names for name in names[code] if name != BUS}
    whoever = ", whoever sends" if len(beside) > 1 else ""  # beside the frames of one alone it may be that one's
    if sum(one.count > 0 for one in among.values()) > 1:
        finding = replace(finding, seen=f"{finding.seen}: {spread} frames{whoever}")
    elif code != "LN203":
        finding = replace(finding, seen=f"{finding.seen}{whoever}")
    octets = Counter({value: count for (_, value), count in values.items()})
    if code == "LN202" and 10 * tally.count >= 9 * senders.frames and len(octets) == 1 and not octets.keys() & LEVELS:
        finding = replace(
            finding,
            severity=Severity.NOTE,
            means="everybody ends his frames with this octet: another end character than is usual is set",
            next="nothing, if all of them are set so; else the setting of the end character",
        )
    return finding, octets


def _stray_finding(
    code: str, name: str, values: Counter[tuple[str, int]], tally: Tally, frames: int, note_if: NoteIf
) -> Finding:
    where = {"LN201": "before", "LN202": "after"}.get(code)
    if where is None:
        words = f"stray octets {times(tally.count)} in the silence between {counted(frames, 'frame')}"
    elif tally.count > frames:
        words = f"stray octets {times(tally.count)} {where} {counted(frames, 'frame')}"
    else:
        words = f"stray octets {where} {tally.count} of {counted(frames, 'frame')}"
    counts = [(value, count) for (rule, value), count in values.most_common() if rule == code]
    most = counts[:4]
    if 2 * sum(count for _, count in most) > sum(count for _, count in counts):
        mostly = "" if len(counts) == len(most) else "mostly "
        words += f" ({mostly}{', '.join(f'{value:02X}' for value, _ in most)})"
    finding = tally.found(RULES[code], name, words, note_if(tally.count, frames))
    if frames:
        return finding
    means = f"a bus that is much faster than the port, of whose frames no more is heard; or {finding.means}"
    return replace(finding, means=means, next=f"`detect`, or higher rates (-s); then {finding.next}")
