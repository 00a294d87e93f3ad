"""The buses that somebody names: ports, configured buses, all of them; where recordings go."""

from __future__ import annotations

import argparse
import os
import re
import sys
import time
from collections import Counter
from dataclasses import dataclass, field, replace
from pathlib import Path

from dissectors import registry
from dissectors.line import LineSettings
from dissectors.profiles import Devices
from sniff.analysis.sanitizing import sanitized
from sniff.capture.config import SourceSpec
from sniff.cli import UNREADABLE, USAGE, Failure, arguments
from sniff.cli.searching import Unknowns
from sniff.config import AUTO, FILE, Config, ConfigError, load
from sniff.engine.session import DEVICES_NOTE

NAMED = 3
"""Buses that the name of a new file names."""


@dataclass(frozen=True, slots=True)
class Target:
    """The bus to listen to, where its recording goes by configuration (None: not said), and who is on it."""

    source: SourceSpec
    record: str | None = None
    devices: Devices = field(default_factory=Devices)
    search: Unknowns | None = None
    """What is to be found by listening (`auto`); None when everything is given."""


def target_of(args: argparse.Namespace) -> Target:
    """What PORT, -s and -p mean, with the configuration behind them; flags win. Ends with exit code 2."""
    config = configured()
    return _target(args, config, args.port or _only_port(config))


def targets_of(args: argparse.Namespace) -> list[Target]:
    """The same for any number of `args.ports`, or with `args.all` every bus of the configuration; no two buses have one
    name. Ends with exit code 2."""
    config = configured()
    wanted = list(args.ports)
    if args.all:
        if wanted:
            raise Failure("--all: every configured bus; name no port beside it", USAGE)
        wanted = [name for name, bus in config.buses.items() if bus.port]
        if not wanted:
            raise Failure(f"--all: no bus with a port is configured; name some in {FILE}", USAGE)
    targets = [_target(args, config, port) for port in wanted or [_only_port(config)]]
    twice = next((port for port, count in Counter(one.source.spec for one in targets).items() if count > 1), None)
    if twice is not None:
        raise Failure(f"{sanitized(twice)}: named twice; a port is listened to once", USAGE)
    return _with_names_of_their_own(targets)


def _with_names_of_their_own(targets: list[Target]) -> list[Target]:
    taken: set[str] = set()
    named = []
    for target in targets:
        name, number = target.source.bus, 2
        while name in taken:
            name, number = f"{target.source.bus}-{number}", number + 1
        taken.add(name)
        named.append(replace(target, source=replace(target.source, bus=name)))
    return named


def configured() -> Config:
    """The configuration; ends with exit code 2 for one that cannot be used."""
    try:
        return load()
    except ConfigError as error:
        raise Failure(str(error), USAGE) from None


def _target(args: argparse.Namespace, config: Config, wanted: str) -> Target:
    bus = config.buses.get(wanted)
    if bus is None:
        _refuse_unknown(wanted, config)
    port = (bus.port or wanted) if bus is not None else wanted
    if not (args.port if "port" in args else args.ports or args.all):
        print(f"sniff485: no port named: listening to {sanitized(port)}, the only one there is", file=sys.stderr)
    configured = args.protocol or (bus.protocol if bus is not None else None)
    said: LineSettings | str | None = args.line or (bus.line if bus is not None else None)
    auto = AUTO in (said, configured)
    line = said if isinstance(said, LineSettings) else None
    protocol = configured or (AUTO if auto else registry.DEFAULT)
    search = None
    if auto:
        search = Unknowns(line, None if protocol == AUTO else protocol)
        trying = search.detecting()
        line, protocol = trying.wanted, trying.protocols[0]
    if line is None:
        line = LineSettings.parse(registry.get(protocol).default_line)
        print(f"sniff485: no line settings given (-s): assuming {line} for {protocol}", file=sys.stderr)
    name = bus.name if bus is not None else re.sub(r"[^A-Za-z0-9_-]+", "-", _short(port)).strip("-") or "bus"
    devices = arguments.devices_of(args, bus.devices if bus is not None else None)
    unknown = search.names if search is not None else ()
    source = SourceSpec(port, line, protocol, name, notes_of(devices), unknown, devices.documents)
    return Target(source, bus.record if bus is not None else None, devices, search)


def _short(port: str) -> str:
    """What names a port in the name of a file: the last part of its path, "pts-0" of a pseudo-terminal."""
    path = Path(port)
    return f"pts-{path.name}" if path.parent.name == "pts" else path.name


def _refuse_unknown(word: str, config: Config) -> None:
    """End with exit code 2 for a plain word that is neither a file nor a configured bus: it can be no port."""
    if not re.fullmatch(r"[A-Za-z0-9_-]+", word) or re.fullmatch(r"COM\d+", word, re.IGNORECASE) or Path(word).exists():
        return
    device = Path("/dev") / word
    if device.is_char_device():
        raise Failure(f"{word}: no such port or configured bus; did you mean {device}?", USAGE)
    if re.match("tty|rfcomm", word):  # as ports are named
        from sniff.sources.ports import list_ports

        there = " ".join(port.device for port in list_ports())
        said = f"ports here: {there}" if there else "this machine shows no serial ports"
        raise Failure(f"{word}: no such port; {said}", USAGE)
    if config.path is None:
        looked = f"there is no {FILE} in this folder, in one above it, or in the user's configuration"
    else:
        looked = f"{config.path} has {', '.join(config.buses) or 'none'}"
    raise Failure(f"{sanitized(word)}: no such bus is configured: {looked}", USAGE)


def _only_port(config: Config) -> str:
    """The bus or port that can only be meant when none is named. Ends with exit code 2 where there is a choice."""
    if len(config.buses) == 1:
        return next(iter(config.buses))
    from sniff.sources.ports import list_ports

    there = [*config.buses] or [port.device for port in list_ports()]
    if len(there) == 1:
        return there[0]
    found = f"there are: {', '.join(there)}" if there else "there are no serial ports here; try `sniff485 demo`"
    raise Failure(f"which port? {found}", USAGE)


def notes_of(devices: Devices) -> dict[str, str]:
    """What a recording says of its devices."""
    return {DEVICES_NOTE: devices.text()} if devices else {}


def refuse_recording(path: str) -> None:
    """Refuse what cannot be a recording before the port is opened. Ends with exit code 2, 3 for a directory."""
    if path == "-":
        raise Failure("-w -: a recording needs a file; `sniff485 live PORT --json` gives frames as they come", USAGE)
    if path.endswith(("/", os.sep)) or Path(path).is_dir():
        raise Failure(f"{path}: a directory; name a file in it", UNREADABLE)
    if not path.lower().endswith(".mcap"):
        raise Failure(f"{path}: recordings are .mcap; convert it afterwards with `sniff485 convert`", USAGE)


def new_recording(bus: str) -> str:
    """A name in this folder that no file has: sniff485-<bus>-<date>-<time>.mcap."""
    name = re.sub(r'[\x00-\x1f\x7f\\/:*?"<>|]+', "-", bus)  # of the configuration: what no file may be called
    stem = f"sniff485-{name}-{time.strftime('%Y%m%d-%H%M%S')}"
    path, number = Path(f"{stem}.mcap"), 2
    while path.exists():
        path, number = Path(f"{stem}-{number}.mcap"), number + 1
    return str(path)
