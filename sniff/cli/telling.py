"""The outlets of a running capture: triggers mark it, alerts leave it."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Iterator, Sequence

from dissectors import registry
from dissectors.manifest import Dissector
from sniff.analysis.sanitizing import sanitized
from sniff.bus.triggers import Triggers
from sniff.cli import USAGE, Failure, targets
from sniff.cli.printing import Printer
from sniff.config import AlertSettings
from sniff.filter import Scope


def refuse_triggers(words: Sequence[str], buses: Sequence[targets.Target]) -> None:
    """Before anything begins: ends with exit code 2 for what cannot be understood of a bus whose protocol is given."""
    for bus in buses if words else ():
        if "protocol" not in bus.source.unknown:
            _triggers(words, registry.get(bus.source.protocol), Scope(devices=bus.devices))


def add_triggers(printers: Sequence[Printer], words: Sequence[str]) -> None:
    """Watch every bus for what `--on` names; ends with exit code 2 for what cannot be understood."""
    for printer in printers if words else ():
        live = printer.live
        printer.triggers = _triggers(words, live.dissector, Scope(live.session.started, live.devices))


def _triggers(words: Sequence[str], dissector: Dissector, scope: Scope) -> Triggers:
    try:
        return Triggers(words, dissector, scope)
    except ValueError as error:
        raise Failure(f"--on: {error}", USAGE) from None


@contextlib.contextmanager
def alerting(printers: Sequence[Printer], settings: AlertSettings | None) -> Iterator[None]:
    """Meanwhile whoever the configuration names is told what is new about the buses."""
    if settings is None:
        yield
        return
    from sniff.outlets.alerts import Alerts
    from sniff.outlets.news import NewsDesk

    alerts = Alerts(settings, lambda text: print(f"sniff485: {sanitized(text)}", file=sys.stderr))
    for printer in printers:
        printer.alerts = alerts, NewsDesk(settings.least, int(settings.every * 1e9))
    try:
        yield
    finally:
        alerts.close()
        if alerts.dropped:
            print(f"sniff485: {alerts.dropped} alerts dropped: nobody took them in time", file=sys.stderr)
