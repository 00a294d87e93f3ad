"""Simulated stations on a virtual bus of pseudo-terminals, with faults; the capture is the real one. Nothing is
recorded unless -w says where. Where output is no terminal, frames come as lines for --duration, then a summary.
"""

from __future__ import annotations

import argparse
import contextlib
import sys

from dissectors import registry
from sniff.capture.config import RecordSpec, SourceSpec
from sniff.cli import PORT_TROUBLE, USAGE, Failure, arguments, listening, outlets, standard_streams, targets
from sniff.cli.interruption import until_interrupted
from sniff.cli.live import show

DEFAULT_DURATION = 10.0


def configure(parser: argparse.ArgumentParser) -> None:
    """Options of `demo`."""
    arguments.add_line(parser, auto=False)
    arguments.add_devices(parser)
    parser.add_argument("--seed", type=int, default=485, metavar="N", help="which faults strike when (default: 485)")
    parser.add_argument("--clean", action="store_true", help="no faults on the line; who is absent stays so")
    arguments.add_recording(parser, "record to FILE (.mcap)")
    parser.add_argument(
        "--duration", type=arguments.duration, metavar="TIME", help="stop after (default: with no terminal 10s)"
    )
    parser.add_argument(
        "--json", action="store_true", help="JSON lines instead of the terminal UI: frames, values, findings, health"
    )
    parser.add_argument("--lines", action="store_true", help="lines of text instead of the terminal UI")
    outlets.add_outlets(parser)


def run(args: argparse.Namespace) -> int:
    """Run the virtual bus and listen to it."""
    from sniff.simulation.bus import BusFailed, VirtualBus
    from sniff.simulation.scenarios import UnknownScenario, scenario

    try:
        plan = scenario(args.protocol or registry.DEFAULT, args.seed, not args.clean, args.line)
    except UnknownScenario as error:
        raise Failure(f"demo: {error}", USAGE) from None
    told_to = outlets.prepare(outlets.settings_of(args), [outlets.Printed()] if args.json else ())
    on_terminal = arguments.on_terminal() and not args.json and not args.lines
    duration = args.duration or (None if on_terminal else DEFAULT_DURATION)
    print(f"sniff485: virtual bus, {plan.line}: {plan.text}", file=sys.stderr)
    devices = arguments.devices_of(args, {str(address): name for address, name in plan.devices.items()})
    try:
        with VirtualBus.from_scenario(plan, paused=True) as bus:
            source = SourceSpec(
                bus.tap(), plan.line, plan.protocol, "demo", targets.notes_of(devices), profiles=devices.documents
            )
            record = RecordSpec(args.write) if args.write else None
            with contextlib.nullcontext() if on_terminal else until_interrupted():  # from before it begins
                live = listening.start(source, record, duration, devices)
                bus.begin()  # with the sniffer listening, so that the first words of the bus are heard
                return show([live], args.json, args.lines, told_to)
    except (BusFailed, OSError) as error:
        output = isinstance(error, OSError) and error.filename == standard_streams.OUTPUT
        if output or isinstance(error, BrokenPipeError):  # nothing of the bus: whoever takes our output
            raise
        raise Failure(f"demo: no virtual bus here: {error}", PORT_TROUBLE) from None
