"""What columns of tables of octets are called, in some languages, and how a name tells its unit. Pure."""

from __future__ import annotations

import re

from dissectors.frame import LineError

OCTET = (
    "octet",
    "octets",
    "byte",
    "bytes",
    "data",
    "value",
    "hex",
    "payload",
    "data (hex)",
    "hex data",
    "raw",
    "message",
    "decoded protocol result",
    "decoded result",
    "telegram",
    "daten",
    "telegramm",
    "nachricht",
    "données",
    "trame",
    "datos",
    "trama",
    "dati",
    "dane",
    "ramka",
    "данные",
    "数据",
    "data(hex)",
    "data hex",
    "rx data",
    "tx data",
    "rx",
    "tx",
)
PAIRS = (
    ("rx", "tx"),
    ("rx data", "tx data"),
    ("request", "response"),
    ("query", "response"),
    ("query", "answer"),
    ("sent", "received"),
    ("send", "receive"),
    ("anfrage", "antwort"),
    ("запрос", "ответ"),
)
"""Two columns that hold octets, one or both in a row."""
DAYS = ("date", "datum", "дата", "fecha", "data", "jour", "日期")
"""The day, where the time of day stands in another column; a column of octets may be called the same."""
ANALYSER = re.compile(r".*\b(?:uart|rs-?485|rs-?232|async serial|serial)\b.*")
"""A column that is named for its decoder, when no other holds octets."""
BEGIN = ("t_start_s", "start", "start_s", "begin", "start_time", "start time")
END = ("t_end_s", "end", "end_s", "time", "time_s", "timestamp", "t", "date", "datetime", "date/time", "date time")
DURATION = ("duration", "duration_s")
ERRORS = {"parity error": LineError.PARITY, "framing error": LineError.FRAMING}
ANY_ERROR = "error"
TYPE = "type"
TYPES_WITH_OCTETS = ("", "data", "result", "rx", "tx", "read", "write", "irp_mj_read", "irp_mj_write")

TIME_WORDS = re.compile(
    r"(?:ts|t|time|timestamp|when|zeit|zeitstempel|uhrzeit|datum|date|время|дата|temps|hora|heure|ora|czas|clock|epoch|"
    r"uptime|elapsed|millis|时间|日期)"
)
"""Words of which a time is named."""

_UNIT = re.compile(
    r"(?P<name>[^\[(]*)[\[(](?P<unit>s|ms|us|µs|μs|ns)[\])]"
    r"|(?P<stem>.+?)[_ ,/-]+(?:in[_ ])?"
    r"(?P<last>s|secs?|seconds|ms|millis(?:econds)?|us|µs|μs|micros(?:econds)?|ns|nanos)"
)
_HEX = re.compile(r"(?P<stem>.+?) ?[\[(](?:in )?hex(?:adecimal)?[\])]")
_LONG = {"sec": "s", "millis": "ms", "micros": "us", "nanos": "ns"}


def named(name: str) -> tuple[str, str]:
    """The name of a column without its unit, and the unit, "" where it has none."""
    match = _UNIT.fullmatch(name)
    if name in ("ms", "us", "µs", "μs", "ns"):
        return "time", name
    if match is None:
        hexadecimal = _HEX.fullmatch(name)
        return (name if hexadecimal is None else hexadecimal["stem"]), ""
    if match["unit"] is not None:
        return match["name"].strip(), match["unit"]
    return match["stem"].strip(), _short(match["last"])


def _short(unit: str) -> str:
    """ "ms" of "milliseconds"."""
    return next((short for start, short in _LONG.items() if unit.startswith(start)), unit)
