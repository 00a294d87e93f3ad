"""`sniff485.toml`: buses named once, so that `live boiler-room` knows port, line, protocol and devices; whom to tell.

    [bus.boiler-room]
    port = "/dev/ttyUSB0"
    line = "19200,8E1"
    protocol = "auto"
    record = "captures/boiler.mcap"

    [bus.boiler-room.devices]
    3 = "teco-e510"
    "*" = "teco-e510"

    [alert]
    webhook = "https://example.org/hook"     # or command = ["notify", "bus"]: gets JSON on standard input
    at = "error"                             # from which severity on; default warning
    every = 600                              # seconds between two about the same finding

    [box]                                    # what runs unattended (`sniff485 box`)
    folder = "/var/lib/sniff485"
    name = "site"                            # site-0001.mcap, site-0002.mcap …
    rotate = "size:64MB,time:1d"
    keep = 500
    keep_free = "1GB"
    [mqtt]                                   # and [influx], [json], [foxglove], [metrics]: outlet_settings.py
    broker = "mqtts://broker.example"

    [filters]
    slow = "latency_ms > 50ms"

    [colours]
    magenta = "kind contains write"

    [view.writes]                            # of the terminal UI: V shows it by its name, and saves what is shown
    frames = ["no", "time", "text", "verdict"]
    transactions = ["tx", "kind", "latency"]
    time = "relative"                        # absolute, relative, delta
    filter = "kind contains write"

    [keys]
    mark = "ctrl+b"                          # other keys for the terminal UI; names: sniff/tui/README.md

The first file found counts: in the working folder or one above it, then the user's configuration folder. Flags win
over the file.
"""

from __future__ import annotations

import difflib
import json
import os
import re
import sys
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from dissectors import registry
from dissectors.findings import Severity
from dissectors.line import LineSettings
from sniff import outlet_settings
from sniff.engine.session import AUTO as AUTO
from sniff.outlet_settings import OutletSettings

FILE = "sniff485.toml"
BUS_KEYS = ("port", "line", "protocol", "record", "devices")
ALERT_KEYS = ("command", "webhook", "at", "every")
BOX_KEYS = ("folder", "name", "rotate", "keep", "keep_free", "metrics", "status")
VIEW_KEYS = ("frames", "transactions", "time", "filter")
TIMES = ("absolute", "relative", "delta")
TOP_KEYS = ("bus", "alert", "box", "filters", "colours", "view", "keys", *outlet_settings.TABLES)
MOST_EVERY = 366 * 86_400
"""Seconds between two alerts about the same; what is longer, or no number, is a mistake."""
COLOURS = ("red", "green", "yellow", "blue", "magenta", "cyan")


class ConfigError(Exception):
    """A configuration that cannot be used; the message names file, line, key and the way out."""


@dataclass(frozen=True, slots=True)
class Bus:
    """One bus of the configuration; None where the file is silent. `devices`: address (or "*") → profile.

    `line` and `protocol` may be AUTO: found by listening.
    """

    name: str
    port: str | None = None
    line: LineSettings | Literal["auto"] | None = None
    protocol: str | None = None
    record: str | None = None
    devices: Mapping[str, str] = field(default_factory=dict)
    origin: Mapping[str, str] = field(default_factory=dict)  # key → "file:line"


@dataclass(frozen=True, slots=True)
class AlertSettings:
    """`command`: words, started without a shell; `webhook`: http:// or https://. `least`: severity from which it is
    told. `every`: seconds between two alerts about the same finding."""

    command: tuple[str, ...] = ()
    webhook: str = ""
    least: Severity = Severity.WARNING
    every: float = 600.0


@dataclass(frozen=True, slots=True)
class BoxSettings:
    """What `box` is told; None where the file is silent. `folder`, `name`: of the recording's parts. `rotate`, `keep`,
    `keep_free`: as options of those names. `metrics`, `status`: ports on the loopback."""

    folder: str | None = None
    name: str | None = None
    rotate: str | None = None
    keep: int | None = None
    keep_free: str | None = None
    metrics: int | None = None
    status: int | None = None


@dataclass(frozen=True, slots=True)
class View:
    """How the lists of the terminal UI look. `columns`: by list ("frames", "transactions") the names of its columns in
    order; a list that is not there has its usual ones. `time`: one of TIMES, "" as it is. `filter`: "" for none."""

    columns: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    time: str = ""
    filter: str = ""


@dataclass(frozen=True, slots=True)
class Config:
    """All buses by name, and the file they are from (None: there is none). `filters`: by name. `colours`: filters by
    the colour that rows get which they accept; the first that does counts. `views`: by name. `keys`: what they do by
    name → the keys for it."""

    path: Path | None
    buses: Mapping[str, Bus]
    alert: AlertSettings | None = None
    filters: Mapping[str, str] = field(default_factory=dict)
    colours: Mapping[str, str] = field(default_factory=dict)
    box: BoxSettings = field(default_factory=BoxSettings)
    outlets: OutletSettings = field(default_factory=OutletSettings)
    views: Mapping[str, View] = field(default_factory=dict)
    keys: Mapping[str, str] = field(default_factory=dict)


def candidates(start: Path) -> list[Path]:
    """Where a configuration may be, nearest first."""
    folders = [start, *start.parents]
    if sys.platform == "win32":
        user = Path(os.environ.get("APPDATA", Path.home()))
    else:
        user = Path(os.environ.get("XDG_CONFIG_HOME") or Path.home() / ".config")
    return [folder / FILE for folder in folders] + [user / "sniff485" / FILE]


def load(start: Path | None = None) -> Config:
    """The first configuration found, or an empty one. Raises ConfigError."""
    for path in candidates((start or _here()).resolve()):
        if path.is_file():
            return parse(path)
    return Config(None, {})


def _here() -> Path:
    try:
        return Path.cwd()
    except FileNotFoundError:
        raise ConfigError("the current folder is not there any more: go to one that is") from None


def parse(path: Path) -> Config:
    """Read one configuration file. Raises ConfigError."""
    try:
        text = path.read_text(encoding="utf-8")
        data = tomllib.loads(text)
    except OSError as error:
        raise ConfigError(f"{path}: {error.strerror}") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, RecursionError) as error:
        raise ConfigError(f"{path}: {error}") from None
    reader = _Reader(path, text)
    reader.check_keys(data, TOP_KEYS, "")
    buses = reader.table(data.get("bus", {}), "bus")
    named = {name: reader.bus(name, reader.table(entry, f"bus.{name}")) for name, entry in buses.items()}
    alert = reader.alert(reader.table(data["alert"], "alert")) if "alert" in data else None
    filters, colours = (reader.filters(data.get(name, {}), name) for name in ("filters", "colours"))
    reader.check_keys(colours, COLOURS, "colours")
    listed = reader.table(data.get("view", {}), "view")
    views = {name: reader.view(name, reader.table(entry, f"view.{name}")) for name, entry in listed.items()}
    entry = reader.table(data.get("keys", {}), "keys")
    keys = {name: reader.text(entry, name, "keys") or "" for name in entry}
    box = reader.box(reader.table(data.get("box", {}), "box"))
    told = outlet_settings.outlets(reader, data)
    return Config(path, named, alert, filters, colours, box, told, views, keys)


def save_view(name: str, view: View, start: Path | None = None) -> Path:
    """Write a view into the configuration that is in force, else the user's; where that is. Raises ConfigError, also
    where the name is taken, and OSError."""
    if not re.fullmatch(r"[A-Za-z0-9_-]+", name):
        raise ConfigError(f"{name!r}: a name of letters, digits, - and _")
    held = load(start)
    if name in held.views:
        raise ConfigError(f"{held.path}: [view.{name}] is there already")
    path = held.path or candidates((start or _here()).resolve())[-1]
    path.parent.mkdir(parents=True, exist_ok=True)
    lines = [f"[view.{name}]"]
    lines += [f"{which} = {json.dumps(list(words))}" for which, words in view.columns.items()]
    lines += [f"time = {json.dumps(view.time)}"] if view.time else []
    lines += [f"filter = {json.dumps(view.filter)}"] if view.filter else []
    before = path.read_text("utf-8") if path.exists() else ""
    gap = "" if not before else "\n" if before.endswith("\n") else "\n\n"
    with path.open("a", encoding="utf-8") as stream:
        stream.write(gap + "\n".join(lines) + "\n")
    return path


class _Reader:
    def __init__(self, path: Path, text: str) -> None:
        self.path = path
        self.lines = text.splitlines()

    def bus(self, name: str, entry: Mapping[str, Any]) -> Bus:
        section = f"bus.{name}"
        self.check_keys(entry, BUS_KEYS, section)
        line, protocol = self.text(entry, "line", section), self.text(entry, "protocol", section)
        settings: LineSettings | Literal["auto"] | None
        try:
            settings = AUTO if line == AUTO else LineSettings.parse(line) if line is not None else None
        except ValueError as error:
            raise self.error("line", section, f"{error}, or {AUTO}") from None
        known = (*registry.names(), AUTO)
        if protocol is not None and protocol not in known:
            raise self.error("protocol", section, f"unknown protocol {protocol!r}{nearest(protocol, known)}")
        devices = self.table(entry.get("devices", {}), f"{section}.devices")
        return Bus(
            name,
            self.text(entry, "port", section),
            settings,
            protocol,
            self.text(entry, "record", section),
            {key: self.device(devices, key, f"{section}.devices") for key in devices},
            {key: f"{self.path}:{self.line_of(key, section)}" for key in entry},
        )

    def filters(self, value: Any, section: str) -> dict[str, str]:
        """Filters by name; each is read, so that a wrong one is found before it is wanted."""
        from sniff.filter import FilterError, check_filter  # few configurations have any

        entry, found = self.table(value, section), dict[str, str]()
        for name in entry:
            found[name] = self.text(entry, name, section) or ""
            try:
                check_filter(found[name])
            except FilterError as error:
                raise self.error(name, section, f"{name}: {error}") from None
        return found

    def view(self, name: str, entry: Mapping[str, Any]) -> View:
        """Columns are only known to the lists, which say what is wrong with them."""
        section = f"view.{name}"
        self.check_keys(entry, VIEW_KEYS, section)
        columns: dict[str, tuple[str, ...]] = {}
        for which in ("frames", "transactions"):
            words = entry.get(which)
            if words is None:
                continue
            if not isinstance(words, list) or not words or not all(isinstance(word, str) for word in words):
                raise self.error(which, section, f'{which}: expected names of columns, such as ["no", "time"]')
            columns[which] = tuple(words)
        time = self.text(entry, "time", section) or ""
        if time and time not in TIMES:
            raise self.error("time", section, f"unknown time {time!r}{nearest(time, TIMES)}")
        return View(columns, time, self.filters({"filter": entry.get("filter", "")}, section).get("filter", ""))

    def text(self, entry: Mapping[str, Any], key: str, section: str) -> str | None:
        value = entry.get(key)
        if value is not None and not isinstance(value, str):
            raise self.error(key, section, f"expected a text in quotes, not {value!r}")
        return value

    def alert(self, entry: Mapping[str, Any]) -> AlertSettings:
        self.check_keys(entry, ALERT_KEYS, "alert")
        command, webhook = entry.get("command", []), self.text(entry, "webhook", "alert") or ""
        if not isinstance(command, list) or not all(isinstance(word, str) for word in command):
            raise self.error("command", "alert", 'expected a list of words, such as ["notify-send", "sniff485"]')
        if not command and not webhook:
            raise ConfigError(f'{self.path}: [alert]: say whom to tell: command = [...] or webhook = "https://..."')
        if webhook and not webhook.startswith(("http://", "https://")):
            raise self.error("webhook", "alert", f"{webhook!r}: expected http:// or https://")
        levels = {severity.label: severity for severity in Severity}
        level = self.text(entry, "at", "alert") or Severity.WARNING.label
        if level not in levels:
            raise self.error("at", "alert", f"unknown severity {level!r}{nearest(level, tuple(levels))}")
        every = entry.get("every", 600)
        if isinstance(every, bool) or not isinstance(every, int | float) or not 0 <= every <= MOST_EVERY:
            raise self.error("every", "alert", f"expected seconds, not {every!r}")
        return AlertSettings(tuple(command), webhook, levels[level], float(every))

    def box(self, entry: Mapping[str, Any]) -> BoxSettings:
        self.check_keys(entry, BOX_KEYS, "box")
        texts = {key: self.text(entry, key, "box") for key in ("folder", "name", "rotate", "keep_free")}
        if not re.fullmatch(r"[A-Za-z0-9_.-]+", texts["name"] or "site"):
            raise self.error("name", "box", f"{texts['name']!r}: letters, digits, '-', '_' and '.' name files")
        keep, metrics, status = (
            self.number(entry, key, "box", least) for key, least in (("keep", 1), ("metrics", 0), ("status", 0))
        )
        return BoxSettings(texts["folder"], texts["name"], texts["rotate"], keep, texts["keep_free"], metrics, status)

    def number(self, entry: Mapping[str, Any], key: str, section: str, least: int) -> int | None:
        value = entry.get(key)
        if value is not None and (isinstance(value, bool) or not isinstance(value, int) or value < least):
            raise self.error(key, section, f"expected a whole number from {least} on, not {value!r}")
        return value

    def device(self, devices: Mapping[str, Any], key: str, section: str) -> str:
        """The profile of a station; the key is its address, or "*" for every one."""
        try:
            fits = key == "*" or 0 <= int(key, 0) <= 255
        except ValueError:
            fits = False
        if not fits:
            raise self.error(key, section, f'{key!r}: expected an address 0 … 255, or "*" for every station')
        return self.text(devices, key, section) or ""

    def table(self, value: Any, name: str) -> Mapping[str, Any]:
        if not isinstance(value, dict):
            raise self.error(name.rpartition(".")[2], name.rpartition(".")[0], f"expected a table [{name}]")
        return value

    def check_keys(self, entry: Mapping[str, Any], known: tuple[str, ...], section: str) -> None:
        for key in entry:
            if key not in known:
                raise self.error(key, section, f"unknown key {key!r}{nearest(key, known)}")

    def error(self, key: str, section: str, what: str) -> ConfigError:
        """What names file, line and section."""
        return ConfigError(
            f"{self.path}:{self.line_of(key, section)}: [{section}] {what}"
            if section
            else f"{self.path}:{self.line_of(key, section)}: {what}"
        )

    def line_of(self, key: str, section: str) -> int:
        """Number of the line where a key stands (1 when it cannot be found: dotted or inline forms)."""
        inside = not section
        for number, line in enumerate(self.lines, 1):
            header = re.match(r"\s*\[([^\]]+)\]", line)
            if header is not None:
                name = header[1].replace('"', "").replace(" ", "")
                inside = name == section
                if name == (f"{section}.{key}" if section else key):
                    return number
            elif inside and re.match(rf"\s*[\"']?{re.escape(key)}[\"']?\s*[=.]", line):
                return number
        return 1


def nearest(word: str, known: tuple[str, ...]) -> str:
    """ "; did you mean 'line'?" or the list of what there is."""
    close = difflib.get_close_matches(word, known, 1, 0.5)
    return f"; did you mean {close[0]!r}?" if close else f"; known: {', '.join(known)}"
