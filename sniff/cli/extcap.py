"""Wireshark starts this program itself: put the script that --script prints into Wireshark's extcap folder (Help →
About → Folders → Personal Extcap path), make it executable, restart Wireshark, and choose "sniff485" as interface.
"""

from __future__ import annotations

import argparse
import contextlib
import sys
from dataclasses import dataclass
from typing import TYPE_CHECKING

from dissectors import registry
from dissectors.line import LineSettings
from sniff.cli import PORT_TROUBLE, UNREADABLE, USAGE, Failure, arguments
from sniff.config import AUTO, Config, ConfigError, load
from sniff.formats.linktypes import link_type_for
from sniff.version import __version__

if TYPE_CHECKING:
    from sniff.bus.capture_writer import FrameWriter
    from sniff.capture.ipc import Ended
    from sniff.capture.link import CaptureLink

PREFIX = "sniff485:"

TOLERANT = True
"""Wireshark adds arguments with every version: unknown ones are passed over."""


def configure(parser: argparse.ArgumentParser) -> None:
    """Options of `extcap`; names as Wireshark gives them."""
    parser.add_argument("--script", action="store_true", help="print the script for Wireshark's extcap folder")
    parser.add_argument("--extcap-interfaces", action="store_true", help="list what can be captured from")
    parser.add_argument("--extcap-interface", metavar="NAME", help="the interface meant")
    parser.add_argument("--extcap-dlts", action="store_true", help="its link types")
    parser.add_argument("--extcap-config", action="store_true", help="its options")
    parser.add_argument("--extcap-version", nargs="?", help="Wireshark's version; not used")
    parser.add_argument("--capture", action="store_true", help="capture to --fifo until it is closed")
    parser.add_argument("--fifo", metavar="PATH", help="where Wireshark reads")
    arguments.add_line(parser, auto=False)


def run(args: argparse.Namespace) -> int:
    """Answer one of Wireshark's questions, or capture."""
    if args.script:
        print(f'#!/bin/sh\nexec "{sys.executable}" -m sniff extcap "$@"')
        return 0
    if args.extcap_interfaces:
        return _interfaces()
    if not args.extcap_interface:
        raise Failure("extcap: Wireshark starts this command; see `sniff485 extcap --help`", USAGE)
    bus = _bus(args)
    if args.extcap_dlts:
        number = link_type_for(bus.protocol)
        print(f"dlt {{number={number}}}{{name=DLT{number}}}{{display={registry.get(bus.protocol).title}}}")
        return 0
    if args.extcap_config:
        return _config(bus)
    if args.capture and args.fifo:
        return _capture(bus, args.fifo)
    raise Failure("extcap: --capture needs --fifo", USAGE)


@dataclass(frozen=True, slots=True)
class _Bus:
    port: str
    line: LineSettings
    protocol: str


def _load() -> Config:
    try:
        return load()
    except ConfigError as error:
        raise Failure(str(error), USAGE) from None


def _interfaces() -> int:
    from sniff.sources.ports import list_ports

    print(f"extcap {{version={__version__}}}{{help=sniff485}}{{display=sniff485}}")
    for bus in _load().buses.values():
        print(f"interface {{value={PREFIX}{bus.name}}}{{display=RS-485 bus {bus.name} (sniff485)}}")
    for port in list_ports():
        print(f"interface {{value={PREFIX}{port.device}}}{{display=RS-485 on {port.device} (sniff485)}}")
    return 0


def _bus(args: argparse.Namespace) -> _Bus:
    name = args.extcap_interface.removeprefix(PREFIX)
    known = _load().buses.get(name)
    protocol = args.protocol or (known.protocol if known is not None else None) or registry.DEFAULT
    said = args.line or (known.line if known is not None else None)
    line = said if isinstance(said, LineSettings) else None
    if protocol == AUTO:  # Wireshark asks for a link type before anything is heard
        protocol = registry.DEFAULT
    port = known.port if known is not None and known.port else name
    return _Bus(port, line or LineSettings.parse(registry.get(protocol).default_line), protocol)


def _config(bus: _Bus) -> int:
    print("arg {number=0}{call=--protocol}{display=Protocol}{type=selector}{tooltip=What the bus speaks}")
    for name in registry.names():
        default = "true" if name == bus.protocol else "false"
        print(f"value {{arg=0}}{{value={name}}}{{display={registry.get(name).title}}}{{default={default}}}")
    print("arg {number=1}{call=--line}{display=Line settings}{type=string}"
          f"{{default={bus.line}}}{{tooltip=Baud rate and format, for instance 19200,8E1}}")  # fmt: skip
    return 0


def _capture(bus: _Bus, fifo: str) -> int:
    from pathlib import Path

    from sniff.bus.capture_writer import live_pcapng
    from sniff.capture.config import SourceSpec
    from sniff.capture.link import CaptureLink
    from sniff.cli.interruption import until_interrupted
    from sniff.engine.capture import CaptureError
    from sniff.sources import PortError

    if not Path(fifo).exists():
        raise Failure(f"extcap: {fifo}: no such pipe; Wireshark makes it", UNREADABLE)
    with until_interrupted() as caught, contextlib.ExitStack() as stack:  # from before it begins
        try:
            link = stack.enter_context(CaptureLink.start([SourceSpec(bus.port, bus.line, bus.protocol, "rs485")]))
        except PortError as error:
            raise Failure(str(error), PORT_TROUBLE) from None
        try:
            writer = live_pcapng(fifo, link.session(0))
            ended = _pass_on(link, writer, caught)
            writer.close()
        except (CaptureError, BrokenPipeError):
            return 0  # Wireshark stopped reading: that is how it ends a capture
    return 0 if ended is None or ended.clean else PORT_TROUBLE


def _pass_on(link: CaptureLink, writer: FrameWriter, caught: list[int]) -> Ended | None:
    """Frames as they come, until the capture ends; None where a signal came first."""
    from sniff.capture.ipc import Ended, ReceivedMessage, Tick

    while not caught:
        for message in link.receive(0.2):
            if isinstance(message, ReceivedMessage):
                writer.write(message.item)
            elif isinstance(message, Tick):
                writer.advance(message.now)
            elif isinstance(message, Ended):
                return message
    return None
