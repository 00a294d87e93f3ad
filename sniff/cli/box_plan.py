"""What a box is told: flags, and behind them the configuration."""

from __future__ import annotations

import argparse
import os
from dataclasses import dataclass
from pathlib import Path

from sniff.box.page import HAS_UNIX, SUFFIX, runtime_folders
from sniff.cli import UNREADABLE, USAGE, Failure, arguments, outlets, targets
from sniff.config import AlertSettings
from sniff.outlet_settings import OutletSettings

ROTATE, KEEP_FREE, NAME = "size:64MB,time:1d", "1GB", "site"


@dataclass(frozen=True, slots=True)
class Plan:
    """What a box is told. `path`: of the recording, before the numbers of its parts. `socket`: None for none."""

    path: Path
    rotate: str
    keep: int | None
    keep_free: int
    socket: Path | None
    status_port: int | None
    outlets: OutletSettings | None = None
    alert: AlertSettings | None = None

    @property
    def name(self) -> str:
        """What the box is called."""
        return self.path.stem


def plan(args: argparse.Namespace) -> Plan:
    """Flags, and behind them the configuration. Ends with exit code 2 for what cannot be meant."""
    configured = targets.configured()
    told = configured.box
    try:
        rotate = args.rotate or arguments.rotation(told.rotate or ROTATE)
        keep_free = args.keep_free if args.keep_free is not None else arguments.octets(told.keep_free or KEEP_FREE)
    except argparse.ArgumentTypeError as error:
        raise Failure(f"[box] {error}", USAGE) from None
    folder = Path(args.folder or told.folder or os.environ.get("STATE_DIRECTORY", "").partition(":")[0] or ".")
    name = args.name or told.name or NAME
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise Failure(f"{folder}: {error.strerror}; name another --folder", UNREADABLE) from None
    socket = Path(args.socket) if args.socket else _socket(name)
    port = args.status_port if args.status_port is not None else told.status
    if args.metrics is None and told.metrics is not None and configured.outlets.metrics is None:
        args.metrics = str(told.metrics)
    path, keep = folder / f"{name}.mcap", args.keep or told.keep
    return Plan(path, rotate, keep, keep_free, socket, port, outlets.settings_of(args), configured.alert)


def _socket(name: str) -> Path | None:
    """Where the status page listens: in the first runtime directory that can be written to."""
    for folder in runtime_folders() if HAS_UNIX else ():
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError:
            continue
        if os.access(folder, os.W_OK):
            return folder / f"{name}{SUFFIX}"
    return None
