"""A capture without names: station addresses renumbered, texts replaced, checks made right again.

Every octet stays an octet at its time, so framing, gaps, pairs, damage and findings stay what they were; only who it
was and what it is called is gone. Renamed are: addresses and texts in all frames, identification in good
ones (how, each protocol's manifest says); what events of the line say in words (ports that went and came back, notes)
is left out. Values of points are kept: they are what a reader needs.

A damaged frame keeps its damage: its address is renumbered and its texts are blanked where their places are known.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace

from dissectors import registry
from dissectors.frame import Chunk, Frame, Noise
from dissectors.profiles.packaged import names
from dissectors.pseudonyms import Renamer, without_text
from sniff.devices import EVERY, address, noted
from sniff.engine.engine import Output
from sniff.engine.event_texts import settings_change
from sniff.engine.follow_settings import engine_for
from sniff.engine.session import ASSUMED, DEVICES_NOTE, LINE_NOTE, Item, LineEvent, LineEventKind, Session

ERROR_NAMES = frozenset(("parity", "framing", "break", "overrun", "buffer overrun"))
"""What drivers and gateways call errors that they count."""


def anonymous_session(session: Session) -> Session:
    """The session without the names of ports, devices and places."""
    adapter = replace(session.adapter, serial_number="", detail="")  # which may name channels and hosts
    return replace(session, port="anonymised", bus="bus", adapter=adapter, notes=_renamed_devices(session), profiles={})


def _renamed_devices(session: Session) -> dict[str, str]:
    """Who is which device, under the new addresses; a profile of somebody's own may name its owner and is left out."""
    known, _ = noted(session)
    stations = _renamer(session).stations
    said = [
        f"{word if word == EVERY or stations is None else stations.of(address(word))}={name}"
        for word, name in known.items()
        if name in names() and (word == EVERY or stations is not None)
    ]
    devices = {DEVICES_NOTE: ",".join(said)} if said else {}
    return {**devices, LINE_NOTE: ASSUMED} if session.line_is_assumed else devices


def _renamer(session: Session) -> Renamer:
    """What renames frames: known devices get the first addresses, so that they are known before the first frame."""
    make = registry.get(session.protocol).renamer
    assert make is not None  # asked before, by `knows`
    rewrite = make()
    for word in noted(session)[0]:
        if rewrite.stations is not None and word != EVERY:
            rewrite.stations.of(address(word))
    return rewrite


def knows(protocol: str) -> bool:
    """Whether this protocol's addresses and texts are known here."""
    return registry.is_known(protocol) and registry.get(protocol).renamer is not None


def anonymised(items: Iterable[Item], session: Session) -> Iterator[Item]:
    """The items with the same times and lengths, renamed. The engine decides what is a frame."""
    rewrite = _renamer(session)
    engine = engine_for(session)
    waiting: list[Item] = []
    made = bytearray()
    for item in items:
        waiting.append(item)
        made += _rewritten(engine.take(item), rewrite)
        yield from _filled(waiting, made)
    made += _rewritten(engine.close(), rewrite)
    yield from _filled(waiting, made)


def _rewritten(output: Output, rewrite: Callable[[Frame], bytes]) -> bytes:
    parts = []
    for row in output.rows:
        event = row.event
        parts.append(without_text(event.octets) if isinstance(event, Noise) else rewrite(event))
    return b"".join(parts)


def _filled(waiting: list[Item], made: bytearray) -> Iterator[Item]:
    """The items whose octets are there."""
    while waiting:
        item = waiting[0]
        if isinstance(item, Chunk):
            if len(made) < len(item.octets):
                return
            count = len(item.octets)
            item = replace(item, octets=bytes(made[:count]))
            del made[:count]
        else:
            item = replace(item, text=_without_names(item))
        waiting.pop(0)
        yield item


def _without_names(event: LineEvent) -> str:
    """What an event of the line may say: settings, kinds of errors. The rest may name a port or a place."""
    change = settings_change(event)
    if change is not None:
        said = change.protocol
        return str(replace(change, protocol=said if said is not None and knows(said) else None))
    return event.text if event.kind is LineEventKind.ERRORS and event.text in ERROR_NAMES else ""
