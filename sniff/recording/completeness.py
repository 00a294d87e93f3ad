"""Whether a recording is whole, in words: what a pass through all of it has found."""

from __future__ import annotations

from dissectors.findings import counted
from sniff.engine.session import Completeness
from sniff.formats.text import iso
from sniff.recording.joiner import Joiner
from sniff.recording.messages import MessagePass


def completeness_of(one: MessagePass, joiner: Joiner) -> Completeness:
    """What a whole pass found, in words."""
    report = one.report
    said: list[str] = []
    if not report.footer:
        when = f"last chunk read at {iso(one.last)}" if one.last is not None else "no chunk in it"
        said.append(f"cut at octet {report.end} of {report.size}, or still being written; {when}")
        if report.size > report.end:
            said.append(f"{counted(report.size - report.end, 'octet')} of the file behind that cannot be read")
    said.extend(report.problems)
    if report.places > len(report.problems):
        said.append(f"{counted(report.places - len(report.problems), 'more such place')}")
    if report.skipped:
        said.append(f"{counted(report.skipped, 'octet')} of the file passed over")
    for count, one_of, several, words in (
        (joiner.missing, "read", "reads", "missing in the numbering"),
        (joiner.backward, "batch", "batches", "numbered backwards"),
        (joiner.strange, "message", "messages", f"on /line that belong{'s' * (joiner.strange == 1)} to nothing"),
    ):
        if count:
            said.append(f"{counted(count, one_of, several)} {words}")
    return Completeness(not said, "; ".join(said) if said else "complete")
