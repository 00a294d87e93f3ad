"""InfluxDB's line protocol of what outlets are told. Pure.

Source: the line protocol reference of InfluxDB 2: measurement, tags, fields, time in ns. In measurements commas and
spaces are escaped, in tags and names of fields the equals sign too, in texts quotes and backslashes. A line end would
end the point, and a backslash at the end of a tag would escape what follows: neither leaves here. An integer has an i
behind it, 64 bits.

    sniff485_value,bus=boiler,device=3,point=output-frequency,unit=Hz value=60.0,raw=6000i,quality=0i 1767261600000
    sniff485_text,bus=...          text="run, forward"
    sniff485_bus,bus=boiler        load=0.31,frames=120i,...
    sniff485_node,bus=boiler,device=3  requests=40i,...
    sniff485_finding,bus=...,code=MB001,severity=error,subject=station\\ 3,what=new  count=4i,seen="..."
    sniff485_state,bus=...,port=/dev/ttyUSB0  listening=true,text=""
"""

from __future__ import annotations

import math
import re

from sniff.analysis.sanitizing import sanitized
from sniff.outlets.told import FindingTold, NumbersTold, StateTold, Told, ValueTold

MOST_TEXT = 4096
"""Characters of a text or a tag; InfluxDB refuses longer ones from 64 KiB on."""

_LEAST, _MOST = -(1 << 63), (1 << 63) - 1

Field = int | float | str | bool


def line(told: Told) -> str | None:
    """The line of one thing without its end; None where there is none."""
    if isinstance(told, ValueTold):
        return _value(told)
    if isinstance(told, NumbersTold):
        station = {} if told.station is None else {"device": told.station}
        measurement = "sniff485_bus" if told.station is None else "sniff485_node"
        return point(measurement, {"bus": told.bus.name, **station}, dict(told.numbers), told.time)
    if isinstance(told, FindingTold):
        one = told.news.finding
        tags = {
            "bus": told.bus.name,
            "code": one.code,
            "severity": one.severity.label,
            "subject": one.subject,
            "what": told.news.what.value,
        }
        return point("sniff485_finding", tags, {"count": one.count, "seen": one.seen, "means": one.means}, told.time)
    if isinstance(told, StateTold):
        tags = {"bus": told.bus.name, "port": told.bus.port}
        return point("sniff485_state", tags, {"listening": told.listening, "text": told.text}, told.time)
    return None


def _value(told: ValueTold) -> str | None:
    value = told.sample.value
    tags = {
        "bus": told.bus.name,
        "device": told.sample.station,
        "point": told.sample.name,
        "unit": value.unit,
        "how": value.how.value,
    }
    fields: dict[str, Field] = {}
    if isinstance(value.value, str):
        fields["text"] = value.value
    elif told.sample.finite:
        fields["value"] = float(value.value)
    else:
        return None  # the protocol has no word for it
    if value.raw is not None:
        fields["raw"] = value.raw
    if value.words and "text" not in fields:
        fields["means"] = value.words
    fields["quality"] = int(value.quality)
    return point("sniff485_text" if "text" in fields else "sniff485_value", tags, fields, told.sample.time)


def point(measurement: str, tags: dict[str, str], fields: dict[str, Field], time: int) -> str | None:
    """One line; None where no field can be said. Empty tags are left out, as the protocol wants it."""
    said = [f"{_name(key)}={shown}" for key, value in fields.items() if (shown := _field(value)) is not None]
    if not said or not _LEAST <= time <= _MOST:
        return None
    named = "".join(f",{_name(key)}={_name(text)}" for key, text in tags.items() if text)
    return f"{_escaped(measurement, ', ')}{named} {','.join(said)} {time}"


def _field(value: Field) -> str | None:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        return f"{value}i" if _LEAST <= value <= _MOST else None
    if isinstance(value, float):
        return repr(value) if math.isfinite(value) else None
    text = sanitized(value)[:MOST_TEXT]
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'


def _name(text: str) -> str:
    return _escaped(text, ",= ")


def _escaped(text: str, special: str) -> str:
    """A backslash before what is special; one of its own becomes a slash, since none can stand before what ends it."""
    harmless = sanitized(text)[:MOST_TEXT].replace("\\", "/")
    return re.sub(f"([{re.escape(special)}])", r"\\\1", harmless)
