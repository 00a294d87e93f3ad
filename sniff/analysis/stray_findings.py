"""Stray octets, counted at whoever sent beside them: whose they are, told once. Pure."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import replace

from dissectors.findings import Finding, Severity, Tally, as_consequence, counted, times, together
from sniff.analysis.breaks import LEVELS
from sniff.analysis.line_rules import LINE_RULES as RULES
from sniff.analysis.sender_findings import BUS, MASTER, NoteIf, Senders
from sniff.analysis.shares import only_struck, standing_out

INSTEAD_LEAST, INSTEAD = 3, 0.7
"""So many stray octets, and of all of them, in place of one station's answers: they are its own."""


def strays_found(senders: Senders, instead: Counter[str], note_if: NoteIf) -> Iterator[Finding]:
    """Stray octets: of a sender that has more than its share of them, else of the bus, told once. `instead`: how many
    came in place of an answer, by the station that was asked."""
    own: list[tuple[str, str]] = []
    common: dict[str, list[str]] = {"LN201": [], "LN202": []}
    only: dict[str, bool] = {}  # whether chance would hardly have struck one sender alone
    for code, names in common.items():
        counts = {
            name: (one.stray[code].count if code in one.stray else 0, float(one.frames))
            for name, one in senders.by_name.items()
            if name != BUS
        }
        out = standing_out(counts, MASTER)
        only[code] = len(counts) == 1 or bool(only_struck(counts))
        if not senders.beside:  # what lies in the silence before it asks is no sign of the master
            out.discard(MASTER)
        own += [(name, code) for name in sorted(out)]
        names += sorted(name for name, (count, _) in counts.items() if count and name not in out)
        if BUS in senders.by_name and code in senders.by_name[BUS].stray:  # beside a frame of nobody knows whom
            names.append(BUS)
    silence = senders.by_name[BUS].stray.get("LN203") if BUS in senders.by_name else None
    among = {code: together(senders.by_name[name].stray[code] for name in names) for code, names in common.items()}
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
        record = senders.by_name[name]
        of_own += record.stray[code].count
        found = _stray_finding(code, name, record.values, record.stray[code], record.frames, note_if)
        told.append((found, {value for rule, value in record.values if rule == code}))
        yield found
    if total:
        found, values = _of_all(senders, among, silence, common, note_if)
        found = _of_one_asked(found, instead, senders)
        theirs = [one for one, own_values in told if values.keys() <= own_values and total <= one.count]
        if theirs:  # the same octets, seen apart from the frame
            yield as_consequence(found, theirs[0], RULES)
        else:
            yield replace(found, severity=Severity.NOTE) if 3 * total <= of_own else found  # most likely theirs too


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


def _of_all(
    senders: Senders, among: dict[str, Tally], silence: Tally | None, names: dict[str, list[str]], note_if: NoteIf
) -> tuple[Finding, Counter[int]]:
    """One finding about noise that no sender stands out by, and the octets that it is."""
    values: Counter[tuple[str, int]] = Counter()
    for code in among:
        for name in names[code]:
            values.update({key: n for key, n in senders.by_name[name].values.items() if key[0] == code})
    if silence is not None:
        values.update({key: n for key, n in senders.by_name[BUS].values.items() if key[0] == "LN203"})
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
