"""Whether a recording is whole, in words: what a pass through all of it has found."""

from __future__ import annotations

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
            said.append(f"{report.size - report.end} octets of the file behind that cannot be read")
    said.extend(report.problems)
    if report.places > len(report.problems):
        said.append(f"{report.places - len(report.problems)} more such places")
    if report.skipped:
        said.append(f"{report.skipped} octets of the file passed over")
    for count, words in (
        (joiner.missing, "reads missing in the numbering"),
        (joiner.backward, "batches numbered backwards"),
        (joiner.strange, "messages on /line that belong to nothing"),
    ):
        if count:
            said.append(f"{count} {words}")
    return Completeness(not said, "; ".join(said) if said else "complete")
