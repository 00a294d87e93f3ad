"""A picture of some rows of a capture, as SVG: a box a frame, pauses between them as numbers.

    2 ms   ┌──────┐  10 ms  ┌─────────┐
           │  17  │ ······· │   18    │        frames are as wide as they have octets; pauses are not to scale
           └──────┘         └─────────┘
            1 ←              1 →  ▲            ▲ evidence of the finding

What a box is, its outline and its words tell, not its colour alone.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from html import escape
from typing import Any

MS = 1_000_000
HEIGHT = 108
_TOP, _BOX = 22, 34


def wire_picture(rows: Sequence[Mapping[str, Any]], evidence: Collection[int], title: str) -> str:
    """SVG of rows as `show --json` gives them."""
    parts: list[str] = []
    x = 10.0
    before: int | None = None
    for row in rows:
        if before is not None:
            x = _pause(parts, x, row["start_ns"] - before)
        x = _box(parts, x, row, row["no"] in evidence)
        before = row["end_ns"]
    width = round(x + 10)
    line = f'<line x1="0" y1="{_TOP + _BOX}" x2="{width}" y2="{_TOP + _BOX}" class="w"/>'
    return (
        f'<svg class="wire" xmlns="http://www.w3.org/2000/svg" role="img" viewBox="0 0 {width} {HEIGHT}" '
        f'width="{width}" height="{HEIGHT}"><title>{escape(title)}</title>{line}{"".join(parts)}</svg>'
    )


def _pause(parts: list[str], x: float, silence: int) -> float:
    said = _milliseconds(silence)
    width = max(26.0, 7.0 * len(said) + 6) if said else 4.0
    if said:
        parts.append(f'<text x="{x + width / 2:.0f}" y="{_TOP + _BOX - 5}" class="p">{said}</text>')
    return x + width


def _milliseconds(silence: int) -> str:
    """A pause in words; nothing where frames follow at once."""
    if silence < MS // 20:
        return ""
    if silence >= 1000 * MS:
        return f"{silence / MS / 1000:.1f} s"
    return f"{silence / MS:.0f} ms" if silence >= 10 * MS else f"{silence / MS:.1f} ms"


def _box(parts: list[str], x: float, row: Mapping[str, Any], is_evidence: bool) -> float:
    octets = len(row["hex"]) // 2
    label = str(row["no"])
    ends = _ends(row)
    width = min(max(14.0 + 3 * octets, 7.0 * len(label) + 8, 6.6 * len(ends) + 8), 150.0)
    middle = x + width / 2
    kind = "n" if row["proto"] is None else "b" if not row["ok"] else "q" if row["role"] == "request" else "a"
    parts.append(f'<rect x="{x:.0f}" y="{_TOP}" width="{width:.0f}" height="{_BOX}" rx="2" class="{kind}"/>')
    parts.append(f'<text x="{middle:.0f}" y="{_TOP + 22}" class="no">{label}</text>')
    parts.append(f'<text x="{middle:.0f}" y="{_TOP + _BOX + 16}" class="e">{escape(ends)}</text>')
    if is_evidence:
        parts.append(f'<text x="{middle:.0f}" y="{_TOP + _BOX + 34}" class="ev">▲</text>')
    said = "noise" if kind == "n" else "damaged" if kind == "b" else ""
    if said:
        parts.append(f'<text x="{middle:.0f}" y="{_TOP - 6}" class="s">{said}</text>')
    return x + width


def _ends(row: Mapping[str, Any]) -> str:
    """Between whom: as the line of text says it, up to its first words."""
    if row["proto"] is None:
        return f"{len(row['hex']) // 2} octets"
    source, destination = row["src"], row["dst"]
    if source is not None and destination is not None:
        return f"{source} → {destination}"
    return f"{source} →" if source is not None else f"{destination} ←" if destination is not None else "→ all"
