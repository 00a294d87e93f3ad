"""How far nobody knows when the reads of a log came that have no time of their own. Pure.

Such a read follows the one before at once, as far as it is laid; it came at any time up to the next that is told.
"""

from __future__ import annotations

from collections.abc import Sequence

FEW = 0.1
"""Share of reads without a time, up to which they are exceptions."""

_NEARLY_ALL = 0.9

Reads = Sequence[tuple[int, bool]]
"""When each came, ns, and whether the log said so."""


def unknown_by(reads: Reads) -> int | None:
    """ns between the times on both sides of reads that have none: of nearly all of them not more; 0 where hardly any
    has none; None where most of those have a time on one side only, or none."""
    begin = next((at for at, (_, is_told) in enumerate(reads) if is_told), len(reads))
    later = reads[begin:]
    untold = sum(not is_told for _, is_told in later)
    if untold <= FEW * len(later):
        return 0 if later else None
    between: list[int] = []
    told, open_reads = 0, 0
    for time, is_told in later:
        if is_told:
            between += [time - told] * open_reads
            told, open_reads = time, 0
        else:
            open_reads += 1
    if 2 * len(between) < untold:
        return None
    return sorted(between)[int(_NEARLY_ALL * (len(between) - 1))]
