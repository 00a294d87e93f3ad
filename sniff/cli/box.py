"""run (the default) listens to every bus of the configuration that has a port, for ever: into parts of a size, with a
limit to what they take of the disk. A port that is not there is waited for; a capture that ends is begun anew; parts
that a power cut left open are closed at the next start. status asks a box how it stands: exit code 1 where something is
down, lost or not recorded, 4 where no box runs. unit and udev print what systemd and udev want:

  sniff485 box udev | sudo tee /etc/udev/rules.d/60-sniff485.rules
  sniff485 box unit | sudo tee /etc/systemd/system/sniff485-box.service

[box] in sniff485.toml has folder, name, rotate, keep, keep_free, metrics and status; flags win.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from sniff.cli import PORT_TROUBLE, USAGE, Failure, arguments, json_output, outlets, targets
from sniff.config import FILE

DOWN = 1
"""Exit code of `box status` where not all is well."""


def configure(parser: argparse.ArgumentParser) -> None:
    """Options of `box`."""
    parser.add_argument("what", nargs="?", choices=["run", "status", "unit", "udev"], default="run")
    parser.add_argument("--folder", metavar="DIR", help="where parts go; default: this folder")
    parser.add_argument("--name", metavar="NAME", help="of the parts: NAME-0001.mcap …; default: site")
    parser.add_argument("--rotate", type=arguments.rotation, metavar="RULE", help="default: size:64MB,time:1d")
    parser.add_argument("--keep", type=arguments.positive, metavar="N", help="keep the N newest parts")
    parser.add_argument(
        "--keep-free", type=arguments.octets, metavar="SIZE", help="keep so much of the disk free; default: 1GB"
    )
    parser.add_argument(
        "--status-port",
        type=arguments.tcp_port,
        metavar="PORT",
        help="the status page on the loopback, too (/, /status)",
    )
    parser.add_argument("--socket", metavar="PATH", help="of the status page; default: NAME.sock in /run/sniff485")
    parser.add_argument("--json", action="store_true", help="status as one JSON object")
    arguments.add_line(parser, auto=True)
    arguments.add_devices(parser)
    outlets.add_outlets(parser)


def run(args: argparse.Namespace) -> int:
    """Do what is asked for."""
    if args.what == "status":
        return _status(args)
    if args.what in ("unit", "udev"):
        from sniff.box import shipped

        print(shipped.unit() if args.what == "unit" else shipped.rules(), end="")
        return 0
    from sniff.cli import box_plan, box_running

    if not any(bus.port for bus in targets.configured().buses.values()):
        raise Failure(f"no bus with a port is configured; name some in {FILE} ([bus.NAME], port = …)", USAGE)
    args.ports, args.all = [], True
    wanted = targets.targets_of(args)
    return box_running.run(box_plan.plan(args), wanted)


def _status(args: argparse.Namespace) -> int:
    from sniff.box import page, words

    where = _where(args)
    try:
        status = page.ask(where)
    except PermissionError:
        raise Failure(f"{where}: permission denied; who may read serial ports may ask", PORT_TROUBLE) from None
    except OSError as error:
        at = f"127.0.0.1:{where}" if isinstance(where, int) else where
        raise Failure(f"{at}: {error.strerror or error}: no box answers there", PORT_TROUBLE) from None
    if args.json:
        print(json_output.dumps(status.to_json()))
    else:
        print(words.text(status), end="")
    return 0 if status.is_well else DOWN


def _where(args: argparse.Namespace) -> Path | int:
    """The socket or port of the box that is asked; ends with exit code 4 where there is none, 2 where there is a
    choice."""
    from sniff.box import page

    if args.status_port is not None:
        return int(args.status_port)
    if args.socket is not None:
        return Path(args.socket)
    configured = targets.configured().box.status
    if not page.HAS_UNIX and not configured:
        raise Failure("this system has no sockets with names; ask with --status-port PORT", USAGE)
    if not page.HAS_UNIX and configured:
        return configured
    folders = page.runtime_folders()
    found = page.sockets(folders)
    if args.name is not None:
        found = [path for path in found if path.stem == args.name]
    if not found:
        looked = ", ".join(map(str, folders))
        raise Failure(f"no box runs here (looked in {looked}); name its --socket or --status-port", PORT_TROUBLE)
    if len(found) > 1:
        print(f"sniff485: several boxes: {', '.join(map(str, found))}", file=sys.stderr)
        raise Failure("which box? say --name or --socket", USAGE)
    return found[0]
