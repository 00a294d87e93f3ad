"""`config show` prints every value in force with the file and line it comes from."""

from __future__ import annotations

import argparse
from dataclasses import asdict

from sniff.cli import USAGE, Failure, json_output
from sniff.config import FILE, ConfigError, load


def configure(parser: argparse.ArgumentParser) -> None:
    """Options of `config`."""
    parser.add_argument("action", choices=["show"], help="show: what is configured, and where")
    parser.add_argument("--json", action="store_true", help="one JSON object a bus")


def run(args: argparse.Namespace) -> int:
    """Print the configuration."""
    try:
        config = load()
    except ConfigError as error:
        raise Failure(str(error), USAGE) from None
    if config.path is None and not args.json:
        print(f"no {FILE} in this folder, above it, or in the user's configuration folder")
    for bus in config.buses.values():
        values = {
            "port": bus.port,
            "line": str(bus.line) if bus.line is not None else None,
            "protocol": bus.protocol,
            "record": bus.record,
            "devices": dict(bus.devices) or None,
        }
        if args.json:
            print(json_output.dumps({"bus": bus.name, **values, "from": dict(bus.origin)}))
            continue
        print(f"[bus.{bus.name}]")
        for key, value in values.items():
            if value is not None:
                print(f"  {key} = {value!r}  # {bus.origin.get(key, config.path)}")
    box = {key: value for key, value in asdict(config.box).items() if value is not None}
    if box and args.json:
        print(json_output.dumps({"box": box, "from": str(config.path)}))
    elif box:
        print("[box]")
        for key, value in box.items():
            print(f"  {key} = {value!r}  # {config.path}")
    for section, filters in (("filters", config.filters), ("colours", config.colours)):
        if filters and args.json:
            print(json_output.dumps({section: dict(filters), "from": str(config.path)}))
        elif filters:
            print(f"[{section}]")
            for name, text in filters.items():
                print(f"  {name} = {text!r}  # {config.path}")
    return 0
