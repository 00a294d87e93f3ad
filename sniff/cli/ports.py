"""An adapter's latency is how long it may hold octets back: every response time is uncertain by as much."""

from __future__ import annotations

import argparse

from dissectors.line import MS
from sniff.analysis.sanitizing import sanitized
from sniff.cli import json_output


def configure(parser: argparse.ArgumentParser) -> None:
    """Options of `ports`."""
    parser.add_argument("--json", action="store_true", help="one JSON object a port")


def run(args: argparse.Namespace) -> int:
    """List the ports of this machine."""
    from sniff.sources.ports import list_ports

    found = list_ports()
    for port in found:
        adapter = port.adapter
        if args.json:
            record = {
                "device": port.device,
                "adapter": adapter.name,
                "driver": adapter.driver or None,
                "serial_number": adapter.serial_number or None,
                "adapter_latency_ms": adapter.latency / MS,
                "latency_from": adapter.latency_from,
                "reports": None if adapter.reports is None else list(adapter.reports),
                "detail": adapter.detail,
                "latency_timer_ms": port.latency_timer,
                "held_by": [str(holder) for holder in port.holders],
            }
            print(json_output.dumps(record))
            continue
        reports = "unknown" if adapter.reports is None else ", ".join(adapter.reports) or "none"
        name = sanitized(adapter.name)  # an adapter may call itself anything
        print(f"{port.device}  {name}{f' ({adapter.driver})' if adapter.driver else ''}")
        print(f"    {sanitized(adapter.delay_words)}")
        print(f"    line errors it reports: {reports}{'; ' + adapter.detail if adapter.detail else ''}")
        for holder in port.holders:
            print(f"    held by {sanitized(holder)}")  # and a process, too
    if not found and not args.json:
        print("no serial ports; try `sniff485 demo`, or a gateway: socket://HOST:PORT")
    return 0
