"""The status of a box in words for a terminal. Pure; whatever came from a wire or a configuration is made plain."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import UTC, datetime

from dissectors.line import NS_PER_S
from sniff.analysis.sanitizing import sanitized
from sniff.box.status import BoxStatus, BusStatus, FindingLine, OutletLine, State

_WORDS = {State.HEARD: "heard", State.SILENT: "SILENT", State.DOWN: "DOWN", State.OVER: "NOT HEARD"}
_HEADINGS = ("bus", "state", "since", "octets", "lost", "frames", "damaged", "load", "health")
_RIGHT = {"octets", "lost", "frames", "damaged", "load", "health"}


def headline(box: BoxStatus) -> str:
    """One line for a service manager: what matters most first."""
    bad = [f"{bus.name} {_WORDS[bus.state]} since {clock(bus.since, box.now)}" for bus in box.buses if not bus.is_well]
    if not box.recording:
        said = f"NOT RECORDING: {box.trouble or 'no capture runs'}"
    elif box.trouble:
        said = f"TROUBLE: {box.trouble}"
    else:
        said = f"recording {len(box.buses)} bus{'es' if len(box.buses) != 1 else ''}"
    octets = sum(bus.octets for bus in box.buses)
    lost = sum(bus.lost for bus in box.buses)
    numbers = f"{octets} octets" + (f", {lost} LOST" if lost else "")
    return sanitized("; ".join([said, *bad, numbers]))


def text(box: BoxStatus) -> str:
    """The page."""
    return "\n".join([*_head(box), "", *_table(box), *_reasons(box), *_findings(box)]) + "\n"


def _head(box: BoxStatus) -> Iterator[str]:
    state = "recording" if box.recording else "NOT RECORDING"
    yield sanitized(f"box {box.name}: {state}, up since {clock(box.since, box.now)} ({span(box.now - box.since)})")
    if box.trouble:
        yield sanitized(f"  TROUBLE    {box.trouble}")
    current = f"{box.current}; " if box.current else ""
    yield sanitized(f"  recording  {current}{counted(box.parts, 'part')}, {size(box.parts_size)}, in {box.folder}")
    if box.free is not None:
        floor = f" (floor {size(box.keep_free)})" if box.keep_free is not None else ""
        late = f"; the disk is {box.behind:.0f} s behind" if box.behind else ""
        yield f"  disk       {size(box.free)} free{floor}{late}"
    if box.capture_pid is not None and box.capture_since is not None:
        began = clock(box.capture_since, box.now)
        yield sanitized(f"  capture    process {box.capture_pid} since {began}, priority {box.priority or 'unknown'}")
    if box.restarts:
        yield sanitized(f"  restarts   capture started anew {counted(box.restarts, 'time')}; last: {box.last_restart}")
    if abs(box.clock_offset) >= NS_PER_S:
        yield (
            f"  clock      set by {box.clock_offset / NS_PER_S:+.0f} s since the capture began: the times in its file "
            "are by the clock before"
        )
    if box.alerts_failed or box.alerts_dropped:
        yield f"  alerts     {box.alerts_failed} failed, {box.alerts_dropped} dropped"
    for outlet in box.outlets:
        yield sanitized(f"  outlet     {outlet.name} {outlet.where}{_fares(outlet)}")
    for one in box.recovered:
        what = "closed" if one.closed else f"left as it is: {one.why_not}"
        yield sanitized(f"  cut part   {one.name}: {one.text}; {what}")


def _fares(outlet: OutletLine) -> str:
    why = f" ({outlet.trouble})" if outlet.trouble else ""
    said = [] if outlet.connected else [f"NOT CONNECTED{why}"]
    said += [] if outlet.sent is None else [f"{outlet.sent} sent"]
    said += [f"{outlet.dropped} DROPPED"] if outlet.dropped else []
    return f": {', '.join(said)}" if said else ""


def _table(box: BoxStatus) -> Iterator[str]:
    rows = [_HEADINGS, *(_cells(bus, box.now) for bus in box.buses)]
    widths = [max(len(row[column]) for row in rows) for column in range(len(_HEADINGS))]
    for row in rows:
        cells = zip(_HEADINGS, row, widths, strict=True)
        yield "  ".join(
            cell.rjust(width) if name in _RIGHT else cell.ljust(width) for name, cell, width in cells
        ).rstrip()


def _cells(bus: BusStatus, now: int) -> tuple[str, ...]:
    return (
        sanitized(bus.name),
        _WORDS[bus.state],
        f"{clock(bus.since, now)} ({span(now - bus.since)})",
        str(bus.octets),
        str(bus.lost),
        str(bus.frames),
        str(bus.damaged),
        f"{bus.load:.0%}",
        "" if bus.health is None else f"{bus.health:.0f}",
    )


def _reasons(box: BoxStatus) -> Iterator[str]:
    yield ""
    for bus in box.buses:
        settings = "searching for its settings" if bus.searching else f"{bus.line} {bus.protocol}"
        yield sanitized(f"  {bus.name}: {bus.port} {settings}")
        if bus.state is not State.HEARD and bus.why:
            heard = "" if bus.heard_at is None else f"; last heard {clock(bus.heard_at, box.now)}"
            yield sanitized(f"  {bus.name}: {_WORDS[bus.state]}: {bus.why}{heard}")
        if bus.downs:
            yield sanitized(f"  {bus.name}: gone {counted(bus.downs, 'time')}, {span(bus.away)} altogether")
        if bus.unseen:
            yield sanitized(f"  {bus.name}: {bus.unseen} octets recorded and not looked at: this host did not keep up")


def _findings(box: BoxStatus) -> Iterator[str]:
    if not box.site and not any(bus.findings for bus in box.buses):
        yield from ("", "no findings")
        return
    yield from ("", "findings since the capture began")
    for one in box.site:
        yield _finding("", one, box.now)
    for bus in box.buses:
        for one in bus.findings:
            yield _finding(f"{bus.name}: ", one, box.now)
        if bus.more_findings:
            yield sanitized(f"  {bus.name}: {bus.more_findings} more")


def _finding(bus: str, one: FindingLine, now: int) -> str:
    last = "" if one.last is None else f" (last {clock(one.last, now)})"
    return sanitized(f"  {bus}{one.severity} {one.code} {one.subject}: {one.seen}{last}")


def clock(time: int, now: int) -> str:
    """A time of day, with the date where that is another one; in this machine's zone."""
    try:
        moment, today = (datetime.fromtimestamp(one / NS_PER_S, UTC).astimezone() for one in (time, now))
    except (OverflowError, ValueError, OSError):
        return "?"
    return f"{moment:%H:%M:%S}" if moment.date() == today.date() else f"{moment:%Y-%m-%d %H:%M:%S}"


def span(time: int) -> str:
    """ns as the two largest units: "2 h 10 min"."""
    seconds = max(0, time) // NS_PER_S
    units = ((86400, "d"), (3600, "h"), (60, "min"), (1, "s"))
    for place, (scale, name) in enumerate(units):
        if seconds >= scale or scale == 1:
            rest = seconds % scale // units[place + 1][0] if place + 1 < len(units) else 0
            more = f" {rest} {units[place + 1][1]}" if rest else ""
            return f"{seconds // scale} {name}{more}"
    return ""


def size(octets: int) -> str:
    """Octets in the unit that fits: "412 MB"."""
    for scale, name in ((10**12, "TB"), (10**9, "GB"), (10**6, "MB"), (10**3, "kB")):
        if octets >= scale:
            value = octets / scale
            return f"{value:.1f} {name}" if value < 100 else f"{value:.0f} {name}"
    return f"{octets} B"


def counted(number: int, what: str) -> str:
    """ "1 part", "7 parts"."""
    return f"{number} {what}" if number == 1 else f"{number} {what}s"
