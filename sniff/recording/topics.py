"""The topics of a recording, as data: encodings and the schema record of each.

JSON schemas are flat (a root object, one scalar type a property), so that a stock Foxglove or PlotJuggler plots them.
Binary layouts are written down in words in the schema record, so that a file explains itself.
"""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from dataclasses import dataclass

RAW = "/raw"
LINE = "/line"
FRAMES = "/frames"
FINDINGS = "/findings"

PROFILE = "sniff485"
"""Profile in the header record of every file made here."""

SESSION_RECORD = "session"
"""Metadata record with `Session.to_metadata`, first in every part."""

PART_RECORD = "recording"
"""Metadata record with the version of the layout, the part's number and what came before it."""

FRAMES_RECORD = "frames"
"""Metadata record behind all chunks: who made the /frames, and of what."""

PROFILE_SUFFIX = ".toml"
PROFILE_MEDIA_TYPE = "application/toml"
"""Of the attachments that hold the device profiles in force, "teco-e510.toml" and so on, in every part."""

VERSION = 1
"""Version of the layout of /raw and /line. A new one comes with a migration and a kept sample."""

RAW_LAYOUT = """\
sniff485 /raw, version 1. One message is a batch of reads from a serial line. Little-endian, no padding:

  u32 n            number of entries
  i64 t0           ns since the Unix epoch: when the first entry was read
  u32 dt[n]        ns after t0: when each entry was read; never descending within a batch
  u16 length[n]    octets of each entry, 1 ... 65535
  u8  octets[]     the octets of all entries, one after the other

The message's sequence is the number of its first entry, modulo 2^32, counted from 0 over all parts of a recording: a
batch whose sequence is not the last sequence plus the last n shows a hole. log_time is the time of the last entry,
publish_time that of the first. A time bounds the end of the entry's last octet from above. Times may run backwards
from one batch to the next. Errors of single octets are on /line.
"""


@dataclass(frozen=True, slots=True)
class SchemaText:
    """A schema record: `encoding` as MCAP names it; `message` is the encoding of the channel's messages."""

    name: str
    encoding: str
    message: str
    text: str


def _flat(title: str, properties: dict[str, tuple[str, str]], required: tuple[str, ...] = ()) -> SchemaText:
    """A JSON schema from property → (type, description)."""
    schema = {
        "type": "object",
        "title": title,
        "properties": {name: {"type": kind, "description": words} for name, (kind, words) in properties.items()},
        "required": list(required),
    }
    return SchemaText(title, "jsonschema", "json", json.dumps(schema))


LINE_SCHEMA = _flat(
    "sniff485.Line",
    {
        "kind": ("string", "parity, framing, break, overrun (joined by + when the driver cannot tell), or an event"),
        "chunk": ("integer", "number of the entry of /raw that it belongs to, or before which the event happened"),
        "offset": ("integer", "octet within the entry, from 0; absent for events"),
        "text": ("string", "an event in words"),
        "count": ("integer", "what an event counts"),
        "reads": ("integer", "of dropped: entries before this one that were never written"),
        "time_ns": ("integer", "the event's time where log_time cannot hold it"),
    },
    ("kind", "chunk"),
)

RAW_SCHEMA = SchemaText("sniff485.RawBatch", "x-sniff485-layout", "x-sniff485-raw-batch", RAW_LAYOUT)

VALUE_SCHEMA = _flat(
    "sniff485.Value",
    {
        "value": ("number", "in the unit of the channel's metadata"),
        "raw": ("integer", "as it was on the wire"),
        "quality": ("integer", "0 good, 1 uncertain, 2 bad"),
        "frame": ("integer", "number of the frame that carried it"),
    },
    ("value",),
)

TEXT_VALUE_SCHEMA = _flat(
    "sniff485.TextValue",
    {
        "value": ("string", "a state or text"),
        "raw": ("integer", "as it was on the wire"),
        "quality": ("integer", "0 good, 1 uncertain, 2 bad"),
        "frame": ("integer", "number of the frame that carried it"),
    },
    ("value",),
)

BUS_SCHEMA = _flat(
    "sniff485.Bus",
    {
        "load": ("number", "share of the time that the line was busy, 0 ... 1"),
        "frames": ("integer", "frames in the window"),
        "octets": ("integer", "octets in the window"),
        "errors": ("integer", "damaged frames, noise and bad verdicts in the window"),
        "error_rate": ("number", "errors over frames, 0 ... 1"),
        "health": ("integer", "0 ... 100 in the window, by the formula of sniff.analysis.health"),
        "latency_p50_ms": ("number", "median response time, ms"),
        "latency_p95_ms": ("number", "95th percentile of response time, ms"),
        "latency_max_ms": ("number", "longest response time, ms"),
        "ring_masters": ("integer", "token passing: stations in the ring as the newest tokens show it"),
        "tokens": ("integer", "token passing: tokens in the window"),
        "token_retries": ("integer", "token passing: tokens sent again because nobody used them"),
        "tokens_lost": ("integer", "token passing: silences after which somebody made a new token"),
        "poll_waste": ("number", "token passing: share of the time that unanswered polls for masters took, 0 ... 1"),
        "slaves_in_exchange": ("integer", "token passing: stations without a token that exchange data in cycles"),
        "loop_p50_ms": ("number", "token passing: median time from token to token of a station, ms"),
        "loop_max_ms": ("number", "token passing: longest time from token to token of a station, ms"),
    },
)

NODE_SCHEMA = _flat(
    "sniff485.Node",
    {
        "requests": ("integer", "requests to it in the window"),
        "responses": ("integer", "answers from it in the window"),
        "errors": ("integer", "what went wrong with it in the window"),
        "error_rate": ("number", "errors over requests, 0 ... 1"),
        "health": ("integer", "0 ... 100 in the window, by the formula of sniff.analysis.health"),
        "latency_p50_ms": ("number", "median response time, ms"),
        "latency_p95_ms": ("number", "95th percentile of response time, ms"),
        "latency_max_ms": ("number", "longest response time, ms"),
        "tokens": ("integer", "token passing: tokens that it got"),
        "token_retries": ("integer", "token passing: tokens that it had to send again"),
        "polls_unanswered": ("integer", "token passing: its polls for masters that nobody answered"),
        "postponed": ("integer", "token passing: answers that it postponed"),
        "loop_p50_ms": ("number", "token passing: median time from token to token, ms"),
        "loop_max_ms": ("number", "token passing: longest time from token to token, ms"),
        "token_use_p50_ms": ("number", "token passing: median time from token to its first frame, ms"),
        "token_use_max_ms": ("number", "token passing: longest time from token to its first frame, ms"),
    },
)

LOG_SCHEMA = SchemaText(
    "foxglove.Log",
    "jsonschema",
    "json",
    json.dumps(
        {
            "type": "object",
            "title": "foxglove.Log",
            "properties": {
                "timestamp": {
                    "type": "object",
                    "title": "time",
                    "properties": {
                        "sec": {"type": "integer", "minimum": 0},
                        "nsec": {"type": "integer", "minimum": 0, "maximum": 999_999_999},
                    },
                },
                "level": {"type": "integer", "description": "0 unknown, 1 debug, 2 info, 3 warning, 4 error, 5 fatal"},
                "message": {"type": "string"},
                "name": {"type": "string"},
                "file": {"type": "string"},
                "line": {"type": "integer", "minimum": 0},
            },
        }
    ),
)

SCHEMAS: dict[str, SchemaText] = {
    schema.name: schema
    for schema in (
        RAW_SCHEMA,
        LINE_SCHEMA,
        VALUE_SCHEMA,
        TEXT_VALUE_SCHEMA,
        BUS_SCHEMA,
        NODE_SCHEMA,
        LOG_SCHEMA,
    )
}
"""Schema name → schema record; `Recorder.derived` takes these names."""

FIXED_CHANNELS = ((RAW, RAW_SCHEMA), (LINE, LINE_SCHEMA))
"""Channels 1, 2 … of every part, so that a file whose first chunk is damaged can still be read; with several buses
those of each in turn."""

BUS = "bus"
"""In the part record of a file with several buses: which of the sessions, in their order, it is about."""


def topics_of(buses: Sequence[str]) -> list[dict[str, str]]:
    """What RAW and LINE are called for each bus of a file: as they are where it is alone, else with its name."""
    if len(buses) == 1:
        return [{topic: topic for topic, _ in FIXED_CHANNELS}]
    names: list[str] = []
    for number, bus in enumerate(buses, 1):
        name = topic_part(bus) or "bus"
        while name in names:
            name = f"{name}-{number}"
        names.append(name)
    return [{topic: f"{topic}/{name}" for topic, _ in FIXED_CHANNELS} for name in names]


def topic_part(text: str) -> str:
    """A name as part of a topic: what no viewer takes for a separator or a wildcard."""
    return re.sub(r"[^A-Za-z0-9_.-]+", "-", text).strip("-")
